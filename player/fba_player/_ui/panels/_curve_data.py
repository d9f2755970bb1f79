"""Data of curves: values of single FAPs and BAPs over all frames, and what follows from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Bool, Float32, Float64
from fba.face import FaceModel, FaceSettings, Fapu, Resolver
from fba.parameters import BAP_COUNT, FAP_COUNT, FIRST_LOW_LEVEL_FAP, Bap, Fap, baps, faps
from fba_player._ui.panels._derived import KINDS as DERIVED
from fba_player._ui.panels._derived import (
    derived_unit,
    joint_angle,
    joint_columns,
    measures,
    selected_course,
)
from fba_player.session._group_activity import bap_reach, reach

RESOLVED_AT_ONCE = 512
"""Frames of a face resolved at once: about two milliseconds."""
FILLED_IN_WEIGHT = 0.5
"""Weight of a FAP that is only filled in, where 1 is that of a FAP that is sent."""

FACE_KINDS, BODY_KINDS = ("fap",), ("bap", "joint")
"""Kinds of curves that stay valid when more frames of a body arrive, and when more of a face is resolved."""


@dataclass(frozen=True, eq=False)
class Course:
    """Values of one parameter over time.

    kind: "fap", "bap", or that of a derived curve. times: seconds (T,). values (T,): as shown, in the unit of
    the parameter. sent (T,): whether the frame sends the value itself, or one that it is derived from.
    """

    kind: str
    number: int
    times: Float64
    values: Float64
    sent: Bool


class Courses:
    """Courses of the parameters of a timeline, computed when they are needed.

    timeline: a `Timeline`; it may grow. model: its face. later: seconds that are
    added to its times.
    """

    def __init__(self, timeline: Any, model: FaceSettings | None = None, later: float = 0.0) -> None:
        self._timeline = timeline
        self._later = later
        self._resolver = Resolver(model)
        self._model = model
        self._shown: Float32 = np.zeros((0, FAP_COUNT), np.float32)
        self._done = 0
        self._times: Float64 = np.zeros(0)
        self._courses: dict[tuple[str, int], Course] = {}

    @property
    def has_face(self) -> bool:
        return self._timeline.animation.face is not None

    @property
    def has_body(self) -> bool:
        return self._timeline.animation.body is not None

    @property
    def resolved_share(self) -> float:
        return self._done / max(self._timeline.frames, 1) if self.has_face else 1.0

    def advance(self, blocks: int = 1) -> bool:
        """Resolve the next blocks of frames; return whether there are more. Fast enough for each picture."""
        timeline = self._timeline
        frames, animation = timeline.frames, timeline.animation
        if frames == len(self._times) and self.resolved_share >= 1.0:
            return False
        if frames != len(self._times):
            index = np.asarray(animation.index[:frames])
            self._times = index / float(timeline.rate) + self._later
            self._courses = {key: course for key, course in self._courses.items() if key[0] in FACE_KINDS}
        if animation.face is None:
            return False
        if len(self._shown) < frames:
            grown = np.zeros((max(frames, len(self._shown) * 5 // 4), FAP_COUNT), np.float32)
            grown[: self._done] = self._shown[: self._done]
            self._shown = grown
        for _ in range(blocks):
            stop = min(self._done + RESOLVED_AT_ONCE, frames)
            if stop > self._done:
                self._shown[self._done : stop] = self._resolver.push(animation.face[self._done : stop])
                self._done = stop
        self._courses = {key: course for key, course in self._courses.items() if key[0] in BODY_KINDS}
        return bool(self._done < frames)

    def course(self, kind: str, number: int) -> Course:
        """Return the course of a parameter as far as it is resolved; the same object until more is."""
        key = (kind, number)
        if key not in self._courses:
            self._courses[key] = self._make(kind, number)
        return self._courses[key]

    def movers(self, count: int) -> list[tuple[str, int]]:
        """Return (kind, number) of the parameters that move most, relative to typical motion, in order.

        Of FAPs that mirror each other, only one.
        """
        spans: list[tuple[float, str, int]] = []
        animation, frames = self._timeline.animation, len(self._times)
        if animation.face is not None and self._done:
            shown = self._shown[: self._done]
            span = shown.max(axis=0) - shown.min(axis=0)
            weight = np.where(animation.face.mask[: self._done].any(axis=0), 1.0, FILLED_IN_WEIGHT)
            spans += [
                (float(span[number - 1] * weight[number - 1]) / reach(number), "fap", number)
                for number in range(FIRST_LOW_LEVEL_FAP, FAP_COUNT + 1)
            ]
        if animation.body is not None and frames:
            values, mask = animation.body.values[:frames], animation.body.mask[:frames]
            low = np.min(values, axis=0, where=mask, initial=2**31 - 1)
            high = np.max(values, axis=0, where=mask, initial=-(2**31))
            for number in range(1, BAP_COUNT + 1):
                span_here = max(float(high[number - 1]) - float(low[number - 1]), 0.0)
                spans.append((span_here / bap_reach(number), "bap", number))
        spans.sort(key=lambda span: (-span[0], span[1:]))
        movers: list[tuple[str, int]] = []
        for span_here, kind, number in spans:
            if span_here > 0 and not _is_mate(kind, number, movers):
                movers.append((kind, number))
        return movers[:count]

    def _make(self, kind: str, number: int) -> Course:
        if kind == "fap":
            return self._fap(number)
        if kind == "bap":
            return self._bap(number)
        if kind == "measure":
            measure = measures()[number - 1]
            parts = [self._make(measure.kind, column + 1) for column in measure.columns]
            return _derive(kind, number, parts, lambda v: measure.compute(v, parts[0].times, self._fapu))
        if kind == "joint":
            parts = [self._bap(column + 1) for column in joint_columns(number)]
            return _derive(kind, number, parts, lambda v: joint_angle(number, v))
        face = self._timeline.animation.face
        if face is None:
            return Course(kind, number, np.zeros(0), np.zeros(0), np.zeros(0, bool))
        selected = selected_course(face, self._done, kind, number)
        return Course(kind, number, self._times[: self._done], *selected)

    @property
    def _fapu(self) -> Fapu:
        model = self._model if isinstance(self._model, FaceModel) else FaceModel.default()
        return model.fapu

    def _fap(self, number: int) -> Course:
        face, done = self._timeline.animation.face, self._done
        if face is None:
            return Course("fap", number, np.zeros(0), np.zeros(0), np.zeros(0, bool))
        values = self._shown[:done, number - 1].astype(np.float64)
        return Course("fap", number, self._times[:done], values, np.asarray(face.mask[:done, number - 1]))

    def _bap(self, number: int) -> Course:
        body, frames = self._timeline.animation.body, len(self._times)
        if body is None:
            return Course("bap", number, np.zeros(0), np.zeros(0), np.zeros(0, bool))
        sent = np.asarray(body.mask[:frames, number - 1])
        values = np.asarray(body.values[:frames, number - 1]).astype(np.float64)
        if not sent.all():  # each frame shows the value that was sent last
            last = np.maximum.accumulate(np.where(sent, np.arange(frames), -1))
            values = np.where(last >= 0, values[np.maximum(last, 0)], 0.0)
        return Course("bap", number, self._times, values, sent)


def _derive(kind: str, number: int, parts: list[Course], compute: Callable[[Float64], Float64]) -> Course:
    """Return a curve that follows from others, which are as long as each other."""
    values = compute(np.stack([part.values for part in parts], axis=1))
    sent = np.logical_or.reduce([part.sent for part in parts])
    return Course(kind, number, parts[0].times, values, sent)


def parameter(kind: str, number: int) -> Fap | Bap:
    """Return the table row of a parameter. kind: "fap" or "bap"."""
    return faps()[number - 1] if kind == "fap" else baps()[number - 1]


def amount(kind: str, number: int, value: float) -> tuple[str, str]:
    """Return (number, unit) of a value as text: angles in degrees, others as coded."""
    if kind in DERIVED:
        unit = derived_unit(kind, number)
        digits = {"m/s": 2, "mm": 1, "deg": 1}.get(unit, 0)
        return f"{value:.{digits}f}", unit
    row = parameter(kind, number)
    if row.unit in ("AU", "1e-5 rad"):
        return f"{np.degrees(value * 1e-5):.1f}", "deg"
    return f"{value:.0f}", "" if row.unit == "user defined" else row.unit


def _is_mate(kind: str, number: int, others: list[tuple[str, int]]) -> bool:
    """Return whether a FAP is the mate of one of these, on the other side or on the other lip contour."""
    if kind != "fap":
        return False
    fap = faps()[number - 1]
    mates = {fap.left_right_mate, fap.lip_mate} - {None}
    mates |= {faps()[mate - 1].left_right_mate for mate in mates if mate is not None}
    return any(("fap", mate) in others for mate in mates)


@dataclass(frozen=True, eq=False)
class Envelope:
    """Points (N,) of a curve: x as a share of the width, values, and whether the value was sent."""

    x: Float64
    values: Float64
    sent: Bool

    def runs(self) -> list[tuple[int, int]]:
        """Return (first, last + 1) of each run of points that were sent."""
        edges = np.flatnonzero(np.diff(np.r_[False, self.sent, False].astype(np.int8)))
        return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def envelope(times: Float64, values: Float64, sent: Bool, low: float, high: float, columns: int) -> Envelope:
    """Return a curve between two times with as many points as pixel columns can show.

    times: ascending. With few frames, each is a point, and also the one before and the one after the range;
    with many, each column has its least and its largest value.
    """
    if not len(times) or columns < 1 or not high > low:
        return Envelope(np.zeros(0), np.zeros(0), np.zeros(0, bool))
    first = np.searchsorted(times, low, side="left")
    last = np.searchsorted(times, high, side="right")
    if last - first <= 2 * columns:
        part = slice(max(int(first) - 1, 0), min(int(last) + 1, len(times)))
        return Envelope((times[part] - low) / (high - low), values[part], sent[part])
    edges = np.searchsorted(times, np.linspace(low, high, columns + 1)[:-1], side="left")
    # Of columns that begin at the same frame, the last has it.
    starts, column_of = np.unique(edges, return_index=True)
    column_of = np.r_[column_of[1:] - 1, columns - 1]
    in_range = starts < last
    starts, column_of = starts[in_range], column_of[in_range]
    seen = values[: int(last)]
    least, largest = np.minimum.reduceat(seen, starts), np.maximum.reduceat(seen, starts)
    any_sent = np.logical_or.reduceat(sent[: int(last)], starts)
    # up in one column, down in the next, so that neighbours are joined
    up = (np.arange(len(starts)) % 2).astype(bool)
    pairs = np.where(up, [largest, least], [least, largest]).T
    return Envelope(np.repeat((column_of + 0.5) / columns, 2), pairs.ravel(), np.repeat(any_sent, 2))
