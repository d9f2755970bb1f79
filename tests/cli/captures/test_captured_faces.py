"""Captured faces on the command line: what `fba info` lists, and options that their readers take."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import fba
from tools.captures.face_files import ANGLES, UDP_ORDER, livelink_csv, openface_csv

ROWS = 90


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
