"""Checks that each FAP moves its own feature point correctly and leaves that of its mate in place."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fba.arrays import Float64, Intp
from fba.face._tables import HEAD
from fba.face.checks._findings import Finding
from fba.face.checks._posing import Poser
from fba.face.eyeball import distances_from_axis
from fba.face.points import (
    DILATE_PUPIL,
    DIRECTIONS,
    HEAD_PITCH,
    HEAD_ROLL,
    HEAD_YAW,
    OPEN_JAW,
    PITCH_EYE,
    THRUST_EYE,
    TONGUE_ROLL,
    YAW_EYE,
)
from fba.parameters import faps

SMALL_VALUE = 10.0
"""Value of a FAP, in its unit, that every face can follow."""
SMALL_ANGLE = 5000.0
"""The same for FAPs that count in 1e-5 rad."""
ACCURACY = 0.05
"""Largest error of a feature point, as a share of its motion."""
MATE_TOLERANCE = 0.01
"""Distance that its mate may move, as a share of the point's."""
ARC = {OPEN_JAW, 19, 20, 21, 22}
"""FAPs whose points follow an arc: they may move in depth too."""
EYE_POINT = {23: "3.5", 24: "3.6", 25: "3.5", 26: "3.6", **THRUST_EYE, 29: "3.5", 30: "3.6"}
HEAD_AXIS = {HEAD_PITCH: (1.0, 0.0, 0.0), HEAD_YAW: (0.0, 1.0, 0.0), HEAD_ROLL: (0.0, 0.0, 1.0)}


def check_point(poser: Poser, fap: int) -> Iterator[Finding]:
    """Yield findings about how a FAP moves its feature point."""
    if fap in HEAD_AXIS:
        yield from _check_head(poser, fap)
    elif fap in (*YAW_EYE, *PITCH_EYE):
        yield from _check_gaze(poser, fap)
    elif fap in DILATE_PUPIL:
        yield from _check_pupil(poser, fap)
    elif fap == TONGUE_ROLL:
        yield from _check_roll(poser, fap)
    else:
        yield from _check_shift(poser, fap)


def _check_shift(poser: Poser, fap: int) -> Iterator[Finding]:
    entry = faps()[fap - 1]
    point = EYE_POINT.get(fap) or entry.feature_points[0]
    if not poser.has(point):
        yield Finding(entry.label, "its feature point is bound to a vertex", f"{point} is not", "a vertex")
        return
    direction = np.array(DIRECTIONS[entry.positive])
    for value in (SMALL_VALUE, -SMALL_VALUE) if entry.direction == "B" else (SMALL_VALUE,):
        moved = poser.shift({fap: value})[poser.vertex(point)]
        wanted = value * poser.model.fapu[entry.unit] * direction
        off = np.array([(moved - wanted) @ direction, moved[0]]) if fap in ARC else moved - wanted
        if not np.linalg.norm(off) <= ACCURACY * np.linalg.norm(wanted):
            rule = f"{point} moves by value x {entry.unit} {entry.positive}"
            found = f"{_vector(moved * 1000)} mm at {value:g}"
            yield Finding(entry.label, rule, found, f"{_vector(wanted * 1000)} mm within {ACCURACY:.0%}")
    mate = entry.left_right_mate
    if mate is None:
        return
    other = EYE_POINT.get(mate) or faps()[mate - 1].feature_points[0]
    if other != point and poser.has(other):
        moved = poser.shift({fap: SMALL_VALUE})
        share = float(np.linalg.norm(moved[poser.vertex(other)]))
        share /= max(float(np.linalg.norm(moved[poser.vertex(point)])), 1e-12)
        if share > MATE_TOLERANCE:
            found, expected = f"{share:.1%} of the way of {point}", f"under {MATE_TOLERANCE:.0%}"
            yield Finding(entry.label, f"{other}, the mate, stays", found, expected)


def _check_head(poser: Poser, fap: int) -> Iterator[Finding]:
    entry = faps()[fap - 1]
    turns = [t for t in poser.model.table_of[fap].transforms if t.part == HEAD and t.kind == "rotation"]
    total = np.sum([t.amount for t in turns], axis=0) if turns else np.zeros(3)
    axis = np.array(HEAD_AXIS[fap])
    if np.linalg.norm(total - axis) > ACCURACY:
        found, expected = f"axis times rate {_vector(total)}", _vector(axis)
        yield Finding(entry.label, f"the head turns {entry.positive} by value x 1e-5 rad", found, expected)
    centre = poser.point("7.1")
    for turn in turns:
        away = np.linalg.norm(np.array(turn.centre) - centre)
        if np.isfinite(away) and away > 1e-3:
            found, expected = f"{away * 1000:.1f} mm away", "at most 1 mm"
            yield Finding(entry.label, "the head turns about 7.1", found, expected, "warning")


def _check_gaze(poser: Poser, fap: int) -> Iterator[Finding]:
    entry = faps()[fap - 1]
    side = "left" if EYE_POINT[fap] == "3.5" else "right"
    eye = poser.eyes[side]
    own = _eye_vertices(poser, side)
    axis = 1 if fap in YAW_EYE else 0
    for value in (SMALL_ANGLE, -SMALL_ANGLE):
        moved = poser.pose({fap: value})[own]
        turn = _rotation(poser.neutral[own] - eye.centre, moved - eye.centre)
        wanted = np.zeros(3)
        wanted[axis] = value * poser.model.fapu.AU
        if np.linalg.norm(turn - wanted) > ACCURACY * np.linalg.norm(wanted):
            rule = f"the eyeball turns {entry.positive} about its centre"
            found = f"{_vector(np.degrees(turn))} degrees at {value:g}"
            yield Finding(entry.label, rule, found, f"{_vector(np.degrees(wanted))} degrees")
    other = _eye_vertices(poser, "right" if side == "left" else "left")
    if len(other) and np.abs(poser.shift({fap: SMALL_ANGLE})[other]).max() > 1e-6:
        yield Finding(entry.label, "the other eyeball stays", "it moves", "no motion")


def _check_pupil(poser: Poser, fap: int) -> Iterator[Finding]:
    entry = faps()[fap - 1]
    side = "left" if EYE_POINT[fap] == "3.5" else "right"
    eye, unit = poser.eyes[side], poser.model.fapu.IRISD
    own = _eye_vertices(poser, side)
    radius = unit * 1024 / 6
    distance = distances_from_axis(poser.neutral[own], eye.centre, eye.gaze)
    front = (poser.neutral[own] - eye.centre) @ eye.gaze > 0
    rim = own[front & (np.abs(distance - radius) < 0.25 * radius)]
    if not len(rim):
        rim = own[front & (distance < 1.5 * radius) & (distance > 1e-6)]
    before = distances_from_axis(poser.neutral[rim], eye.centre, eye.gaze)
    for value in (6 * SMALL_VALUE, -6 * SMALL_VALUE):
        # Vertices inside the pupil move in proportion to their radius, those outside it less and less.
        grown = distances_from_axis(poser.pose({fap: value})[rim], eye.centre, eye.gaze) - before
        wanted = (
            value
            * unit
            / 2
            * np.where(before <= radius, before / radius, np.clip((3 * radius - before) / (2 * radius), 0, 1))
        )
        if not len(rim) or np.abs(grown - wanted).max() > 0.15 * abs(value * unit / 2):
            measured = f"{float(np.mean(grown)) * 2000:.2f} mm" if len(rim) else "no vertices there"
            found = f"{measured} at {value:g}"
            expected = f"{float(np.mean(wanted)) * 2000 if len(rim) else value * unit * 1000:.2f} mm"
            yield Finding(entry.label, "the pupil's diameter grows by value x IRISD", found, expected)


def _check_roll(poser: Poser, fap: int) -> Iterator[Finding]:
    entry = faps()[fap - 1]
    if not poser.has("6.2", "6.3", "6.4"):
        yield Finding(entry.label, "6.2, 6.3 and 6.4 are bound to vertices", "one is not", "vertices")
        return
    moved = poser.pose({fap: SMALL_ANGLE})
    for name, sign in (("6.3", 1.0), ("6.4", -1.0)):
        before = poser.neutral[poser.vertex(name)] - poser.neutral[poser.vertex("6.2")]
        after = moved[poser.vertex(name)] - moved[poser.vertex("6.2")]
        turn = sign * (np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0]))
        turn = (turn + np.pi) % (2 * np.pi) - np.pi
        wanted = SMALL_ANGLE * poser.model.fapu.AU
        if abs(turn - wanted) > 2 * ACCURACY * wanted:
            found = f"{np.degrees(turn):.2f} degrees at {SMALL_ANGLE:g}"
            expected = f"{np.degrees(wanted):.2f} degrees"
            yield Finding(entry.label, f"{name} turns up about the tongue's middle", found, expected)


def _eye_vertices(poser: Poser, side: str) -> Intp:
    ranges = [np.zeros(0, dtype=np.intp)]
    for name in poser.eyes[side].parts:
        start = poser.model.starts[name]
        ranges.append(np.arange(start, start + len(poser.model.part(name).vertices)))
    return np.concatenate(ranges)


def _rotation(before: Float64, after: Float64) -> Float64:
    """Return (3,) rotation vector, radians, that takes points (N, 3) about the origin closest to others."""
    from scipy.spatial.transform import Rotation

    if len(before) < 3:
        return np.full(3, np.nan)
    return np.asarray(Rotation.align_vectors(after, before)[0].as_rotvec())


def _vector(numbers: Float64) -> str:
    return "(" + ", ".join(f"{n:.3f}" for n in np.asarray(numbers)) + ")"
