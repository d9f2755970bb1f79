"""Numbered pictures: their names, and that no mix of two sequences comes about."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fba.animation import Animation
from fba.errors import FormatError, UnsupportedError
from fba.player import Scene, render
from fba_player.export.image_files import Numbered, Sequence, is_sequence

SMALL = (24, 16)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def read(path: Path) -> np.ndarray:
    with Image.open(path) as picture:
        return np.array(picture)


@pytest.mark.parametrize(
    ("path", "first", "later"),
    [
        ("frames/", "frames/00000.png", "frames/123456.png"),
        ("a/b-%03d.jpg", "a/b-000.jpg", "a/b-123456.jpg"),
        ("%d.png", "0.png", "123456.png"),
        ("x/%08dz.PNG", "x/00000000z.PNG", "x/00123456z.PNG"),
    ],
)
def test_names(path: str, first: str, later: str) -> None:
    assert is_sequence(path)
    numbered = Numbered(path)
    assert (str(numbered.path(0)), str(numbered.path(123456))) == (first, later)


@pytest.mark.parametrize("path", ["a%02d%02d.png", "50%.png", "%s.png", "%5d.png", "f%d/a%d.png", "%%.png"])
def test_names_without_one_number_are_refused(path: str) -> None:
    with pytest.raises(UnsupportedError, match="%0"):
        Numbered(path)


def test_single_pictures_and_films_are_not_sequences() -> None:
    assert not any(is_sequence(path) for path in ("a.png", "100%/a.png", "a.mp4"))


def test_only_pictures(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedError, match=r"\.png or \.jpg"):
        Sequence(Numbered(f"{tmp_path}/%d.gif"), 3)
    with pytest.raises(UnsupportedError, match="transparent"):
        Sequence(Numbered(f"{tmp_path}/%d.jpg"), 3, transparent=True)


def test_an_older_sequence_is_not_mixed_with(tmp_path: Path) -> None:
    numbered = Numbered(f"{tmp_path}/%03d.png")
    Sequence(numbered, 2)  # an empty folder is fine
    for name in ("000.png", "002.png", "x.png", "0000000.jpg"):
        (tmp_path / name).write_bytes(b"old")
    with pytest.raises(
        FormatError, match=r"000.png to 002.png \(2 pictures\) are in this folder already.*replace=True"
    ):
        Sequence(numbered, 3)
    Sequence(numbered, 3, replace=True)
    with pytest.raises(FormatError, match=r"002.png is left from a longer sequence"):
        Sequence(numbered, 2, replace=True)
    assert names(tmp_path) == ["000.png", "0000000.jpg", "002.png", "x.png"]


def test_a_folder_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "frames").write_bytes(b"")
    with pytest.raises(FormatError, match="cannot be"):
        Sequence(Numbered(f"{tmp_path}/frames/"), 2)


@pytest.mark.usefixtures("opengl")
class TestDrawn:
    def test_every_frame_is_a_picture(self, talking: Animation, tmp_path: Path) -> None:
        folder = tmp_path / "new" / "frames"
        seen: list[tuple[int, int]] = []
        done = render(talking, f"{folder}/", size=SMALL, end=0.12, progress=lambda *at: seen.append(at))
        assert done == folder
        assert names(folder) == ["00000.png", "00001.png", "00002.png"]
        assert seen == [(1, 3), (2, 3), (3, 3)]
        pixels = [read(folder / name) for name in names(folder)]
        assert all(one.shape == (16, 24, 3) for one in pixels)
        with pytest.raises(FormatError, match="already"):
            render(talking, f"{folder}/", size=SMALL, end=0.12)
        render(talking, f"{folder}/%05d.png", size=SMALL, end=0.12, replace=True)
        for name, before in zip(names(folder), pixels, strict=True):
            np.testing.assert_array_equal(read(folder / name), before)

    def test_interrupted_it_leaves_whole_pictures(self, talking: Animation, tmp_path: Path) -> None:
        def stop(done: int, of: int) -> None:
            if done == 3:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            render(talking, f"{tmp_path}/%02d.png", size=SMALL, progress=stop)
        assert set(names(tmp_path)) <= {"00.png", "01.png", "02.png"}
        assert all(read(tmp_path / name).shape == (16, 24, 3) for name in names(tmp_path))

    def test_without_a_background(self, talking: Animation, tmp_path: Path) -> None:
        scene = Scene(talking)
        render(scene, tmp_path / "a.png", size=(64, 48), transparent=True)
        assert scene.switches["background"] == "studio"
        render(scene, f"{tmp_path}/s%d.png", size=(64, 48), end=0.04, transparent=True)
        render(scene, tmp_path / "full.png", size=(64, 48))
        scene.show("background", "transparent")
        render(scene, tmp_path / "b.png", size=(64, 48))
        clear, same, sequence = (read(tmp_path / n) for n in ("a.png", "b.png", "s0.png"))
        assert clear.shape == (48, 64, 4)
        np.testing.assert_array_equal(clear, same)
        np.testing.assert_array_equal(clear, sequence)
        assert not clear[:8, :8, 3].any()  # nothing in the corner
        solid = clear[..., 3] == 255
        assert solid[20:30, 28:36].all()  # the face is all there,
        full = read(tmp_path / "full.png").astype(int)
        assert np.abs(full - clear[..., :3])[solid].max() <= 2  # and looks as it does in the studio
        with pytest.raises(UnsupportedError, match="PNG"):
            render(talking, tmp_path / "a.jpg", size=SMALL, transparent=True)
        with pytest.raises(UnsupportedError, match="numbered pictures"):
            render(talking, tmp_path / "a.mp4", size=SMALL, transparent=True)
        with pytest.raises(UnsupportedError, match="numbered pictures"):
            render(scene, tmp_path / "a.gif", size=SMALL)
