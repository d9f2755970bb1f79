"""`from_blendshapes` and `from_action_units`: a captured face, or its action units, as FAPs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64
from fba.capture.blendshapes._motion import ActionUnitMotion, ShapeMotion
from fba.capture.blendshapes.combination import RADIAN, combine, to_face_track
from fba.errors import ModelError
from fba.face import arkit_names
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import FAP_COUNT, fap_numbers
from fba.sampling import frame_numbers, interpolate
from fba.text_files import packaged_rows
from fba.tracks import FaceTrack

FRAME_BYTES = 1500
"""Memory, in bytes, that a frame takes: its FAPs in several number types."""
HEAD_FAPS = ("head_pitch", "head_yaw", "head_roll")
EYE_FAPS = ("yaw_l_eyeball", "yaw_r_eyeball", "pitch_l_eyeball", "pitch_r_eyeball")


def from_blendshapes(
    motion: ShapeMotion, rate: Fraction | int | str | None = None, *, limits: Limits = DEFAULT_LIMITS
) -> Animation:
    """Return the FAPs of a captured face: a face track that sends the FAPs that its shapes can move.

    rate: frames per second; None for that of the motion. Frames lie at whole multiples of its period from the
    source's first row; values between two rows are interpolated, so that the animation keeps the times of the
    source whatever its rate was. Rows without a face are bridged; at the beginning and the end they are left
    out.

    Where the motion has angles of eyes that are not all 0, they turn the eyeballs (FAPs 23 to 26); otherwise
    the shapes that look aside do. Raises ModelError if no shape is known or no row has a face, LimitError for
    more than the limits allow.
    """
    rate = motion.rate if rate is None else Fraction(rate)
    if rate <= 0:
        raise ModelError(f"the frame rate must be positive, not {rate}")
    seen = motion.seen
    if not seen.any():
        raise ModelError(f"no face is seen in any of the {len(motion)} rows; there is nothing to encode")
    index = frame_numbers(motion.times[seen], rate, limits)
    limits.check_bytes(FRAME_BYTES * len(index), "the face", source=FRAME_BYTES * len(motion))
    at = index / float(rate)
    recorded = [array for array in (motion.weights, motion.head, motion.eyes) if array is not None]
    weights, *turns = interpolate(motion.times[seen], [array[seen] for array in recorded], at, limits)
    head = turns.pop(0) if motion.head is not None else None
    eyes = turns.pop(0) if motion.eyes is not None else None
    track = convert_rows(motion.names, weights, _unless_zero(head), _unless_zero(eyes))
    return Animation(rate, index, track, name=motion.name)


def convert_rows(
    names: Sequence[str], weights: Float64, head: Float64 | None, eyes: Float64 | None
) -> FaceTrack:
    """Return FAPs of rows of weights (T, N), and of angles (T, 3) and (T, 4) as `ShapeMotion` has them.

    head, eyes: None where the source does not record them; then the shapes that look aside turn the eyes.
    Raises ModelError if no shape is known and there are no angles.
    """
    values = np.zeros((len(weights), FAP_COUNT))
    turned = np.zeros(FAP_COUNT, dtype=bool)
    _turn(head, HEAD_FAPS, values, turned)
    _turn(eyes, EYE_FAPS, values, turned)
    amounts, moved = combine(dict(zip(names, weights.T, strict=True)), len(weights), but=turned)
    if not (moved | turned).any():
        listed = ", ".join(map(repr, names[:6]))
        raise ModelError(f"no name of a shape is known here: {listed}; expected ARKit's, such as 'jawOpen'")
    values += amounts
    return to_face_track(values, moved | turned)


def _unless_zero(angles: Float64 | None) -> Float64 | None:
    """Return the angles; None if all are 0, as in a source that records none."""
    return None if angles is None or not angles.any() else angles


def _turn(angles: Float64 | None, faps: tuple[str, ...], values: Float64, turned: Bool) -> None:
    """Add angles (T, n), radians, to FAPs (T, 68), and note which FAPs these are."""
    if angles is None:
        return
    columns = [fap_numbers()[fap] - 1 for fap in faps]
    values[:, columns] += angles * RADIAN
    turned[columns] = True


def from_action_units(
    motion: ActionUnitMotion, rate: Fraction | int | str | None = None, *, limits: Limits = DEFAULT_LIMITS
) -> Animation:
    """Return the FAPs of a face whose action units were tracked.

    `unit_shapes.csv` says, from the definitions of FACS, which of ARKit's shapes an action unit of full
    intensity is; where several units use a shape, it has their sum, at most 1. `from_blendshapes` does the
    rest, and has the same arguments and errors. Raises ModelError if no action unit is known.
    """
    return from_blendshapes(to_shapes(motion), rate, limits=limits)


def to_shapes(motion: ActionUnitMotion) -> ShapeMotion:
    """Return the weights of ARKit's shapes for action units; ModelError if none is known."""
    known = [unit for unit in motion.units if unit in unit_shapes()]
    if not known:
        units = ", ".join(map(str, motion.units)) or "no unit"
        raise ModelError(f"no action unit is known here: {units}")
    used = [name for name in arkit_names() if any(name in unit_shapes()[unit] for unit in known)]
    weights = np.zeros((len(motion), len(used)))
    for column, unit in enumerate(motion.units):
        for name, share in unit_shapes().get(unit, {}).items():
            weights[:, used.index(name)] += share * motion.intensities[:, column]
    return ShapeMotion(
        tuple(used), np.minimum(weights, 1.0), motion.times, motion.rate,
        head=motion.head, eyes=motion.eyes, name=motion.name, findings=motion.findings,
    )  # fmt: skip


@cache
def unit_shapes() -> dict[int, Mapping[str, float]]:
    """Return weights of ARKit's shapes by name, for each action unit at full intensity, by its number."""
    table: dict[int, Mapping[str, float]] = {}
    for row in packaged_rows(__package__, "unit_shapes.csv"):
        shapes = {}
        for entry in row["shapes"].split():
            name, _, share = entry.partition("=")
            for side in ("Left", "Right") if "?" in name else ("",):
                shapes[name.replace("?", side)] = float(share)
        table[int(row["unit"])] = shapes
    return table
