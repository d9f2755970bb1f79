"""`--clip`: the animation that commands read of a glTF file with several.

Captured faces on the command line: what `fba info` lists, and options that their readers take.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fba
from command_line import Run
from small_people import write_person
from tools.captures.face_files import ANGLES, UDP_ORDER, livelink_csv, openface_csv

ROWS = 90


def raised(degrees: float, frames: int) -> dict[str, list[Rotation]]:
    """The left arm turns up from the T pose, evenly."""
    angles = np.linspace(0, degrees, frames)
    return {"leftUpperArm": [Rotation.from_euler("z", angle, degrees=True) for angle in angles]}


@pytest.fixture
def people(tmp_path: Path) -> Path:
    clips = {"Idle": raised(5, 4), "Wave": raised(60, 7), "wave": raised(20, 10)}
    return write_person(tmp_path / "people.glb", clips=clips)


def test_info_lists_the_clips(run: Run, people: Path) -> None:
    _, out, err = run("info", people)
    assert out.splitlines()[-3].startswith("  clips ")
    assert [line.split()[-3:] for line in out.splitlines()[-3:]] == [
        ["'Idle',", "0.10", "s"],
        ["'Wave',", "0.20", "s"],
        ["'wave',", "0.30", "s"],
    ]
    assert "'Idle' is read; choose with --clip Wave" in err
    listed = json.loads(run("info", people, "--json").out)["clips"]  # type: ignore[attr-defined]
    assert [clip["name"] for clip in listed] == ["Idle", "Wave", "wave"]
    np.testing.assert_allclose([clip["seconds"] for clip in listed], [0.1, 0.2, 0.3], atol=1e-6)


def test_each_command_reads_the_clip_that_it_is_given(run: Run, people: Path, tmp_path: Path) -> None:
    for word, frames in (("Wave", 7), ("wave", 10), ("idle", 4), ("2", 10)):
        target = tmp_path / "out.bap"
        run("convert", people, target, "--clip", word)
        assert len(fba.read(target)) == frames
    assert "7 frames" in run("info", people, "--clip", "Wave").out
    stream = tmp_path / "out.fba"
    _, out, err = run("encode", people, "-o", stream, "--clip", "wave", "--bap-steps", "visage", "--report")
    assert "animations" not in err
    assert "10 frames beside the source" in out


def test_a_missing_clip(run: Run, people: Path, bvh: Path, tmp_path: Path) -> None:
    err = run("convert", people, tmp_path / "out.bap", "--clip", "Wafe", code=1).err
    assert "no animation 'Wafe'" in err
    assert "did you mean" in err
    assert "'Idle', 'Wave', 'wave'" in err
    err = run("convert", people, tmp_path / "out.bap", "--clip", "WAVE", code=1).err
    assert "2 animations are called 'WAVE'; give a number: 1, 2; choose with --clip 1" in err
    err = run("encode", bvh, "-o", tmp_path / "out.fba", "--clip", "Wave", code=2).err
    assert "--clip is for glTF, which may hold several animations, not for BVH" in err


def test_a_warning_is_printed_once(run: Run, people: Path, tmp_path: Path) -> None:
    """`--report` reads the file a second time."""
    assert (
        run("encode", people, "-o", tmp_path / "out.fba", "--report").err.count(
            "'Idle' is read; choose with --clip Wave"
        )
        == 1
    )


def test_info_of_a_person_without_motion(run: Run, tmp_path: Path) -> None:
    path = write_person(tmp_path / "avatar.vrm", extension="VRM", morphs={"jawOpen": [0.0], "Wobble": [0.0]})
    _, out, err = run("info", path)
    assert err == ""
    assert "23 of 23 joints are the standard's, as VRM 0 declares them" in out
    assert "1; 1 shapes of a face" in out
    assert f"fba play MOTION --body {path}" in out
    listed = json.loads(run("info", path, "--json").out)["person"]  # type: ignore[attr-defined]
    _, out, err = run("info", path, "--clip", "3", code=1)
    assert out == ""
    assert "there is no animation '3'; the file has none" in err
    assert listed == {"declared": "VRM 0", "joints": 23, "matched": 23, "meshes": 1, "shapes": 1}


def table(folder: Path) -> Path:
    """A smile on the left comes and goes, while the mouth is said to go right; all angles are 0."""
    wave = 0.5 + 0.5 * np.sin(np.arange(ROWS) / 9)
    columns = {name: np.zeros(ROWS) for name in [*UDP_ORDER, *ANGLES]}
    columns |= {"MouthSmileLeft": wave, "MouthRight": 0.4 * wave}
    path = folder / "face.csv"
    path.write_text(livelink_csv(columns))
    return path


def test_info_lists_what_was_recorded(run: Callable[..., Any], tmp_path: Path) -> None:
    path = table(tmp_path)
    said = run("info", path)
    assert said.err == ""
    assert "capture  90 rows, 1.49 s from 18:48:59.66" in said.out
    assert "52, 50 of which never move; angles of nothing" in said.out
    assert "found    all angles of head and eyes are 0" in said.out
    assert "the other way round: mouths go to the side on which nobody smiles" in said.out
    capture = json.loads(run("info", "--json", path).out)["capture"]
    assert capture["angles"] == {"head": False, "eyes": False}
    assert len(capture["still"]) == 50


def test_encode(run: Callable[..., Any], tmp_path: Path) -> None:
    path, target = table(tmp_path), tmp_path / "a.fba"
    said = run("encode", path, "-o", target)
    assert "a.fba: 90 frames, 1.50 s at 60 frames/s" in said.out
    assert "warning" in said.err
    assert "the other way round" in said.err
    assert len(fba.read(target)) == 90
    assert "the other way round" not in run("encode", path, "-o", target, "--swap", "no").err
    run("encode", path, "-o", target, "--fps", 25)
    assert (fba.read(target).rate, len(fba.read(target))) == (25, 38)


def test_the_choice_of_one_of_several_faces(run: Callable[..., Any], tmp_path: Path) -> None:
    units = {unit: np.full(4, 2.0) for unit in (1, 6, 12, 15, 26)}
    still, ahead = np.zeros((4, 3)), np.tile([0.0, 0.0, -1.0], (4, 2))
    header, *rows = openface_csv(units, still, ahead).splitlines()
    others = [row.replace(", 0,", ", 1,", 1) for row in rows]
    path = tmp_path / "two.csv"
    path.write_text("\n".join([header, *(row for pair in zip(rows, others, strict=True) for row in pair)]))
    said = run("info", path, code=1)
    assert "has several faces: 0 (4 rows), 1 (4 rows); choose one with --face 0" in said.err
    assert "capture  4 rows" in run("info", path, "--face", "1").out
    run("encode", path, "-o", tmp_path / "a.fba", "--face", "1")


def test_an_option_that_no_input_takes(run: Callable[..., Any], tmp_path: Path) -> None:
    said = run("encode", table(tmp_path), "-o", tmp_path / "a.fba", "--spine", "full", code=2)
    assert "--spine is for BVH, GLTF, SMPL and ARF, not for LIVELINK" in said.err
