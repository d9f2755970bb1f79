"""`fba verify`: complete, cut, damaged and changed streams."""

import hashlib
import json
import struct
from pathlib import Path

import numpy as np
import pytest

import fba
from command_line import Run
from fba.codec import digest
from tools import synthetic_motion as motion


@pytest.fixture(scope="module")
def streams(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four seconds; the same with one of them destroyed, cut between planes, and with a value changed."""
    folder = tmp_path_factory.mktemp("archive")
    animation = motion.animation(motion.face(100, faps_sent=(3, 4, 48)))
    data = fba.encode(animation, fba.EncoderOptions(intra_period=1, start_codes=True))
    restart = data.index(b"\0\0\1\xbb")
    (folder / "good.fba").write_bytes(data)
    (folder / "damaged.fba").write_bytes(data[: restart + 4] + b"\x80" + data[restart + 5 :])
    (folder / "cut.fba").write_bytes(data[: data.index(b"\0\0\1\xbb", restart + 1)])
    values = animation.face.values.copy()  # type: ignore[union-attr]
    values[70, 2] += 4
    changed = fba.Animation(25, animation.index, fba.FaceTrack(values, animation.face.mask))  # type: ignore[union-attr]
    (folder / "changed.fba").write_bytes(
        fba.encode(changed, fba.EncoderOptions(intra_period=1, start_codes=True))
    )
    return folder


@pytest.mark.parametrize(
    ("name", "code", "expected"),
    [
        ("good", 0, (True, 100, True, 0, 0, 0)),
        ("damaged", 1, (False, 75, True, 1, 25, 0)),
        ("cut", 1, (False, 50, False, 1, None, 0)),
    ],
)
def test_the_report_about_a_stream(
    streams: Path, run: Run, name: str, code: int, expected: tuple[object, ...]
) -> None:
    out = run("verify", "--json", streams / f"{name}.fba", code=code).out
    report = json.loads(out)
    fields = ("intact", "frames", "ended", "frames_lost", "doubtful")
    intact, frames, ended, lost, doubtful = (report[field] for field in fields)
    assert (intact, frames, ended, len(report["damage"]), lost, doubtful) == expected
    assert len(report["digest"]) == 64


def test_the_table_and_the_damage_below_it(streams: Path, run: Run) -> None:
    out = run("verify", *(streams / f"{name}.fba" for name in ("good", "damaged", "cut")), code=1).out
    head, good, damaged, cut, *lines = out.splitlines()
    assert head.split() == [
        "file",
        "frames",
        "seconds",
        "end",
        "code",
        "damage",
        "lost",
        "in",
        "doubt",
        "result",
        "digest",
    ]
    assert good.split()[1:8] == ["100", "4.00", "yes", "0", "0", "0", "intact"]
    assert damaged.split()[1:8] == ["75", "4.00", "yes", "1", "25", "0", "DAMAGED"]
    assert cut.split()[1:8] == ["50", "2.00", "NO", "1", "?", "0", "DAMAGED"]
    assert ["25 frames lost" in lines[0], "without the end code" in lines[1]] == [True, True]


def test_a_change_that_the_syntax_does_not_show(streams: Path, run: Run, tmp_path: Path) -> None:
    place, report = tmp_path / "a.fba", tmp_path / "report.json"
    place.write_bytes((streams / "good.fba").read_bytes())
    report.write_text(run("verify", "--json", place).out)
    assert "intact, unchanged" in run("verify", place, "--against", report).out
    place.write_bytes((streams / "changed.fba").read_bytes())
    assert "intact, CHANGED" in run("verify", place, "--against", report, code=1).out
    assert "intact, not in the report" in run("verify", streams / "good.fba", "--against", report).out
    report.write_text('{"file": 3}')
    assert "this is no report of fba verify --json" in run("verify", place, "--against", report, code=1).err


def test_other_files_are_named(streams: Path, run: Run, tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("no stream")
    _, out, err = run("verify", tmp_path / "a.txt", streams / "good.fba", code=1)
    assert "no FBA object start code" in err
    assert "good.fba" in out


def test_the_digest_is_that_of_the_values() -> None:
    """Computed by hand for two frames; coding changes nothing but what it rounds."""
    mask = np.zeros((2, 68), dtype=bool)
    mask[:, [0, 2]] = True
    values = np.zeros((2, 68), dtype=np.int32)
    values[:, 2] = [100, -8]
    viseme = np.array([[1, 2, 63, 1], [0, 0, 0, 0]], dtype=np.int16)
    animation = fba.Animation(25, np.array([3, 5]), fba.FaceTrack(values, mask, viseme))
    expected = b"fba 1 25 face\n"
    for index, value, fields in ((3, 100, (1, 2, 63, 1)), (5, -8, (0, 0, 0, 0))):
        expected += struct.pack("<q", index) + bytes([1, 0, 1] + [0] * 65)
        expected += struct.pack("<68i", 0, 0, value, *[0] * 65) + struct.pack("<10h", *fields, *[0] * 6)
    assert digest(animation) == hashlib.sha256(expected).hexdigest()
    body = fba.Animation(
        25, np.array([3]), None, fba.BodyTrack(np.ones((1, 296), int), np.ones((1, 296), bool))
    )
    expected = b"fba 1 25 body\n" + struct.pack("<q", 3) + b"\1" * 296 + struct.pack("<296i", *[1] * 296)
    assert digest(body) == hashlib.sha256(expected).hexdigest()
