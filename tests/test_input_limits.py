"""`fba.Limits`: what is beyond them is refused with the limit, what was found, and the option that helps."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation, FaceTrack, Limits
from fba.errors import LimitError
from fba.cli.main import main


def face(*index: int, rate: int = 25) -> Animation:
    values, mask = np.zeros((len(index), 68), dtype=np.int32), np.zeros((len(index), 68), dtype=bool)
    mask[:, 2] = True
    return Animation(Fraction(rate), np.array(index), FaceTrack(values, mask))


@pytest.mark.parametrize("name", ["frames", "bytes", "pixels", "seconds"])
@pytest.mark.parametrize("value", [0, -1, 1.5, "7"])
def test_a_limit_is_a_positive_integer(name: str, value: object) -> None:
    with pytest.raises(ValueError, match=f"{name} must be a positive integer"):
        Limits(**{name: value})  # type: ignore[arg-type]


def test_the_last_that_is_allowed_and_the_first_that_is_not() -> None:
    limits = Limits(frames=10, bytes=100, pixels=12, seconds=60)
    limits.check_frames(10, "it")
    limits.check_bytes(100 + 20 * 7, "it", source=7)
    limits.check_pixels(3, 4, "it")
    limits.check_seconds(60, "it")
    for check, name, found, allowed in (
        (lambda: limits.check_frames(11, "it"), "frames", 11, 10),
        (lambda: limits.check_bytes(241, "it", source=7), "bytes", 241, 240),
        (lambda: limits.check_pixels(13, 1, "it"), "pixels", 13, 12),
        (lambda: limits.check_seconds(61, "it"), "seconds", 61, 60),
    ):
        with pytest.raises(LimitError, match=f"more than the {allowed} that the limit `{name}`") as caught:
            check()
        assert (caught.value.limit, caught.value.found, caught.value.allowed) == (name, found, allowed)


def test_the_limit_that_the_error_asks_for_is_enough() -> None:
    far = face(0, 1000, rate=1)
    with pytest.raises(LimitError, match=r"raise it with limits=fba.Limits\(bytes=\d+\)") as caught:
        far.resample(25, limits=Limits(bytes=1_000_000))
    argument = caught.value.remedies[0].value
    assert far.resample(25, limits=eval(argument)).index[-1] == 25 * 1000


def test_two_frames_a_day_apart_are_not_filled_up_by_default() -> None:
    with pytest.raises(LimitError, match="of memory"):
        face(0, 31 * 3600, rate=1).resample(25)


def test_time_codes_far_apart(tmp_path: Path) -> None:
    with pytest.raises(LimitError, match="lasts 700000 s, more than the 604800"):
        face(0, 699_999, rate=1).resample(2)


def test_a_stream_of_too_many_frames() -> None:
    data = fba.encode(face(*range(50)))
    assert len(fba.decode(data, limits=Limits(frames=50))) == 50
    with pytest.raises(LimitError, match="the stream has 50 frames, more than the 49"):
        fba.decode(data, limits=Limits(frames=49))


def test_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def run(*arguments: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as stop:
            main(list(arguments))
        return int(stop.value.code or 0), capsys.readouterr().err

    source, target = tmp_path / "long.fba", tmp_path / "long.fap"
    fba.write(source, face(*range(50)))
    convert = ("convert", str(source), str(target))
    code, text = run(*convert, "--limit", "frames=49")
    assert code == 1
    assert f"{source}: the stream has 50 frames, more than the 49" in text
    assert "raise it with --limit frames=50" in text
    assert not target.exists()
    assert run(*convert, "--limit", "frames=5e1", "--limit", "bytes=1000000")[0] == 0
    for value, message in (
        (
            "frame=1",
            "there is no limit 'frame' (did you mean 'frames'?); they are frames, bytes, pixels, seconds",
        ),
        ("frames", "'' is not a number; write e.g. frames=6000000"),
        ("frames=0", "a limit is a whole number from 1 to"),
    ):
        code, text = run(*convert, "--limit", value)
        assert code == 2
        assert message in " ".join(text.split())


@pytest.mark.parametrize(
    "command", ["bench", "convert", "decode", "encode", "gait", "info", "play", "render", "stats"]
)
def test_commands_that_read_files_take_limits(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([command, "--help"])
    assert "--limit NAME=VALUE" in capsys.readouterr().out
