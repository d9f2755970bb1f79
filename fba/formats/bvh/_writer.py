"""Write BVH: the standard's joints in the default posture, with BAPs as the angles of their channels.

A joint's channels are its degrees of freedom in the order in which BAPs turn it, so every number is a BAP, in
degrees: angles are not computed anew and do not flip; they are only rounded to `DIGITS`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64, Int32, Int64
from fba.atomic import atomic
from fba.capture import SkeletonMotion
from fba.choices import Axes
from fba.errors import FormatError, OptionError, Remedy
from fba.parameters import BAP_COUNT
from fba.source import Path
from fba.tracks import hold

if TYPE_CHECKING:
    from fba.body import BapSolver, Skeleton

CENTIMETRES = 100.0
DIGITS = 9
"""Significant digits: 1e-5 rad are 6e-4 degrees."""
END_LENGTH = 0.5
"""Length of the bone to an End Site, as a share of the bone before it."""
BATCH_FRAMES = 256
"""Frames that are formatted at once."""
RATES = (1 / 3600, 10_000)
"""Smallest and largest rate, in frames per second, that the reader accepts."""
NEEDED_JOINTS = (
    "sacroiliac",
    "skullbase",
    *(f"{side}_{joint}" for side in "lr" for joint in ("hip", "knee", "ankle", "metatarsal")),
    *(f"{side}_{joint}" for side in "lr" for joint in ("shoulder", "elbow", "wrist")),
)
"""Joints that are written even if they do not move, so that the skeleton is that of a body."""


def write(
    path: Path,
    animation: Animation,
    *,
    joints: Literal["all", "moving"] = "all",
    skeleton: Skeleton | None = None,
    axes: Axes = "iso",
    unit: float = CENTIMETRES,
) -> None:
    """Write the body track as BVH, at the animation's rate; skipped frames are filled in.

    joints: "all" of the skeleton, or "moving": those that move, and those that every body needs (hips, knees,
    shoulders, ...). skeleton: the body; None for `Skeleton.default()`. axes: the convention of BAP axes
    (`fba.body.convention_names()`). unit: units in the file for one metre, by default centimetres.

    The root's OFFSET is 0 and its channels are world positions, because some programs add the two. Reading
    the file returns the same BAPs (`fba.capture._skeleton.is_direct`); times begin at 0. Raises FormatError
    without a body, without frames, or for too many, OptionError for an unknown value of an option.
    """
    from fba.body import BapSolver

    if joints not in ("all", "moving"):
        raise OptionError(f'joints must be "all" or "moving", not {joints!r}')
    if not (np.isfinite(unit) and 1e-6 <= unit <= 1e6):
        raise OptionError(f"unit must be the number of file units in a metre, 1e-6 to 1e6, not {unit}")
    if not RATES[0] <= animation.rate <= RATES[1]:
        raise FormatError(
            f"{float(animation.rate):g} frames/s cannot be written as BVH, which takes 1/3600 to 10000",
            path=path,
        ).with_remedies(Remedy("rate", "resample first, e.g. with {}", "30", "Animation.resample"))
    values = _shown_baps(animation, path)
    solver = BapSolver(skeleton, axes)
    written = _select_joints(solver, values, joints == "moving")
    columns, factors, shifts, text = _hierarchy(solver, written, unit)
    row = " ".join([f"%.{DIGITS}g"] * len(columns)) + "\n"
    with atomic(path) as file:
        file.write(text.encode())
        file.write(f"MOTION\nFrames: {len(values)}\nFrame Time: {float(1 / animation.rate):.12g}\n".encode())
        for start in range(0, len(values), BATCH_FRAMES):
            part = values[start : start + BATCH_FRAMES]
            numbers = np.where(columns >= 0, part[:, columns] * factors, 0.0) + shifts
            numbers[numbers == 0] = 0.0  # no "-0"
            file.write("".join([row % tuple(frame) for frame in numbers.tolist()]).encode())


def _shown_baps(animation: Animation, path: Path) -> Int32:
    """Return int32 (T, 296): the BAPs shown at every frame from the first to the last, gaps filled in."""
    if animation.body is None:
        raise FormatError(
            "BVH holds a body, and this animation has only a face; write .fap, .fba or .glb", path=path
        )
    if not len(animation):
        raise FormatError("a BVH file needs at least one frame, and this animation has none", path=path)
    count = int(animation.index[-1]) - int(animation.index[0]) + 1
    if count > SkeletonMotion.MAX_FRAMES:
        raise FormatError(
            f"{count} frames from the first to the last are more than the {SkeletonMotion.MAX_FRAMES} that "
            "BVH files are read with; write shorter pieces, or resample",
            path=path,
        )
    body = animation.resample(animation.rate).body
    assert body is not None
    held: Int32 = hold(body.values, body.mask, np.zeros(BAP_COUNT, dtype=np.int32))
    return held


def _select_joints(solver: BapSolver, values: Int32, moving: bool) -> list[int]:
    """Return the numbers of the joints to write, parents first."""
    names = solver.skeleton.names
    if not moving:
        return list(range(len(names)))
    moved: Bool = np.asarray(values.any(axis=0))
    return [
        number
        for number, name in enumerate(names)
        if number == 0 or name in NEEDED_JOINTS or moved[list(solver.convention.freedoms(name))].any()
    ]


def _hierarchy(solver: BapSolver, written: list[int], unit: float) -> tuple[Int64, Float64, Float64, str]:
    """Return the BAP column (-1: none), the factor and the summand of each channel; text of the hierarchy."""
    skeleton, rules = solver.skeleton, solver.convention
    parents = _parents(skeleton, written)
    children: list[list[int]] = [[] for _ in written]
    for row, parent in enumerate(parents):
        if parent >= 0:
            children[parent].append(row)
    columns = [int(column) for column in rules.translation]
    factors = [float(sign) * unit / 1000 for sign in rules.translation_sign]
    shifts = [float(centre) * unit for centre in skeleton.centres[0]]
    lines = ["HIERARCHY"]
    # not recursive: a skeleton may be a chain of thousands of joints
    stack: list[tuple[int, int]] = [(0, 0)]  # row and depth of a joint; row -1 for a closing brace
    while stack:
        row, depth = stack.pop()
        pad = "  " * depth
        if row < 0:
            lines.append(f"{pad}}}")
            continue
        number = written[row]
        name = skeleton.names[number]
        parent = parents[row]
        offset = skeleton.centres[number] - skeleton.centres[written[parent] if parent >= 0 else number]
        lines += [
            f"{pad}{'JOINT' if depth else 'ROOT'} {name}",
            f"{pad}{{",
            f"{pad}  OFFSET {_format_vector(offset * unit)}",
        ]
        turned, axes, signs = _turns(solver, name)
        letters = " ".join(f"{'XYZ'[axis]}rotation" for axis in axes)
        position_channels = "" if depth else "Xposition Yposition Zposition "
        lines.append(f"{pad}  CHANNELS {3 if depth else 6} {position_channels}{letters}")
        columns += turned
        factors += [sign * np.degrees(1e-5) for sign in signs]
        shifts += [0.0, 0.0, 0.0]
        stack.append((-1, depth))
        if children[row]:
            stack += [(child, depth + 1) for child in reversed(children[row])]
        else:
            end = offset * END_LENGTH * unit if depth else np.zeros(3)
            lines += [
                f"{pad}  End Site",
                f"{pad}  {{",
                f"{pad}    OFFSET {_format_vector(end)}",
                f"{pad}  }}",
            ]
    text = "\n".join(lines) + "\n"
    return np.array(columns), np.array(factors), np.array(shifts), text


def _parents(skeleton: Skeleton, written: list[int]) -> list[int]:
    """Return the row of the closest written joint above each written joint, -1 for the root."""
    row_of = {number: row for row, number in enumerate(written)}
    result = []
    for number in written:
        parent = int(skeleton.parents[number])
        while parent >= 0 and parent not in row_of:
            parent = int(skeleton.parents[parent])
        result.append(row_of.get(parent, -1))
    return result


def _turns(solver: BapSolver, name: str) -> tuple[list[int], list[int], list[float]]:
    """Return BAP columns (-1 for none), axes and signs of a joint's three channels, outermost first."""
    rules = solver.convention
    if name not in rules.joints:
        return [-1, -1, -1], [2, 0, 1], [1.0, 1.0, 1.0]
    row = rules.joints.index(name)
    return rules.bap[row].tolist(), rules.axis[row].tolist(), rules.sign[row].tolist()


def _format_vector(vector: Float64) -> str:
    """Return three numbers as text."""
    return " ".join(f"{float(v) + 0.0:.{DIGITS}g}" for v in np.where(np.abs(vector) < 1e-9, 0.0, vector))
