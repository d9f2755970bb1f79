"""The same pose drawn by pyrender and by us: the silhouettes agree."""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from fba.animation import Animation
from fba.errors import DisplayError
from fba.player import to_pyrender
from fba_player.export import _pyrender_bridge as pyrender_bridge
from fba_player.export._pyrender_bridge import _numpy_1_names

BOTH = """
import json, sys
import numpy as np
from fba import player
from player_tracks import body_track, face_track
from fba.animation import Animation

HEAD = {3: 700, 48: 20000, 49: -40000, 31: 80}  # the jaw opens, head and eyes turn
ARM = {32: 90000, 8: 50000, 11: -80000}
cases = {
    "head": (Animation(25, np.arange(1), face_track([HEAD])), "three-quarter", (320, 240)),
    "body": (Animation(25, np.arange(1), face_track([{}]), body_track([ARM])), "body", (960, 720)),
}
found = {}
for name, (animation, camera, size) in cases.items():
    scene = player.to_pyrender(None, animation, 0.0, camera=camera, aspect=4 / 3)
    import pyrender
    drawing = pyrender.OffscreenRenderer(*size)
    colour, depth = drawing.render(scene)
    drawing.delete()
    ours = player.Scene(animation)
    ours.show("background", "transparent")
    ours.show("shadows", False)
    ours.show("lod", "full")
    with player.Offscreen(ours, size, camera, samples=4) as view:
        picture = view.frame(0.0)
    one, other = depth > 0, picture[..., 3] > 127
    inside = one & other
    found[name] = {
        "iou": float(inside.sum() / (one | other).sum()),
        "share": float(other.mean()),
        "brightness": [float(pixels[inside][:, :3].mean()) for pixels in (colour, picture)],
        "meshes": len(scene.meshes),
        "lights": len(scene.directional_lights),
        "scale": float(scene.scale),
    }
found["numpy"] = [name for name in ("infty", "Inf", "NaN", "float_") if hasattr(np, name)]
print(json.dumps(found))
"""


@pytest.mark.slow
@pytest.mark.usefixtures("opengl")
def test_silhouettes_agree() -> None:
    if find_spec("pyrender") is None:
        pytest.skip('pyrender is not installed: pip install ".[pyrender]"')
    root = Path(__file__).parents[3]
    folders = [str(root / folder) for folder in ("tests/helpers", "", "player")]
    folders.append(os.environ.get("PYTHONPATH", ""))
    environment = {**os.environ, "PYOPENGL_PLATFORM": "egl", "PYTHONPATH": os.pathsep.join(folders)}
    done = subprocess.run(
        [sys.executable, "-c", BOTH],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found.pop("numpy") == []
    for name, one in found.items():
        assert one["iou"] > 0.99, name
        assert one["share"] > 0.05, name
        assert one["lights"] == 3
        assert one["meshes"] >= 4
        assert 0.5 < one["brightness"][0] / one["brightness"][1] < 2
    assert 0.3 < found["head"]["scale"] < 1.2  # metres, corner to corner
    assert 1.7 < found["body"]["scale"] < 2.6


def test_pyrender_missing_is_named(talking: Animation, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyrender", None)
    monkeypatch.setattr(pyrender_bridge, "missing_libraries", list)  # whatever this machine has
    before = set(vars(np))
    with pytest.raises(DisplayError, match=r"pip install pyrender;.*PYOPENGL_PLATFORM=egl"):
        to_pyrender(None, talking, 0.0)
    assert set(vars(np)) == before


def test_names_of_numpy_1_exist_only_within_the_block() -> None:
    with _numpy_1_names():
        assert np.infty == np.inf  # type: ignore[attr-defined]  # noqa: NPY201
    assert not hasattr(np, "infty")
    with pytest.raises(KeyError), _numpy_1_names():
        raise KeyError
    assert not hasattr(np, "infty")
