"""The measurement: every subject, at every operating point, by this codec and by all rivals."""

from __future__ import annotations

import os
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context

import numpy as np

from bench.bitrate.errors import THRESHOLDS, Errors, measure_errors
from bench.bitrate.gltf_samples import gltf_rates
from bench.bitrate.points import Coded, Point, decode_subject, operating_points
from bench.bitrate.results import ALL, EVERYTHING, SENT, Result
from bench.bitrate.rivals import installed_rivals
from bench.bitrate.subjects import FACE, Subject
from fba.arrays import Float32, Float64, Int64
from fba.errors import FbaWarning, OptionError, RangeError
from fba.face import resolve


@dataclass
class _Sum:
    """Bytes and errors of several subjects."""

    subjects: int = 0
    frames: int = 0
    seconds: float = 0.0
    packets: int = 0
    file_bytes: int | None = 0
    live_bytes: int | None = 0
    millimetres: list[Float32] = field(default_factory=list)
    degrees: float = 0.0
    feet: float = 0.0
    units: float = 0.0

    def add(self, subject: Subject, packets: int, file: int | None, live: int | None, errors: Errors) -> None:
        """Add a subject."""
        self.subjects += 1
        self.frames += len(subject.animation)
        self.seconds += subject.seconds
        self.packets += packets
        self.file_bytes = None if file is None or self.file_bytes is None else self.file_bytes + file
        self.live_bytes = None if live is None or self.live_bytes is None else self.live_bytes + live
        self.millimetres.append(errors.millimetres)
        self.degrees = max(self.degrees, errors.degrees)
        self.feet = max(self.feet, errors.feet)
        self.units = max(self.units, errors.units)

    def result(self, data: str, name: str, kind: str, method: str, point: str, numbers: str) -> Result:
        """Return the sum as a result; see `Result` for the arguments."""
        errors = np.concatenate(self.millimetres)
        return Result(
            data, name, kind, method, point, numbers, self.subjects, self.frames,
            round(self.seconds, 3), self.packets,
            self.file_bytes, self.live_bytes, float(errors.max()), float(np.percentile(errors, 99)),
            float((errors <= THRESHOLDS[kind]).mean()), self.degrees, self.feet, self.units,
        )  # fmt: skip


Key = tuple[str, str, str, str]
Points = Callable[[str], Sequence[Point]]


def measure(
    data: str,
    subjects: Sequence[Subject],
    progress: Callable[[str], None] = lambda _: None,
    points: Points = operating_points,
) -> list[Result]:
    """Return results of all subjects together, and of this codec for each.

    data: what they are, in words. progress: called with a line of text after each subject. points: the
    settings of a kind, a function of a module. OptionError where nothing moves.
    """
    if not subjects:
        raise OptionError("nothing moves in these files: there is no face and no body to measure")
    sums: dict[Key, _Sum] = {}
    single: list[Result] = []
    for number, (subject, found) in enumerate(zip(subjects, _measure_all(subjects, points), strict=True), 1):
        progress(
            f"{number} of {len(subjects)}: the {subject.kind} of {subject.name}, {subject.seconds:.1f} s"
        )
        for key, one in found.items():
            total = sums.setdefault(key, _Sum())
            total.add(subject, one.packets, one.file_bytes, one.live_bytes, one.errors)
            if key[3] == "" and len(subjects) > 1:
                alone = _Sum()
                alone.add(subject, one.packets, one.file_bytes, one.live_bytes, one.errors)
                single.append(alone.result(data, subject.name, *key))
    counts = Counter(subject.kind for subject in subjects)
    whole = {key: total for key, total in sums.items() if total.subjects == counts[key[0]]}
    for kind in counts:
        for point in points(kind):
            if (kind, point.method, point.setting, "") not in whole:
                progress(f"{point.method}, {point.setting}: not possible for every {kind}, so it is left out")
    return [total.result(data, EVERYTHING, *key) for key, total in whole.items()] + single


@dataclass
class _Measured:
    packets: int
    file_bytes: int | None
    live_bytes: int | None
    errors: Errors


def _measure_all(subjects: Sequence[Subject], points: Points) -> Iterator[dict[Key, _Measured]]:
    """Yield what each subject comes to, in their order; several are measured side by side."""
    workers = min(os.cpu_count() or 1, len(subjects))
    if workers == 1:
        yield from (_measure_subject(one, points) for one in subjects)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(partial(_measure_subject, points=points), subjects)


def _measure_subject(subject: Subject, points: Points) -> dict[Key, _Measured]:
    """Return bytes and errors by kind, method, point, and which numbers are coded ("" for this codec)."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)  # values near the ends of ranges, at many settings
        return _measure_points(subject, points(subject.kind))


def _measure_points(subject: Subject, points: Sequence[Point]) -> dict[Key, _Measured]:
    source = _source_values(subject)
    found: dict[Key, _Measured] = {}
    known: dict[bytes, Errors] = {}
    for point in points:
        try:
            coded = decode_subject(subject, point.encode(subject))
        except RangeError:  # no quantiser keeps within the tolerance
            continue
        shown = coded.shown.tobytes()
        if shown not in known:
            known[shown] = measure_errors(subject.kind, source, coded.shown, float(subject.animation.rate))
        errors = known[shown]
        packets = len(coded.plane_bytes)
        name = f"{point.method}, {point.setting}"
        found[subject.kind, point.method, point.setting, ""] = _Measured(
            packets, coded.size, int(coded.plane_bytes.sum()), errors
        )
        if point.rivals:
            for (method, numbers), (file, live) in _rival_bytes(subject, point, coded).items():
                found[subject.kind, method, name, numbers] = _Measured(packets, file, live, errors)
    return found


def _source_values(subject: Subject) -> Float64:
    """Return what the source shows: float64 (T, 68 or 296)."""
    if subject.kind == FACE:
        assert subject.animation.face is not None
        return resolve(subject.animation.face).astype(np.float64)
    assert subject.animation.body is not None
    return subject.animation.body.values.astype(np.float64)


def _rival_bytes(
    subject: Subject, point: Point, coded: Coded
) -> dict[tuple[str, str], tuple[int | None, int | None]]:
    """Return bytes as a file and live, by rival and numbers: all that move, or only those that are sent."""
    moving = np.flatnonzero(coded.values.any(axis=0))
    choices = {ALL: moving}
    if subject.kind == FACE:
        choices[SENT] = np.intersect1d(moving, coded.used)
    found: dict[tuple[str, str], tuple[int | None, int | None]] = {}
    for numbers, columns in choices.items():
        table = _in_steps(coded.values[:, columns])
        for rival in installed_rivals():
            live = None if rival.live is None else int(rival.live(table).sum())
            found[rival.name, numbers] = rival.file(table), live
    for name, size in gltf_rates(subject, coded.shown).items():
        found[name, ALL] = size, None
    return found


def _in_steps(values: Int64) -> Int64:
    """Return values (T, N) divided by the step of each column: the largest number that divides all of it."""
    steps = np.maximum(np.gcd.reduce(values, axis=0), 1)
    result: Int64 = values // steps
    return result
