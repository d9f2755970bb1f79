"""The independent reader against vectors of other programs: every plane, every value, every bit count."""

import json
import warnings
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from fba import FbaWarning
from fba_conformance.trace import decode_values

FAMILIES = (
    "real/",
    "generated/synth_face",
    "generated/synth_b",
    "generated/vreng",
    "generated/xface",
    "generated/ist",
)

pytestmark = pytest.mark.slow


@cache
def traced(path: Path, bap_steps: str) -> tuple[list[dict[str, Any]], list[type[Warning]]]:
    """Planes of a stream, and the categories of the warnings that it gives."""
    with warnings.catch_warnings(record=True, action="always") as caught:
        planes = decode_values(path.read_bytes(), bap_steps=bap_steps)
    return planes, [warning.category for warning in caught]


def text_frames(path: Path) -> list[tuple[list[bool], list[int]]]:
    """Mask and values of each frame of an ASCII FAP or BAP file."""
    lines = [line.split() for line in path.read_text().splitlines() if line.strip() and line[0] != "#"]
    return [
        ([flag == "1" for flag in mask], [int(value) for value in values[1:]])
        for mask, values in zip(lines[1::2], lines[2::2], strict=True)
    ]


def as_text_frame(plane: dict[str, Any], kind: str, columns: int) -> tuple[list[bool], list[int]]:
    values = dict(plane[kind])
    mask = [number in values for number in range(1, columns + 1)]
    row: list[int] = []
    if kind == "fap":
        for column, fields in enumerate((plane["viseme"], plane["expression"])):
            mask[column] = fields is not None
            row += fields or []
    return mask, row + [values[number] for number in sorted(values)]


def trace_line(line: str) -> dict[str, list[str]]:
    """`frame 0 intra 1 ... quant 1 1 ... bits 2494 total 2526`: words and the numbers behind them."""
    fields: dict[str, list[str]] = {}
    for word in line.split():
        if word[0].isalpha():
            fields[word] = numbers = []
        else:
            numbers.append(word)
    return fields


@pytest.mark.parametrize("family", FAMILIES)
def test_values_of_every_plane(shared: Path, family: str) -> None:
    folder = shared / "vectors"
    records = [r for r in json.loads((folder / "index.json").read_text()) if r["stream"].startswith(family)]
    assert records
    wrong = []
    for record in records:
        planes, warned = traced(folder / record["stream"], record["bap_steps"])
        # One vector repeats a time code with its marker bit 0: read, with a warning.
        assert warned == [FbaWarning] * 2 * record["stream"].endswith("synth_face_tc.fba")
        for kind in ("fap", "bap"):
            name = record.get(f"decoded_{kind}")
            if name is None:
                assert not any(plane[kind] for plane in planes)
                continue
            frames = text_frames(folder / name)
            assert len(frames) == len(planes), name
            wrong += [
                f"{name}, plane {number}"
                for number, (frame, plane) in enumerate(zip(frames, planes, strict=True))
                if as_text_frame(plane, kind, len(frame[0])) != frame
            ]
    assert wrong == []


def test_bits_time_and_header_of_real_streams(shared: Path) -> None:
    """An independent decoder's record of each plane: bits counted, time in ms, quantisers, skips."""
    paths = sorted((shared / "vectors" / "real").glob("*.trace"))
    assert len(paths) == 41
    for path in paths:
        planes, _ = traced(path.with_suffix(".fba"), "visage")
        lines = path.read_text().splitlines()
        assert len(lines) == len(planes)
        for line, plane in zip(lines, planes, strict=True):
            fields = trace_line(line)
            found = (
                plane["intra"],
                plane["parts"],
                plane["skip"],
                plane["bits"],
                plane["bit"] + plane["bits"],
            )
            told = tuple(int(fields[key][0]) for key in ("intra", "paramset", "skip", "bits", "total"))
            assert found == told, (path.name, line)
            # It keeps its clock in floating point: 399 for 400 ms.
            assert int(fields["pts"][0]) in {int(plane["time"] * 1000), int(plane["time"] * 1000) - 1}
            for kind, quant in zip(("fap", "bap"), fields["quant"], strict=True):
                if plane[f"{kind}_quant"] is not None:
                    assert plane[f"{kind}_quant"] == int(quant)
            if plane["frame_rate"] is not None:
                assert "/".join(map(str, plane["frame_rate"])) in line
