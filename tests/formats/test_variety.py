"""One content as many programs would write it: line ends, blanks, case, comments, numbers and counts vary
with a seed. Each reads as the plain file does.
"""

import random
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fba.errors import FbaWarning
from fba.formats.bvh._reader import parse
from fba.formats.text.fap import read_fap
from fba.mesh._obj import read_obj
from fba.mesh._ply import read_ply
from format_files import mask

SEEDS = range(40)
VALUES = (0.0, 1.0, -90.0, 12.5, 0.001, -1234.25)


def number(dice: random.Random, value: float) -> str:
    """Return a number as some program writes it."""
    forms = [repr(value), f"{value:.6f}", f"{value:+.4f}", f"{value:.7e}", f"{value:E}", f"{value:g}"]
    return dice.choice([form for form in forms if abs(float(form) - value) < 1e-9])


def end(dice: random.Random) -> str:
    """Return the end of a line, perhaps with blanks before it."""
    return dice.choice(["\n", "\r\n", " \n", "\t\r\n"])


def gap(dice: random.Random) -> str:
    return dice.choice([" ", "  ", "\t", " \t "])


def bvh(dice: random.Random, rows: list[list[float]]) -> str:
    """Return a BVH file of two joints."""
    line, blank = end(dice), gap(dice)
    upper = dice.choice([str.upper, str.lower, str])
    joint = [
        f"{upper('ROOT')}{blank}Hips", "{", f"OFFSET{blank}{blank.join(number(dice, 0.0) for _ in range(3))}",
        f"{upper('CHANNELS')} 3 Zrotation{blank}{upper('Xrotation')} Yrotation",
        "End Site", "{", "OFFSET 0 1 0", "}", "}",
    ]  # fmt: skip
    opening = line.join(joint)
    if dice.random() < 0.3:
        opening = opening.replace(f"{line}{{", " {")
    time = dice.choice(["0.04", ".04", "4e-2", "0.0400000"])
    header = [f"Frames:{blank}{len(rows)}", f"Frame Time:{blank}{time}"]
    motion = [blank.join(number(dice, value) for value in row) for row in rows]
    extra = dice.choice(["", line, line * 3])
    mark = dice.choice(["", "\ufeff"])
    text = line.join(["HIERARCHY", opening, "MOTION", *header, *motion]) + line + extra
    return mark + text if dice.random() < 0.5 else text.rstrip() + dice.choice(["", line])


@pytest.mark.parametrize("seed", SEEDS)
def test_bvh(seed: int) -> None:
    dice = random.Random(seed)
    rows = [[dice.choice(VALUES) for _ in range(3)] for _ in range(dice.randint(1, 5))]
    plain = parse(bvh_plain(rows))
    found = parse(bvh(dice, rows).removeprefix("\ufeff"))
    assert (found.names, found.rate) == (plain.names, plain.rate)
    np.testing.assert_allclose(found.rotations, plain.rotations, atol=1e-9)
    np.testing.assert_array_equal(found.offsets, plain.offsets)


def bvh_plain(rows: list[list[float]]) -> str:
    head = (
        "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
        f"End Site\n{{\nOFFSET 0 1 0\n}}\n}}\nMOTION\nFrames: {len(rows)}\nFrame Time: 0.04\n"
    )
    return head + "".join(" ".join(map(repr, row)) + "\n" for row in rows)


@pytest.mark.parametrize("seed", SEEDS)
def test_fap(tmp_path: Path, seed: int) -> None:
    dice = random.Random(seed)
    values = [dice.randint(-1000, 1000) for _ in range(dice.randint(1, 6))]
    lines = [dice.choice(["2.1 a name 25 {}", "2.0\ta  25.0 {}", "2.2 a 25 {}.0"]).format(len(values))]
    for frame, value in enumerate(values):
        bits = mask(3)
        lines += [
            bits.replace(" ", gap(dice)),
            f"{frame}{gap(dice)}{dice.choice([f'{value}', f'{value}.0'])}",
        ]
        lines += dice.choice([[], [], ["# a comment"], [""]])
    if dice.random() < 0.3:
        lines.insert(0, "# written by hand")
    path = tmp_path / "a.fap"
    text = "".join(line + end(dice) for line in lines)
    path.write_bytes(dice.choice([b"", b"\xef\xbb\xbf"]) + text.encode())
    assert read_fap(path).face.values[:, 2].tolist() == values


def obj(dice: random.Random, corners: list[tuple[float, float, float]]) -> str:
    """Return a triangle as OBJ."""
    line = end(dice)
    style = dice.choice(["{0}", "{0}/", "{0}//1", "{0}/1", "{0}/1/1", "{1}"])
    vertices = [f"v{gap(dice)}{gap(dice).join(number(dice, c) for c in corner)}" for corner in corners]
    vertices = [vertex + dice.choice(["", " 1.0", " # a comment"]) for vertex in vertices]
    indices = [style.format(n, n - len(corners) - 1) for n in range(1, len(corners) + 1)]
    face = f"f {gap(dice).join(indices)}"
    if dice.random() < 0.3:
        face = face.replace(indices[1], f"\\{line.lstrip(chr(32) + chr(9))}{indices[1]}", 1)
    extra = ["o a", "g b c", "s off", "s 1", "usemtl m", "vn 0 0 1", "# a comment", ""]
    lines = [*dice.sample(extra, 3), *vertices, "vt 0.5 0.5", "vn 0 0 1", *dice.sample(extra, 2), face]
    return line.join(lines) + dice.choice(["", line])


def ply(dice: random.Random, corners: list[tuple[float, float, float]]) -> str:
    """Return a triangle as ASCII PLY."""
    kind, whole = (
        dice.choice(["float", "double", "float32", "float64"]),
        dice.choice(["int", "uint", "int32"]),
    )
    length, name = dice.choice(["uchar", "uint8", "int"]), dice.choice(["vertex_indices", "vertex_index"])
    order = dice.sample(range(3), 3)
    lines = ["ply", "format ascii 1.0", *dice.choice([[], ["comment a"], ["obj_info a"]])]
    lines += [f"element vertex {len(corners)}", *(f"property {kind} {'xyz'[axis]}" for axis in order)]
    lines += ["element face 1", f"property list {length} {whole} {name}", "end_header"]
    lines += [gap(dice).join(number(dice, corner[axis]) for axis in order) for corner in corners]
    lines += [gap(dice).join(map(str, [3, 0, 1, 2]))]
    return "".join(line + "\n" for line in lines)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("make", "read", "suffix"), [(obj, read_obj, "obj"), (ply, read_ply, "ply")])
def test_meshes(
    tmp_path: Path,
    make: Callable[[random.Random, list[tuple[float, float, float]]], str],
    read: Callable[[Path], object],
    suffix: str,
    seed: int,
) -> None:
    dice = random.Random(seed)
    corners = [(0.0, 0.0, 0.0), (12.5, -1.0, 0.001), (1.0, dice.choice(VALUES), 3.0)]
    path = tmp_path / f"a.{suffix}"
    path.write_bytes(make(dice, corners).encode())
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        found = read(path)
    np.testing.assert_allclose(found.vertices, corners, rtol=1e-6)  # type: ignore[attr-defined]
    assert found.corners.tolist() == [0, 1, 2]  # type: ignore[attr-defined]
    assert found.starts.tolist() == [0, 3]  # type: ignore[attr-defined]
