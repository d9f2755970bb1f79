"""Files that another process makes from a scene while the window goes on."""

import time
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.animation import Animation
from fba.face import resolve
from fba_player.export._background import Export, ExportOptions, part, write
from fba_player.scene.compare import CompareScene
from fba_player.scene.scene import Scene
from fba_player.view._camera import Camera

OPTIONS = ExportOptions(size=(64, 48), camera=Camera(target=(0.0, 1.6, 0.0)), time=0.0)


def finish(export: Export) -> Export:
    begun = time.monotonic()
    while not export.finished:
        assert time.monotonic() - begun < 120
        time.sleep(0.05)
        export.poll()
    return export


def test_a_film_is_made_by_another_process(talking: Animation, tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    scene = Scene(talking)
    scene.show("wireframe")
    export = finish(Export(scene, tmp_path / "talk.mp4", OPTIONS))
    assert (export.problem, export.done, export.total, export.share) == ("", 10, 10, 1.0)
    with av.open(str(tmp_path / "talk.mp4")) as film:
        assert len(list(film.decode(video=0))) == 10
    export.close()


def test_what_goes_wrong_is_told(talking: Animation, tmp_path: Path) -> None:
    export = finish(Export(Scene(talking), tmp_path / "talk.xyz", OPTIONS))
    assert "xyz" in export.problem
    export = finish(Export(Scene(talking), tmp_path / "no" / "talk.fba", OPTIONS))
    assert export.problem


def test_cancelled_it_leaves_no_file(tmp_path: Path) -> None:
    frames = Animation(25, np.arange(20000), face=fba.FaceTrack.empty(20000))
    export = Export(Scene(frames), tmp_path / "long.gif", OPTIONS)
    begun = time.monotonic()
    while not export.done:
        assert time.monotonic() - begun < 120
        time.sleep(0.05)
        export.poll()
    export.close()
    export.close()
    assert export.finished
    assert list(tmp_path.iterdir()) == []


@pytest.mark.filterwarnings("ignore:.*holds no face")
@pytest.mark.parametrize("suffix", [".fba", ".bvh", ".glb", ".png"])
def test_the_suffix_says_what_is_written(walking: Animation, tmp_path: Path, suffix: str) -> None:
    write(Scene(walking), str(tmp_path / f"walk{suffix}"), OPTIONS)
    assert (tmp_path / f"walk{suffix}").stat().st_size > 100


def test_a_part_begins_with_what_was_in_force(walking: Animation, tmp_path: Path) -> None:
    values, mask = walking.face.values.copy(), walking.face.mask.copy()  # type: ignore[union-attr]
    values[0, 2], mask[0, 2], mask[1:, 2] = 300, True, False  # the jaw is sent once
    face = fba.FaceTrack(values, mask)
    whole = Animation(25, np.arange(10), face, walking.body)
    cut = part(whole, 0.2, 0.32)
    assert cut.index.tolist() == [5, 6, 7]
    assert cut.face is not None
    np.testing.assert_array_equal(resolve(cut.face), resolve(face)[5:8])
    with pytest.raises(ValueError, match="no frame"):
        part(whole, 5.0, 6.0)


def test_scenes_are_the_same_in_another_process(walking: Animation, talking: Animation) -> None:
    import pickle

    scene = Scene(walking, axes="vreng", view="points")
    scene.show("grid")
    scene.follow, scene.orbit = "hips", 5.0
    scene.view_at(0.1)  # its figures are built
    copy = pickle.loads(pickle.dumps(scene))
    assert (copy.axes, copy.view, copy.follow, copy.orbit) == ("vreng", "points", "hips", 5.0)
    assert copy.switches.changed == {"grid": True}
    np.testing.assert_array_equal(copy.view_at(0.2).capsules, scene.view_at(0.2).capsules)
    both = pickle.loads(pickle.dumps(CompareScene([scene, Scene(talking)], names=("a", "b"))))
    assert (both.names, both.arrangement, len(both.scenes)) == (("a", "b"), "side", 2)
