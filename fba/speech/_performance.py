"""Speech as an animation of a face, coded as visemes (FAP 1) or as low-level FAPs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

import numpy as np

from fba.animation import Animation
from fba.arrays import Array, Float64, Int64
from fba.encoder_options import EncoderOptions
from fba.errors import OptionError
from fba.face import resolve
from fba.parameters import FAP_COUNT, fap_numbers
from fba.planning import encode
from fba.speech._coarticulation import REACH, coarticulate, find_style
from fba.speech._life import Life, find_life
from fba.speech._prosody import Prosody
from fba.speech._sounds import Shape, Speech, find_shapes
from fba.speech._visemes import CLOSED, MOST_BLEND, find_keys, nearest_blend, rank_keys
from fba.tracks import FaceTrack

Coding = Literal["visemes", "faps"]
QUANT = 16
"""Quantiser of low-level FAPs: with it the lips err by half a millimetre more than without."""
GOALS = {"visemes": 200, "faps": 500}
"""Bits in a second that the mouth takes at most, where few enough can be left out."""
LEFT_OUT = 0.4
"""Share of the sounds that are left out at most for that."""
DETAILS = (
    "depress_chin", "lift_l_cheek", "lift_r_cheek", "raise_tongue",
    "raise_l_cornerlip", "raise_r_cornerlip", "raise_l_cornerlip_o", "raise_r_cornerlip_o",
)  # fmt: skip
"""FAPs of visemes that are left out before any sound is: each takes 20 bits of the first frame alone."""
AT_ONCE = 3000
"""Frames that are coarticulated at once."""
_INNER, _OUTER = 4, 51
"""The first FAPs of the inner and of the outer contour of the lips, of ten each."""


def perform(
    speech: Speech,
    *,
    rate: Fraction = Fraction(25),
    coding: Coding = "faps",
    style: float = 0.5,
    life: float = 0.5,
    prosody: Prosody | None = None,
    keep_goal: bool = True,
    motion: Animation | None = None,
) -> Animation:
    """Return the animation of a face that speaks; players move it linearly between its frames.

    rate: frames in a second that can be sent. coding: visemes (FAP 1), or faps: low-level FAPs with
    coarticulation. style: from 0, mumbled, by 0.5 to 1, overarticulated; lips close in any style. life: 0 for
    the mouth alone, to 1: nods, brows, blinks and glances. prosody: of the sound, if there is one. motion: of
    a face that speaks already, at this rate; it is kept, and the rest is added to what it leaves still.

    keep_goal: leave out small movements, and up to 40 % of the sounds, those that are missed least, where the
    mouth takes more than 200 bits a second as visemes, or 500 as low-level FAPs, as in short sentences.

    Raises OptionError for numbers outside of 0 to 1.
    """
    check_share("style", style)
    check_share("life", life)
    shapes = find_shapes(speech.phones)
    added = find_life(speech, rate, life, prosody)
    if motion is not None and coding == "faps":
        return replace(motion, face=_with_life(_styled(motion, style), added, motion.index), body=None)
    keys = find_keys(shapes, rate)
    last = max(round(speech.seconds * rate), 1)
    if not keys or keys[0][0] > 0:
        keys.insert(0, (0, Shape(0, 0.0, 0.0, 1.0, 0.0)))
    keys = [key for key in keys if key[0] <= last]
    if keys[-1][0] < last:
        keys.append((last, keys[-1][1]))
    mouth = _Mouth(shapes, keys, rate, coding, style)
    if keep_goal:
        mouth = _within_goal(mouth, GOALS[coding] * speech.seconds)
    frames = {frame for frame, _ in mouth.keys} | {frame for frame in added.frames if frame <= last}
    index = np.array(sorted(frames), dtype=np.int64)
    return Animation(face=_with_life(mouth.face(index), added, index), body=None, rate=rate, index=index)


@dataclass(frozen=True)
class _Mouth:
    """What a mouth shows. keys: frames that are sent, and their visemes. details: whether all FAPs are."""

    shapes: Sequence[Shape]
    keys: Sequence[tuple[int, Shape]]
    rate: Fraction
    coding: Coding
    style: float
    details: bool = True

    def face(self, index: Int64) -> FaceTrack:
        """Return it in frames."""
        if self.coding == "visemes":
            return _as_visemes(self.keys, index, self.style)
        face = _as_faps(self.shapes, index, self.rate, self.style)
        if self.details:
            return face
        left_out = [fap_numbers()[name] - 1 for name in DETAILS]
        values, mask = face.values.copy(), face.mask.copy()
        values[:, left_out], mask[:, left_out] = 0, False
        return FaceTrack(values, mask)

    @property
    def frames(self) -> Int64:
        """The frames that are sent, int64 (K,)."""
        return np.array([frame for frame, _ in self.keys], dtype=np.int64)

    def bits(self) -> int:
        """Return the bits of a stream of the mouth alone."""
        frames = self.frames
        made = Animation(face=self.face(frames), body=None, rate=self.rate, index=frames)
        return 8 * len(encode(made, encoder_options(self.coding)))

    def without(self, keys: Sequence[int]) -> _Mouth:
        """Return it without some keys, which are given by their numbers."""
        gone = set(keys)
        return replace(self, keys=[key for at, key in enumerate(self.keys) if at not in gone])


def _within_goal(mouth: _Mouth, most: float) -> _Mouth:
    """Return a mouth in a number of bits: without details, then without the sounds that are missed least."""
    if mouth.bits() <= most:
        return mouth
    if mouth.coding == "faps":
        mouth = replace(mouth, details=False)
        if mouth.bits() <= most:
            return mouth
    order = rank_keys(mouth.keys, resolve(mouth.face(mouth.frames)).astype(np.float64))
    few, many = 0, min(int(len(mouth.keys) * LEFT_OUT), len(order))
    while many - few > 1:
        middle = (few + many) // 2
        if mouth.without(order[:middle]).bits() <= most:
            many = middle
        else:
            few = middle
    return mouth.without(order[:many])


def _styled(motion: Animation, style: float) -> FaceTrack:
    if motion.face is None:
        raise OptionError("the motion is that of a body; give one of a face")
    values = np.rint(motion.face.values * find_style(style).gains).astype(np.int32)
    return replace(motion.face, values=values)


def check_share(name: str, value: float) -> None:
    """Raise OptionError for a number outside of 0 to 1."""
    if not 0 <= value <= 1:
        raise OptionError(f"{name} must be from 0 to 1, not {value:g}")


def encoder_options(coding: Coding) -> EncoderOptions:
    """Return how an animation of `perform` is encoded: without checksums, a fifth of a short sentence."""
    return EncoderOptions(preset="compact", fap_quant=1 if coding == "visemes" else QUANT, checksums=False)


def _as_visemes(keys: Sequence[tuple[int, Shape]], index: Int64, style: float) -> FaceTrack:
    """Return FAP 1 in frames: between two key frames, a blend of theirs."""
    times = [frame for frame, _ in keys]
    fields: Array = np.zeros((len(index), 4), dtype=np.int16)
    gain = min(find_style(style).lips, 1.0)
    for row, frame in enumerate(index.tolist()):
        at = int(np.searchsorted(times, frame, side="right")) - 1
        shape = keys[at][1]
        size = shape.size if shape.viseme in CLOSED else shape.size * gain
        fields[row, :3] = shape.viseme, 0, nearest_blend(size) if shape.viseme else MOST_BLEND
        if frame > times[at] and at + 1 < len(keys) and keys[at + 1][1].viseme != shape.viseme:
            share = (frame - times[at]) / (times[at + 1] - times[at])
            fields[row, :3] = shape.viseme, keys[at + 1][1].viseme, nearest_blend(1 - share)
    mask = np.zeros((len(index), FAP_COUNT), dtype=bool)
    mask[:, 0] = True
    return FaceTrack(np.zeros((len(index), FAP_COUNT), dtype=np.int32), mask, viseme=fields)


def _as_faps(shapes: Sequence[Shape], index: Int64, rate: Fraction, style: float) -> FaceTrack:
    """Return low-level FAPs in frames."""
    values = np.zeros((len(index), FAP_COUNT), dtype=np.int32)
    mask = np.zeros((len(index), FAP_COUNT), dtype=bool)
    reach, begin = round(REACH * rate) + 1, 0
    for first in range(0, int(index[-1]) + 1, AT_ONCE):
        rows = np.flatnonzero((index >= first) & (index < first + AT_ONCE))
        start = max(first - reach, 0)
        while begin < len(shapes) and shapes[begin].end * rate < start:
            begin += 1
        end = begin
        while end < len(shapes) and shapes[end].start * rate < first + AT_ONCE + reach:
            end += 1
        moved = [
            replace(each, start=each.start - float(start / rate), end=each.end - float(start / rate))
            for each in shapes[begin:end]
        ]
        track = coarticulate(moved, rate, first + AT_ONCE - start, style=find_style(style))
        values[rows], mask[rows] = track.values[index[rows] - start], track.mask[index[rows] - start]
    return with_outer_lips(FaceTrack(values, mask))


def with_outer_lips(face: FaceTrack) -> FaceTrack:
    """Return a face whose outer contour of the lips follows the inner one, which is sent."""
    values, mask = face.values.copy(), face.mask.copy()
    inner, outer = (slice(begin - 1, begin + 9) for begin in (_INNER, _OUTER))
    values[:, outer], mask[:, outer] = values[:, inner], mask[:, inner]
    return FaceTrack(values, mask)


def _with_life(face: FaceTrack, added: Life, index: Int64) -> FaceTrack:
    """Return a face that does more. FAPs that move already stay as they are."""
    if not added.keys:
        return face
    values, mask = face.values.copy(), face.mask.copy()
    still = added.faps[~values[:, added.faps].any(axis=0)]
    moved: Float64 = added.values(index)
    values[:, still] = np.rint(moved[:, still]).astype(np.int32)
    mask[:, still] = True
    return FaceTrack(values, mask, viseme=face.viseme)
