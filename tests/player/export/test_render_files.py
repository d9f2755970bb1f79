"""Films and pictures as files, read back."""

from contextlib import nullcontext
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from fba.animation import Animation
from fba.errors import DisplayError, FbaError, FormatError, RangeError, UnsupportedError
from fba.player import Offscreen, Scene, render
from fba_player.export._gif import gif_rate
from fba_player.export.render import check_inside, film_rate
from player_tracks import face_track

av = pytest.importorskip("av")


def read_film(path: Path) -> tuple[list[np.ndarray], Fraction, str, str]:
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(stream)]
        return frames, stream.average_rate, stream.codec_context.name, stream.codec_context.pix_fmt


@pytest.mark.usefixtures("opengl")
class TestFiles:
    def test_film_has_size_count_rate_and_content(self, talking: Animation, tmp_path: Path) -> None:
        seen: list[tuple[int, int]] = []
        path = tmp_path / "talk.mp4"
        result = render(talking, path, size=(161, 121), progress=lambda done, of: seen.append((done, of)))
        assert result == path
        frames, rate, codec, pixels = read_film(path)
        assert (len(frames), rate, codec, pixels) == (10, 25, "h264", "yuv420p")
        assert frames[0].shape == (120, 160, 3)
        assert seen == [(n, 10) for n in range(1, 11)]
        with Offscreen(talking, (160, 120)) as offscreen:
            for number in (0, 9):
                direct = offscreen.frame(number / 25)[..., :3].astype(int)
                assert np.abs(direct - frames[number]).mean() < 6
        assert [p.name for p in tmp_path.iterdir()] == ["talk.mp4"]

    @pytest.mark.parametrize("rate", [Fraction(30000, 1001), Fraction(25, 2), Fraction(60)])
    def test_rates_are_exact(self, talking: Animation, tmp_path: Path, rate: Fraction) -> None:
        path = tmp_path / "rate.mp4"
        render(talking, path, size=(64, 64), rate=rate)
        frames, found, _, _ = read_film(path)
        assert found == rate
        assert len(frames) == -(-Fraction(10, 25) * rate // 1)

    def test_a_stretch(self, talking: Animation, tmp_path: Path) -> None:
        render(talking, tmp_path / "part.mp4", size=(64, 64), start=0.08, end=0.2)
        assert len(read_film(tmp_path / "part.mp4")[0]) == 3

    def test_picture(self, talking: Animation, tmp_path: Path) -> None:
        render(talking, tmp_path / "a.png", size=(33, 21), frame=-1)
        render(talking, tmp_path / "b.png", size=(33, 21), time=9 / 25)
        render(Scene(talking), tmp_path / "c.PNG", size=(33, 21))
        a, b, c = (np.asarray(Image.open(tmp_path / name)) for name in ("a.png", "b.png", "c.PNG"))
        assert a.shape == (21, 33, 3)
        np.testing.assert_array_equal(a, b)
        assert (a != c).any()

    def test_an_interrupted_film_leaves_the_old_file(self, talking: Animation, tmp_path: Path) -> None:
        path = tmp_path / "old.mp4"
        path.write_bytes(b"old")

        def stop(done: int, of: int) -> None:
            raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            render(talking, path, size=(32, 32), progress=stop)
        assert path.read_bytes() == b"old"
        assert [p.name for p in tmp_path.iterdir()] == ["old.mp4"]

    def test_targets_that_cannot_be_written(self, talking: Animation, tmp_path: Path) -> None:
        (tmp_path / "folder.png").mkdir()
        with pytest.raises(FormatError, match="folder"):
            render(talking, tmp_path / "folder.png", size=(4, 4))
        with pytest.raises(FormatError, match="No such file"):
            render(talking, tmp_path / "nowhere" / "a.png", size=(4, 4))


@pytest.mark.parametrize("name", ["a.avi", "a.txt", "a"])
def test_other_suffixes_are_refused(talking: Animation, tmp_path: Path, name: str) -> None:
    with pytest.raises(UnsupportedError, match=r"\.png"):
        render(talking, tmp_path / name)


def test_frames_and_stretches_outside_are_refused(talking: Animation, tmp_path: Path) -> None:
    with pytest.raises(RangeError, match="0 to 9"):
        render(talking, tmp_path / "a.png", frame=10)
    with pytest.raises(
        RangeError, match=r"start 3 s is outside the animation, which goes from 0 s to 0\.4 s"
    ):
        render(talking, tmp_path / "a.mp4", start=3.0)
    with pytest.raises(RangeError, match="nothing lies"):
        render(talking, tmp_path / "a.mp4", start=0.2, end=0.1)
    with pytest.raises(ValueError, match="finite"):
        render(talking, tmp_path / "a.mp4", end=float("nan"))
    with pytest.raises(ValueError, match="not both"):
        render(talking, tmp_path / "a.png", frame=1, time=0.1)
    with pytest.raises(ValueError, match=r"\.png"):
        render(talking, tmp_path / "a.mp4", frame=1)
    with pytest.raises(ValueError, match="frame rate"):
        render(talking, tmp_path / "a.mp4", rate=0)
    with pytest.raises(ValueError, match="2x2"):
        render(talking, tmp_path / "a.mp4", size=(1, 1))
    assert not list(tmp_path.iterdir())


def test_absurd_lengths_are_refused(tmp_path: Path) -> None:
    long = Animation(Fraction(25), np.array([0, 25 * 10**9]), face=face_track([{3: 1}, {3: 2}]))
    with pytest.raises(FbaError, match="start and end"):
        render(long, tmp_path / "a.mp4", size=(16, 16))


@pytest.mark.parametrize(
    ("rate", "film"),
    [
        ("25", "25"),
        ("1/16", "10"),
        ("4", "12"),
        ("250", "50"),
        ("59", "59"),
        ("60", "60"),
        ("100", "50"),
        ("30000/1001", "30000/1001"),
        ("10", "10"),
        ("120", "60"),
        ("121", "121/3"),
    ],
)
def test_film_rate(rate: str, film: str) -> None:
    assert film_rate(Fraction(rate)) == Fraction(film)


@pytest.mark.parametrize(("rate", "gif"), [("25", "25"), ("26", "13"), ("60", "20"), ("10", "10")])
def test_gif_rate(rate: str, gif: str) -> None:
    assert gif_rate(Fraction(rate)) == Fraction(gif)


def test_pyav_missing_is_named(talking: Animation, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(DisplayError, match=r'"mpeg4-fba\[films\]"'):
        render(talking, tmp_path / "a.mp4")


@pytest.mark.parametrize(
    ("time", "inside"), [(2.0009, True), (2.0011, False), (0.9991, True), (0.9989, False)]
)
def test_a_time_may_be_rounded_to_milliseconds(time: float, inside: bool) -> None:
    scene = SimpleNamespace(timeline=SimpleNamespace(start=1.0, end=2.0))
    with nullcontext() if inside else pytest.raises(RangeError, match="goes from 1 s to 2 s"):
        check_inside(scene, "time", time)  # type: ignore[arg-type]
