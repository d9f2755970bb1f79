"""What a face shows: unsent FAPs filled in, visemes and expressions turned into low-level FAPs.

ISO/IEC 14496-2, FBA object decoding: a FAP keeps the last value that was sent; one that never was is
estimated: by the face's interpolation table, else from its mate or lip contour, else from the viseme
and expression in force.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from fba.animation import FaceTrack
from fba.arrays import Array, Bool, Float32, Float64, Int16, Int32, Intp
from fba.face._expressions import Definitions
from fba.face.interpolation._evaluate import estimate, evaluate
from fba.face.interpolation.table import InterpolationTable
from fba.parameters import FAP_COUNT, INTENSITY_MAX, faps, fill_from_mates
from fba.tracks import hold

RESOLVED_AT_ONCE = 4096
"""Frames resolved at once: keeps the working arrays in the processor's cache."""
MOUTH_GROUPS = (2, 6, 8)
"""A redefined viseme stores the FAPs of these groups: jaw and inner lip, tongue, outer lip."""


class FaceSettings(Protocol):
    """The part of a `FaceModel` that decides which FAPs it shows."""

    @property
    def definitions(self) -> Definitions:
        """The FAPs of visemes and expressions."""

    @property
    def fit(self) -> InterpolationTable | None:
        """How unsent FAPs follow from sent ones."""


def resolve(track: FaceTrack, model: FaceSettings | None = None) -> Float32:
    """Return the FAPs that a face shows at every frame: float32 (T, 68) in FAPU, columns 0 and 1 zero.

    - A FAP keeps its last value after it was sent. One never sent, or that the sender asks to have
      interpolated (`FaceTrack.interpolated`), follows from others by the model's interpolation table
      (`FaceModel.fit`), where a link leads to it whose source FAPs are known; else it copies its left/right
      mate, an outer lip FAP its inner one and the other way round.
    - viseme = definition(select1) x blend/63 + definition(select2) x (1 - blend/63);
      expression = definition(select1) x intensity1/63 + definition(select2) x intensity2/63, one
      expression in both places never above its full intensity. Their sum shows where nothing was sent;
      with init_face it becomes the neutral face, to which the sent FAPs are added. A FAP to be interpolated
      that none of these determine keeps its last value.
    - viseme_def and expression_def make the low-level FAPs sent in the same frame (of a viseme: the
      mouth's) the definition of select1 from that frame on; without such FAPs nothing changes.

    model: a `FaceModel`, whose definitions and interpolation table are used, or None for the built-in
    definitions and no table.
    """
    return Resolver(model).push(track)


def known_faps(track: FaceTrack) -> tuple[Int32, Bool]:
    """Return the values in force of all low-level FAPs, and masks of those that what was sent determines.

    int32 (T, 68) and bool (T, 68): as `resolve` without a model, before visemes and expressions are added.
    """
    values, sent, interpolated = _initial_state().hold_low_level(track)
    if interpolated is not None:
        sent = sent & ~interpolated
        values = np.where(sent, values, np.int32(0))
    filled, known = fill_from_mates(values, sent)
    known[:, :2] = False
    return filled.astype(np.int32, copy=False), known


class FitValues(NamedTuple):
    """What a FIT has to do with a track, before mates are copied and visemes and expressions added.

    values: float64 (T, 68), of FAPs sent and computed. known: bool (T, 68), which those are. alone: float64
    (T, 68), what the FIT would give for each FAP if that one alone were not sent. gives: bool (T, 68),
    whether it gives anything.
    """

    values: Float64
    known: Bool
    alone: Float64
    gives: Bool


def fit_values(track: FaceTrack, table: InterpolationTable) -> FitValues:
    """Return what a FIT gives for the FAPs of a track, and what it would give for those that are sent."""
    state = _initial_state()
    values, sent, interpolated = state.hold_low_level(track)
    high_level = state.hold_high_level(track)
    if interpolated is not None:
        sent = sent & ~interpolated
    filled, known, _ = evaluate(table, values, sent, *high_level)
    filled[~known] = 0
    return FitValues(filled, known, *estimate(table, filled, known, *high_level))


def shown_faps(track: FaceTrack, model: FaceSettings | None = None) -> FaceTrack:
    """Return a track that sends all that a face shows: low-level FAPs only, in whole units.

    Those that are shown as 0 throughout and that nothing determines stay unsent. model: as for `resolve`.
    """
    shown = np.rint(resolve(track, model)).astype(np.int32)
    mask = known_faps(track)[1] | shown.any(axis=0)
    mask[:, :2] = False
    return FaceTrack(shown, mask)


class Resolver:
    """`resolve` for a track in pieces: remembers what earlier pieces sent."""

    def __init__(self, model: FaceSettings | None = None) -> None:
        self._definitions = Definitions.default() if model is None else model.definitions
        self._fit = None if model is None else model.fit
        self._state = _initial_state(self._definitions)

    def copy(self) -> Resolver:
        """Return an independent resolver in the same state."""
        other = copy.copy(self)
        other._state = copy.copy(self._state)
        return other

    def push(self, track: FaceTrack) -> Float32:
        """Return the FAPs shown over the next frames: float32 (T, 68), columns 0 and 1 zero."""
        result = np.empty((len(track), FAP_COUNT), dtype=np.float32)
        for start in range(0, len(track), RESOLVED_AT_ONCE):
            block = slice(start, start + RESOLVED_AT_ONCE)
            result[block] = self._push_block(track[block])
        return result

    def _push_block(self, track: FaceTrack) -> Float32:
        last, ever_sent, interpolated = self._state.hold_low_level(track)
        sent = ever_sent
        values: Array = last
        if interpolated is not None:
            sent = ever_sent & ~interpolated
            values = np.where(sent, last, np.int32(0))
        viseme, expression = self._state.hold_high_level(track)
        replaces = expression[:, 4:5] == 0  # else init_face: the expression is the new neutral face
        if self._fit is not None:
            values, sent, from_high_level = evaluate(self._fit, values, sent, viseme, expression)
            # Values that the table derives from the expression must not have it added once more.
            replaces = replaces | fill_from_mates(from_high_level, sent)[0].astype(bool)
        values, known = fill_from_mates(values, sent)
        shown: Float32 = values.astype(np.float32)
        high_level = self._visemes_shown(track, viseme) + self._expressions_shown(track, expression)
        if interpolated is not None:
            by_viseme = ever_sent[:, :1] & self._definitions.visemes.any(axis=0)
            by_expression = ever_sent[:, 1:2] & self._definitions.expressions.any(axis=0)
            undetermined = ever_sent & ~known & ~((high_level != 0) | by_viseme | by_expression)
            np.copyto(shown, last, where=undetermined, casting="same_kind")
            known |= undetermined
        shown += np.where(known & replaces, np.float32(0), high_level)
        shown[:, :2] = 0
        return shown

    def _visemes_shown(self, track: FaceTrack, fields: Int16) -> Float32:
        defined = track.mask[:, 0] & (track.viseme[:, 3] == 1)
        table = _redefine(self._state.visemes, defined, fields[:, 0], track, mouth_only=True)
        self._state.visemes = table.at_end()
        if not fields[:, :2].any():
            return np.zeros((len(track), FAP_COUNT), dtype=np.float32)
        blend = _share(fields[:, 2])
        return table.look_up(fields[:, 0]) * blend + table.look_up(fields[:, 1]) * (1 - blend)

    def _expressions_shown(self, track: FaceTrack, fields: Int16) -> Float32:
        defined = track.mask[:, 1] & (track.expression[:, 5] == 1)
        table = _redefine(self._state.expressions, defined, fields[:, 0], track, mouth_only=False)
        self._state.expressions = table.at_end()
        if not fields[:, [0, 2]].any():
            return np.zeros((len(track), FAP_COUNT), dtype=np.float32)
        first, second = (_share(fields[:, column]) for column in (1, 3))
        # The same expression selected twice is still one: never above its full intensity.
        same = (fields[:, 0] == fields[:, 2])[:, None]
        second = np.where(same, np.minimum(second, 1 - first), second)
        return table.look_up(fields[:, 0]) * first + table.look_up(fields[:, 2]) * second


@dataclass
class _State:
    """Definitions in force after the last frame, the last values sent, and masks of those ever sent.

    Arrays are replaced, never changed, so that a shallow copy is independent.
    """

    visemes: Float32
    expressions: Float32
    values: Int32
    sent: Bool
    interpolated: Bool
    viseme: Int16
    expression: Int16

    def hold_low_level(self, track: FaceTrack) -> tuple[Int32, Bool, Bool | None]:
        """Return (T, 68) values last sent, masks of FAPs ever sent, and to be interpolated (None if none)."""
        if track.mask[:, 2:].all():
            values, sent = track.values, np.ones_like(track.mask)
            sent[:, :2] = np.logical_or.accumulate(track.mask[:, :2], axis=0) | self.sent[:2]
        else:
            values = hold(track.values, track.mask, self.values)
            sent = np.asarray(np.logical_or.accumulate(track.mask, axis=0)) | self.sent
        self.values, self.sent = values[-1].copy(), sent[-1].copy()
        return values, sent, self._hold_interpolated(track)

    def _hold_interpolated(self, track: FaceTrack) -> Bool | None:
        if track.interpolated is None and not self.interpolated.any():
            return None
        own = track.interpolated if track.interpolated is not None else np.zeros_like(track.mask)
        not_empty = np.asarray((track.mask | own).any(axis=1))
        result = own if not_empty.all() else hold(own, not_empty[:, None], self.interpolated)
        self.interpolated = result[-1].copy()
        return result

    def hold_high_level(self, track: FaceTrack) -> tuple[Int16, Int16]:
        """Return the fields of the viseme (T, 4) and the expression (T, 6) in force."""
        viseme = hold(track.viseme, track.mask[:, :1], self.viseme)
        expression = hold(track.expression, track.mask[:, 1:2], self.expression)
        self.viseme, self.expression = viseme[-1].copy(), expression[-1].copy()
        return viseme, expression


def _initial_state(definitions: Definitions | None = None) -> _State:
    """Return the state before the first frame: nothing was sent."""
    definitions = definitions or Definitions.default()
    return _State(
        visemes=definitions.visemes,
        expressions=definitions.expressions,
        values=np.zeros(FAP_COUNT, dtype=np.int32),
        sent=np.zeros(FAP_COUNT, dtype=bool),
        interpolated=np.zeros(FAP_COUNT, dtype=bool),
        viseme=np.zeros(4, dtype=np.int16),
        expression=np.zeros(6, dtype=np.int16),
    )


def _share(amounts: Int16) -> Float32:
    """Return (T, 1) blend or intensity as a share of its largest; quantised ones may lie a little outside."""
    clipped: Float32 = np.clip(amounts, 0, INTENSITY_MAX).astype(np.float32)[:, None]
    return clipped / np.float32(INTENSITY_MAX)


@dataclass(frozen=True, eq=False)
class _DefinitionsInForce:
    """Definitions in force at each frame.

    rows: (K, 68), a table of definitions and those that redefine them. in_force: (T, selects), the row of
    each select at each frame, or None where none is redefined.
    """

    rows: Float32
    in_force: Intp | None

    def look_up(self, select: Int16) -> Float32:
        """Return (T, 68) definition of the selected viseme or expression at each frame."""
        if self.in_force is None:
            return self.rows[select]
        return self.rows[self.in_force[np.arange(len(select)), select]]

    def at_end(self) -> Float32:
        """Return (selects, 68): the table in force after the last frame."""
        return self.rows if self.in_force is None else self.rows[self.in_force[-1]]


def _redefine(
    table: Float32, defined: Bool, select: Int16, track: FaceTrack, *, mouth_only: bool
) -> _DefinitionsInForce:
    """Return the definitions of a table, each replaced from the frame on that defines it: (T,) `defined`."""
    stored = np.array([f.group in MOUTH_GROUPS if mouth_only else f.group > 1 for f in faps()])
    events = np.flatnonzero(defined & (select > 0) & track.mask[:, stored].any(axis=1))
    if not len(events):
        return _DefinitionsInForce(table, None)
    mask = track.mask[events] & stored
    new = fill_from_mates(np.where(mask, track.values[events], 0), mask)[0].astype(np.float32)
    rows = np.broadcast_to(np.arange(len(table)), (len(track), len(table))).copy()
    rows[events, select[events]] = len(table) + np.arange(len(events))
    return _DefinitionsInForce(np.concatenate([table, new]), np.maximum.accumulate(rows, axis=0))
