"""`emote`: a performance played in a mood. Section 3.6 of the second thesis in docs/emotion.md.

A mood moves the rest shape of the face, and the performance is added. Where the mood has brought a feature
near its limit already, the performance moves it less. Eyes that the performer shuts are shut, and lips that
touch do so in every mood.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64, Int32
from fba.easing import smoothstep
from fba.emotion._moods import Mood, MoodCurve, check_spans, intensity_curves
from fba.emotion._rules import Rules, limited
from fba.emotion.blending import combine
from fba.emotion.expressions import expressions
from fba.errors import OptionError
from fba.face import Definitions, resolve
from fba.face.mates import fill
from fba.face.resolve import FaceSettings
from fba.parameters import FAP_COUNT, fap_numbers
from fba.tracks import FaceTrack

LIDS_APART = 1024.0
"""How far the lids of a neutral face are apart, in the units of FAPs 19 to 22."""
STEP = 0.5
"""Intensities of several moods at once are rounded to this, so that few mixtures are computed."""
BLOCK = 8192
"""Frames computed at once."""

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
"""FAP 3 of a mood from which the corners of the mouth are drawn down by the jaw, not by their own muscles."""


@dataclass(frozen=True)
class Damping:
    """How a mood and a performance add up.

    reach: a feature's limit, as a multiple of the farthest that any named expression or viseme takes it. At
    that limit the performance moves it no further. speaking: how far lips are apart (MNS units, 1024 a
    mouth-nose distance) when a mood opens the mouth as far as it would at rest; less while they are closer.

    Raises OptionError where one is no number, reach is below 1 or speaking is not above 0.
    """

    reach: float = 1.2
    speaking: float = 400.0

    def __post_init__(self) -> None:
        if not self.reach >= 1 or not np.isfinite(self.reach):
            raise OptionError(f"reach must be a number from 1 on, not {self.reach!r}")
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
    """Return a performance in one or several moods; its body stays as it is.

    What the face shows (`fba.face.resolve`, with a model's definitions of visemes and expressions) is sent as
    low-level FAPs, all within the standard's limits. Frames without any mood keep their values.

    Raises OptionError for an animation without a face, or without moods, for moods that contradict each
    other, and for a mood that begins after the performance ends or ends before it begins.
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
    """Return FAPs (T, 68) of a performance whose rest shape is moved by `offsets` (T, 68); both in FAPU.

    Frames whose offsets are all 0 stay as they are.
    """
    damping = damping or Damping()
    apart = [_apart(shown, inner) for inner, _ in LIPS]
    share = [smoothstep(np.maximum(one, 0.0) / damping.speaking) for one in apart]
    offsets = offsets.copy()
    _close_mouth(offsets, share[0])
    result = _add_damped(shown, offsets, damping.reach)
    for lips, before, spoken in zip(LIPS, apart, share, strict=True):
        _keep_contact(offsets, result, lips, before, spoken)
    for lids in LIDS:
        _keep_lids(shown, offsets, result, lids)
    return np.where(_beyond(shown), shown, limited(result))


def _close_mouth(offsets: Float64, spoken: Float64) -> None:
    """Take back what a mood opens, as far as the performer's lips touch: the jaw, and corners that it draws
    down. spoken: (T,), 0 where lips touch."""
    drawn = np.clip(offsets[:, JAW] / DRAWING_JAW, 0.0, 1.0) * (1 - spoken)
    for corner in CORNERS:
        offsets[:, corner] *= np.where(offsets[:, corner] < 0, 1 - drawn, 1.0)
    offsets[:, JAW] *= spoken


def _add_damped(shown: Float64, offsets: Float64, reach: float) -> Float64:
    """Add the performance to the moved rest shape: in the same direction, less the nearer the limit is."""
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
    """Bring lips that the mood parts together again where the performer's touch, each by what it was moved.

    lips: columns of the inner and the outer contour, upper lip first. before: (T,), how far the performer's
    are apart. spoken: (T,), 0 where they touch, 1 where the mood may open them fully.
    """
    inner, outer = lips
    widened = np.maximum(_apart(result, inner) - np.maximum(before, 0.0), 0.0) * (1 - spoken)
    parted = np.maximum(-offsets[:, inner], 0.0)
    total = parted.sum(axis=1)
    share = np.divide(parted, total[:, None], out=np.full_like(parted, 0.5), where=total[:, None] > 0)
    for contour in (inner, outer):
        result[:, contour] += widened[:, None] * share


def _keep_lids(shown: Float64, offsets: Float64, result: Float64, lids: tuple[int, ...]) -> None:
    """Set the lids of one eye: as open as the performer's and the mood's opening together, never crossed."""
    top, bottom = lids
    performed = 1 - (shown[:, top] + shown[:, bottom]) / LIDS_APART
    mood = 1 - (offsets[:, top] + offsets[:, bottom]) / LIDS_APART
    opening = np.where(performed > 0, performed * np.maximum(mood, 0.0), performed)
    result[:, bottom] = shown[:, bottom] + offsets[:, bottom] * np.clip(performed, 0.0, 1.0)
    result[:, top] = LIDS_APART * (1 - opening) - result[:, bottom]


def _apart(values: Float64, lips: tuple[int, ...]) -> Float64:
    """How far upper and lower lip are apart, (T,), in MNS units; below 0 where they are pressed together."""
    apart: Float64 = -(values[:, lips[0]] + values[:, lips[1]])
    return apart


def _beyond(values: Float64) -> Bool:
    """Values that are beyond the standard's limits already: a stream may hold them, and they stay."""
    beyond: Bool = limited(values).astype(np.float64) != values
    return beyond


@cache
def _extremes() -> tuple[Float64, Float64]:
    """The extremes of each FAP in all named expressions and visemes, float64 (68,) each."""
    definitions = Definitions.default()
    poses = np.concatenate(
        [np.array([one.faps for one in expressions()]), definitions.visemes, definitions.expressions]
    )
    return poses.min(axis=0).astype(np.float64), poses.max(axis=0).astype(np.float64)


def _offsets(curves: Mapping[str, Float64], rules: Rules | None, mixtures: Mixtures) -> Float64:
    """The rest shape's FAPs (T, 68) for intensities (T,) by name. mixtures: those computed so far, by
    intensities."""
    names = sorted(curves)
    weights = np.array([curves[name] for name in names]).T
    if (np.count_nonzero(weights, axis=1) <= 1).all():  # one at a time needs no rules
        full = np.array([_mixture({name: 100.0}, rules, mixtures) for name in names])
        alone: Float64 = weights / 100 @ full
        return alone
    rounded = np.round(weights / STEP) * STEP
    distinct, which = np.unique(rounded, axis=0, return_inverse=True)
    poses = [_mixture(dict(zip(names, row.tolist(), strict=True)), rules, mixtures) for row in distinct]
    return np.array(poses)[which.ravel()]


def _mixture(weights: dict[str, float], rules: Rules | None, mixtures: Mixtures) -> Float64:
    key = tuple(weights.items())
    if key not in mixtures:
        mixtures[key] = combine(weights, rules).faps.astype(np.float64)
    return mixtures[key]


def _face(face: FaceTrack, values: Int32, moved: Bool) -> FaceTrack:
    """A track that sends, in every frame, what the source sends, what moods move, and what copies it."""
    sent = face.mask.any(axis=0) | moved | (values != 0).any(axis=0)
    sent[:2] = False
    copies = fill(values[0], sent)[1]
    copies[:2] = False
    return FaceTrack(values, np.broadcast_to(copies, values.shape))
