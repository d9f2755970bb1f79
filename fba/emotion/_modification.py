"""`emote`: a performance played in a mood. Section 3.6 of the second thesis in docs/emotion.md.

A mood moves the rest shape of the face, and the performance is added. Where the mood has already moved a
feature near its limit, the performance moves it less. In every mood, eyes that the performer shuts are shut,
and lips that touch do so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64, Int32
from fba.emotion._expressions import expressions
from fba.emotion._moods import Mood, MoodCurve, check_spans, intensity_curves
from fba.emotion._rules import Rules, limited
from fba.emotion.blending import combine
from fba.errors import OptionError
from fba.face import Definitions, FaceSettings, resolve
from fba.parameters import FAP_COUNT, fap_numbers, fill_from_mates
from fba.sampling import smoothstep
from fba.tracks import FaceTrack

LIDS_APART = 1024.0
"""Distance of the lids in a neutral face, in the units of FAPs 19 to 22."""
INTENSITY_STEP = 0.5
"""Step to which intensities of simultaneous moods are rounded, so that few mixtures are computed."""
BLOCK = 8192
"""Number of frames computed at once."""

Mixtures = dict[tuple[tuple[str, float], ...], Float64]
"""FAPs (68,) of expressions with their intensities."""


def _columns(*names: str) -> tuple[int, ...]:
    return tuple(fap_numbers()[name] - 1 for name in names)


LIDS = tuple(_columns(f"close_t_{side}_eyelid", f"close_b_{side}_eyelid") for side in "lr")
LIPS = (
    (_columns("lower_t_midlip", "raise_b_midlip"), _columns("lower_t_midlip_o", "raise_b_midlip_o")),
    (_columns("lower_t_lip_lm", "raise_b_lip_lm"), _columns("lower_t_lip_lm_o", "raise_b_lip_lm_o")),
    (_columns("lower_t_lip_rm", "raise_b_lip_rm"), _columns("lower_t_lip_rm_o", "raise_b_lip_rm_o")),
)
"""Columns of upper and lower lip, each of the inner and the outer contour: middle, left, right."""
(JAW,) = _columns("open_jaw")
CORNERS = _columns("raise_l_cornerlip", "raise_r_cornerlip", "raise_l_cornerlip_o", "raise_r_cornerlip_o")
DRAWING_JAW = 300.0
"""FAP 3 of a mood at which the jaw alone, not their muscles, pulls the corners of the mouth down."""


@dataclass(frozen=True)
class Damping:
    """Parameters of the sum of a mood and a performance.

    reach: limit of a FAP, relative to its largest value in all named expressions and visemes. There the
    performance moves it no further. speaking: distance of the performer's lips (MNS, 1024 a mouth-nose
    distance) from which a mood opens the mouth fully; it opens it less while they are closer.

    Raises OptionError for values that are not finite, reach below 1, or speaking not above 0.
    """

    reach: float = 1.2
    speaking: float = 400.0

    def __post_init__(self) -> None:
        if not self.reach >= 1 or not np.isfinite(self.reach):
            raise OptionError(f"reach must be a number of at least 1, not {self.reach!r}")
        if not self.speaking > 0 or not np.isfinite(self.speaking):
            raise OptionError(f"speaking must be a number above 0, not {self.speaking!r}")


def emote(
    animation: Animation,
    moods: Sequence[Mood | MoodCurve],
    *,
    rules: Rules | None = None,
    damping: Damping | None = None,
    model: FaceSettings | None = None,
) -> Animation:
    """Return a performance in one or several moods, with the same body.

    The face is resolved to low-level FAPs (`fba.face.resolve`, with the model's definitions of visemes and
    expressions), within the standard's limits. Frames without a mood keep their values.

    Raises OptionError for an animation without a face, no moods, moods that contradict each other, and a mood
    outside the time of the performance.
    """
    if animation.face is None or not len(animation):
        raise OptionError("there is no face to put into a mood")
    if not moods:
        raise OptionError("no mood is given")
    times = (animation.index - animation.index[0]) / float(animation.rate)
    check_spans(moods, float(times[-1]))
    curves = intensity_curves(moods, times.astype(np.float64))
    shown = resolve(animation.face, model)
    curves = curves or {next(iter(expressions())).name: np.zeros(len(animation))}  # neutral
    values = np.empty((len(animation), FAP_COUNT), dtype=np.int32)
    moved = np.zeros(FAP_COUNT, dtype=np.bool_)
    mixtures: Mixtures = {}
    for start in range(0, len(animation), BLOCK):
        rows = slice(start, start + BLOCK)
        offsets = _offsets({name: curve[rows] for name, curve in curves.items()}, rules, mixtures)
        values[rows] = np.rint(modify(shown[rows].astype(np.float64), offsets, damping))
        moved |= offsets.any(axis=0)
    return replace(animation, face=_face(animation.face, values, moved))


def modify(shown: Float64, offsets: Float64, damping: Damping | None = None) -> Float64:
    """Return FAPs (T, 68) of a performance whose rest shape is moved by `offsets` (T, 68).

    Frames whose offsets are all 0 do not change.
    """
    damping = damping or Damping()
    apart = [_apart(shown, inner) for inner, _ in LIPS]
    share = [smoothstep(np.maximum(distance, 0.0) / damping.speaking) for distance in apart]
    offsets = offsets.copy()
    _close_mouth(offsets, share[0])
    result = _add_damped(shown, offsets, damping.reach)
    for lips, before, spoken in zip(LIPS, apart, share, strict=True):
        _keep_contact(offsets, result, lips, before, spoken)
    for lids in LIDS:
        _keep_lids(shown, offsets, result, lids)
    return np.where(_beyond(shown), shown, limited(result))


def _close_mouth(offsets: Float64, spoken: Float64) -> None:
    """Reduce the opening of jaw and corners by a mood, in place. spoken: (T,), 0 where the lips touch."""
    drawn = np.clip(offsets[:, JAW] / DRAWING_JAW, 0.0, 1.0) * (1 - spoken)
    for corner in CORNERS:
        offsets[:, corner] *= np.where(offsets[:, corner] < 0, 1 - drawn, 1.0)
    offsets[:, JAW] *= spoken


def _add_damped(shown: Float64, offsets: Float64, reach: float) -> Float64:
    """Return the performance added to the moved rest shape; less of it in a direction whose limit is near."""
    low, high = (limit * reach for limit in _extremes())
    limit = np.maximum(np.where(offsets > 0, high, -low), np.abs(offsets))
    with np.errstate(invalid="ignore", divide="ignore"):
        room = np.where(limit > 0, 1 - np.abs(offsets) / limit, 1.0)
    same = shown * offsets > 0
    result: Float64 = offsets + np.where(same, shown * room, shown)
    return result


def _keep_contact(
    offsets: Float64, result: Float64, lips: tuple[tuple[int, ...], ...], before: Float64, spoken: Float64
) -> None:
    """Close lips that the mood parts where the performer's touch, in place, each by its share of the motion.

    lips: columns of the inner and the outer contour, upper lip first. before: (T,), distance of the
    performer's lips. spoken: (T,), 0 where they touch, 1 where the mood may open them fully.
    """
    inner, outer = lips
    widened = np.maximum(_apart(result, inner) - np.maximum(before, 0.0), 0.0) * (1 - spoken)
    parted = np.maximum(-offsets[:, inner], 0.0)
    total = parted.sum(axis=1)
    share = np.divide(parted, total[:, None], out=np.full_like(parted, 0.5), where=total[:, None] > 0)
    for contour in (inner, outer):
        result[:, contour] += widened[:, None] * share


def _keep_lids(shown: Float64, offsets: Float64, result: Float64, lids: tuple[int, ...]) -> None:
    """Set the lids of an eye, in place, to the product of the performer's and the mood's opening."""
    top, bottom = lids
    performed = 1 - (shown[:, top] + shown[:, bottom]) / LIDS_APART
    mood = 1 - (offsets[:, top] + offsets[:, bottom]) / LIDS_APART
    opening = np.where(performed > 0, performed * np.maximum(mood, 0.0), performed)
    result[:, bottom] = shown[:, bottom] + offsets[:, bottom] * np.clip(performed, 0.0, 1.0)
    result[:, top] = LIDS_APART * (1 - opening) - result[:, bottom]


def _apart(values: Float64, lips: tuple[int, ...]) -> Float64:
    """Return the distance of upper and lower lip, (T,), MNS; negative where they are pressed together."""
    apart: Float64 = -(values[:, lips[0]] + values[:, lips[1]])
    return apart


def _beyond(values: Float64) -> Bool:
    """Return which values exceed the standard's limits: streams may have them, and they do not change."""
    beyond: Bool = limited(values).astype(np.float64) != values
    return beyond


@cache
def _extremes() -> tuple[Float64, Float64]:
    """Return lowest and highest value of each FAP in all expressions and visemes, float64 (68,) each."""
    definitions = Definitions.default()
    poses = np.concatenate(
        [np.array([each.faps for each in expressions()]), definitions.visemes, definitions.expressions]
    )
    return poses.min(axis=0).astype(np.float64), poses.max(axis=0).astype(np.float64)


def _offsets(curves: Mapping[str, Float64], rules: Rules | None, mixtures: Mixtures) -> Float64:
    """Return the rest shape's FAPs (T, 68) for intensities (T,) by name. mixtures: a cache."""
    names = sorted(curves)
    weights = np.array([curves[name] for name in names]).T
    if (np.count_nonzero(weights, axis=1) <= 1).all():  # one at a time needs no rules
        full = np.array([_mixture({name: 100.0}, rules, mixtures) for name in names])
        alone: Float64 = weights / 100 @ full
        return alone
    rounded = np.round(weights / INTENSITY_STEP) * INTENSITY_STEP
    distinct, which = np.unique(rounded, axis=0, return_inverse=True)
    poses = [_mixture(dict(zip(names, row.tolist(), strict=True)), rules, mixtures) for row in distinct]
    return np.array(poses)[which.ravel()]


def _mixture(weights: dict[str, float], rules: Rules | None, mixtures: Mixtures) -> Float64:
    key = tuple(weights.items())
    if key not in mixtures:
        mixtures[key] = combine(weights, rules).faps.astype(np.float64)
    return mixtures[key]


def _face(face: FaceTrack, values: Int32, moved: Bool) -> FaceTrack:
    """Return a track that sends, in every frame, the FAPs of the source, those of moods, and their mates."""
    sent = face.mask.any(axis=0) | moved | (values != 0).any(axis=0)
    sent[:2] = False
    copies = fill_from_mates(values[0], sent)[1]
    copies[:2] = False
    return FaceTrack(values, np.broadcast_to(copies, values.shape))
