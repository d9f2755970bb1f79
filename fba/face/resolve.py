"""What a face shows: unsent FAPs filled in, visemes and expressions turned into low-level FAPs.

ISO/IEC 14496-2, FBA object decoding: a FAP keeps the last value that was sent; one that never was is
estimated: by the face's interpolation table, else from its mate or lip contour, else from the viseme
and expression in force.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from fba.animation import FaceTrack
from fba.arrays import Array, Bool, Float32, Int16, Int32, Intp
from fba.face._mates import fill
from fba.face.expressions import Definitions
from fba.face.interpolation.evaluate import evaluate
from fba.face.interpolation.table import InterpolationTable
from fba.parameters import FAP_COUNT, INTENSITY_MAX, faps

BLOCK = 4096
"""Frames resolved at once: keeps the working arrays in the processor's cache."""
MOUTH_GROUPS = (2, 6, 8)
"""A redefined viseme stores the FAPs of these groups: jaw and inner lip, tongue, outer lip."""


class Resolver:
    """`resolve` for a track in pieces; remembers what earlier pieces sent.

    model: a face that brings `definitions` or a `fit` of its own, or None.
    """

    def __init__(self, model: Any = None) -> None:
        definitions: Definitions = getattr(model, "definitions", None) or Definitions.default()
        self._fit: InterpolationTable | None = getattr(model, "fit", None)
        self._held = _Held()
        self._visemes = definitions.visemes.copy()
        self._expressions = definitions.expressions.copy()
        # Which FAPs visemes, and which expressions, have a say in once any was sent.
        self._moved = definitions.visemes.any(axis=0), definitions.expressions.any(axis=0)

    def copy(self) -> Resolver:
        """An independent resolver in the same state."""
        other = Resolver.__new__(Resolver)
        other._fit = self._fit
        other._moved = self._moved
        other._held = self._held.copy()
        other._visemes = self._visemes.copy()
        other._expressions = self._expressions.copy()
        return other

    def push(self, track: FaceTrack) -> Float32:
        """FAPs shown over the next frames: float32 (T, 68), columns 0 and 1 zero."""
        result = np.empty((len(track), FAP_COUNT), dtype=np.float32)
        for start in range(0, len(track), BLOCK):
            result[start : start + BLOCK] = self._push_block(track[start : start + BLOCK])
        return result

    def _push_block(self, track: FaceTrack) -> Float32:
        low, ever, asked = self._held.low_level(track)
        sent = ever
        filled: Array = low
        if asked is not None:
            sent = ever & ~asked
            filled = np.where(sent, low, np.int32(0))
        viseme, expression = self._held.high_level(track)
        alone = expression[:, 4:5] == 0  # else init_face: the expression is the new neutral face
        if self._fit is not None:
            filled, sent, from_high_level = evaluate(self._fit, filled, sent, viseme, expression)
            # What the table makes of the expression is not put on top of the expression again.
            alone = alone | fill(from_high_level, sent)[0].astype(bool)
        filled, known = fill(filled, sent)
        shown: Float32 = filled.astype(np.float32)
        base = self._visemes_shown(track, viseme) + self._expressions_shown(track, expression)
        if asked is not None:
            # What nothing else tells anything about stays as it was sent.
            moved = (base != 0) | (ever[:, :1] & self._moved[0]) | (ever[:, 1:2] & self._moved[1])
            last = ever & ~known & ~moved
            np.copyto(shown, low, where=last, casting="same_kind")
            known |= last
        shown += np.where(known & alone, np.float32(0), base)
        shown[:, :2] = 0
        return shown

    def _visemes_shown(self, track: FaceTrack, fields: Int16) -> Float32:
        blend = _share(fields[:, 2])
        defined = track.mask[:, 0] & (track.viseme[:, 3] == 1)
        table = _Redefined(self._visemes, defined, fields[:, 0], track, mouth_only=True)
        if not fields[:, :2].any():
            return np.zeros((len(track), FAP_COUNT), dtype=np.float32)
        shown: Float32 = table.look_up(fields[:, 0]) * blend + table.look_up(fields[:, 1]) * (1 - blend)
        return shown

    def _expressions_shown(self, track: FaceTrack, fields: Int16) -> Float32:
        first, second = (_share(fields[:, column]) for column in (1, 3))
        # The same expression in both places is still one expression: never more than all of it.
        same = (fields[:, 0] == fields[:, 2])[:, None]
        second = np.where(same, np.minimum(second, 1 - first), second)
        defined = track.mask[:, 1] & (track.expression[:, 5] == 1)
        table = _Redefined(self._expressions, defined, fields[:, 0], track, mouth_only=False)
        if not fields[:, [0, 2]].any():
            return np.zeros((len(track), FAP_COUNT), dtype=np.float32)
        shown: Float32 = table.look_up(fields[:, 0]) * first + table.look_up(fields[:, 2]) * second
        return shown


def resolve(track: FaceTrack, model: Any = None) -> Float32:
    """What the face shows at every frame: float32 (T, 68) in FAPU, columns 0 and 1 zero.

    - A FAP keeps its last value after it was sent. One never sent, or that the sender asks to have
      interpolated (`FaceTrack.interpolated`), follows from others by the model's interpolation table
      (`FaceModel.fit`), where a link leads to it whose sources are there; else it copies its left/right
      mate, an outer lip FAP its inner one and the other way round.
    - viseme = definition(select1) x blend/63 + definition(select2) x (1 - blend/63);
      expression = definition(select1) x intensity1/63 + definition(select2) x intensity2/63, one
      expression in both places never above its full intensity. Their sum shows where nothing was sent;
      with init_face it becomes the neutral face, to which the sent FAPs are added. A FAP that is asked
      to be interpolated though none of all this moves it keeps its last value.
    - viseme_def and expression_def make the low-level FAPs sent in the same frame (of a viseme: the
      mouth's) the definition of select1 from that frame on; without such FAPs nothing changes.

    model: a face with `definitions` (`Definitions`) and a `fit` (`InterpolationTable`) of its own, such
    as a `FaceModel`, or None for the built-in definitions and no table.
    """
    return Resolver(model).push(track)


@dataclass
class _Held:
    """The last values sent, and masks of those ever sent."""

    values: Int32 = field(default_factory=lambda: np.zeros(FAP_COUNT, dtype=np.int32))
    sent: Bool = field(default_factory=lambda: np.zeros(FAP_COUNT, dtype=bool))
    viseme: Int16 = field(default_factory=lambda: np.zeros(4, dtype=np.int16))
    expression: Int16 = field(default_factory=lambda: np.zeros(6, dtype=np.int16))
    asked: Bool = field(default_factory=lambda: np.zeros(FAP_COUNT, dtype=bool))

    def copy(self) -> _Held:
        return _Held(*(getattr(self, one.name).copy() for one in fields(self)))

    def low_level(self, track: FaceTrack) -> tuple[Int32, Bool, Bool | None]:
        """Each (T, 68): values last sent, which of all FAPs were ever sent, and which low-level ones
        are to be interpolated, None where none are."""
        if track.mask[:, 2:].all():
            values, sent = track.values, np.ones_like(track.mask)
            sent[:, :2] = np.logical_or.accumulate(track.mask[:, :2], axis=0) | self.sent[:2]
        else:
            values = hold(track.values, track.mask, self.values)
            sent = np.asarray(np.logical_or.accumulate(track.mask, axis=0)) | self.sent
        self.values, self.sent = values[-1].copy(), sent[-1].copy()
        return values, sent, self._asked(track)

    def _asked(self, track: FaceTrack) -> Bool | None:
        if track.interpolated is None and not self.asked.any():
            return None
        own = track.interpolated if track.interpolated is not None else np.zeros_like(track.mask)
        says = np.asarray((track.mask | own).any(axis=1))
        asked = own if says.all() else hold(own, says[:, None], self.asked)
        self.asked = asked[-1].copy()
        return asked

    def high_level(self, track: FaceTrack) -> tuple[Int16, Int16]:
        viseme = hold(track.viseme, track.mask[:, :1], self.viseme)
        expression = hold(track.expression, track.mask[:, 1:2], self.expression)
        self.viseme, self.expression = viseme[-1].copy(), expression[-1].copy()
        return viseme, expression


def _share(amounts: Int16) -> Float32:
    """(T, 1) blend or intensity as a share of its largest; quantised ones may lie a little outside."""
    share: Float32 = np.clip(amounts, 0, INTENSITY_MAX).astype(np.float32)[:, None] / np.float32(
        INTENSITY_MAX
    )
    return share


def hold(values: Array, mask: Bool, before: Array) -> Array:
    """Each column keeps its last masked-in value; (T, N), or mask (T, 1) for all columns together.

    before: (N,) values in force before the first frame.
    """
    last = np.where(mask, np.arange(1, len(mask) + 1, dtype=np.int32)[:, None], np.int32(0))
    np.maximum.accumulate(last, axis=0, out=last)
    known = np.concatenate([before[None].astype(values.dtype), values])
    held: Array = np.take_along_axis(known, np.broadcast_to(last, values.shape), axis=0)
    return held


class _Redefined:
    """Definitions in force at each frame, where frames may redefine them. Updates `table` in place."""

    def __init__(
        self,
        table: Float32,
        defined: Bool,
        select: Int16,
        track: FaceTrack,
        *,
        mouth_only: bool,
    ) -> None:
        stored = np.array([f.group in MOUTH_GROUPS if mouth_only else f.group > 1 for f in faps()])
        events = np.flatnonzero(defined & (select > 0) & track.mask[:, stored].any(axis=1))
        mask = track.mask[events] & stored
        rows = fill(np.where(mask, track.values[events], 0), mask)[0].astype(np.float32)
        self._rows = np.concatenate([table, rows])
        self._in_force: Intp | None = None
        if len(events):
            count = len(table)
            row = np.broadcast_to(np.arange(count), (len(track), count)).copy()
            row[events, select[events]] = count + np.arange(len(events))
            self._in_force = np.maximum.accumulate(row, axis=0)
            table[:] = self._rows[self._in_force[-1]]

    def look_up(self, select: Int16) -> Float32:
        """(T, 68) definition of the selected item at each frame."""
        if self._in_force is None:
            return self._rows[select]
        return self._rows[self._in_force[np.arange(len(select)), select]]
