"""`learn_fit`: an interpolation table (FIT) from the streams of a performer, and its errors on a face."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32
from fba.errors import FbaError, ModelError, warn
from fba.face._resolve import known_faps, resolve
from fba.face.deform._deformer import Deformer
from fba.face.deform.displacements import unit_motions, vertex_distances
from fba.face.interpolation.table import InterpolationTable
from fba.face.learning._regression import (
    HEAD_COLUMNS,
    add_up,
    choose_order,
    fewest,
    fit_coefficients,
    make_table,
    measure,
)
from fba.face.learning.reduction import linked_columns, send_sources
from fba.face.model import FaceModel
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, fap_steps, faps
from fba.tracks import FaceTrack

FAPS = 10
"""FAPs that are sent when nothing else is asked for (Lavagetto and Pockaj 2001 sent as many)."""
BLOCKS = 5
"""Parts of a single stream that are held out in turn."""
MOST_FOLDS = 50
"""Most times that learning is repeated without a part of the streams."""
UNSEEN_WEIGHT = 1e-9
"""mm^2 by which a step of a FAP counts more, so that those that the model does not show count at all."""
_LOW_LEVEL = np.arange(1, FAP_COUNT + 1) >= FIRST_LOW_LEVEL_FAP
"""Which columns are not a viseme or an expression."""


@dataclass(frozen=True)
class Spread:
    """The mean of errors, the value that 1 % of them exceed, and the largest."""

    mean: float
    percentile_99: float
    largest: float

    @classmethod
    def measure(cls, values: Float64) -> Spread:
        """Return the spread of values (N,), N at least 1."""
        return cls(float(values.mean()), float(np.quantile(values, 0.99)), float(values.max()))

    def text(self) -> str:
        """Return it in words, of millimetres."""
        return (
            f"{self.mean:.2f} mm off on average, {self.percentile_99:.2f} mm in the worst 1 %, "
            f"{self.largest:.2f} mm at most"
        )


@dataclass(frozen=True)
class FapError:
    """Errors of one computed FAP.

    fap: its number. steps: in steps of the standard's quantiser table. millimetres: the largest, at the
    vertex that the FAP moves most; 0 for one that the face does not show.
    """

    fap: int
    steps: Spread
    millimetres: float


@dataclass(frozen=True)
class FitError:
    """Errors of computed FAPs over all frames.

    millimetres: of each frame's worst vertex, in the frame of the head. explained: the share of the motion
    of the computed FAPs that is right: 1 - squared error / squared motion, both in mm. faps: of each.
    """

    millimetres: Spread
    explained: float
    faps: tuple[FapError, ...]


class ErrorSum:
    """Collects errors stream by stream."""

    def __init__(self, deformer: Deformer, motion: Float64) -> None:
        """motion: float64 (68, P, 3), mm, as `unit_motions` gives it."""
        self._deformer = deformer
        self._motion = motion
        self._distances: list[Float64] = []
        self._differences: list[Float64] = []
        self._computed: list[Bool] = []
        self._squares = np.zeros(2)

    def add(self, wanted: Float32, shown: Float32, computed: Bool) -> None:
        """Add frames. wanted, shown: float32 (T, 68). computed: bool (68,), FAPs to which a link leads."""
        off = shown.astype(np.float64) - wanted
        self._distances.append(vertex_distances(self._deformer, wanted, shown) * 1000)
        self._differences.append(np.where(computed, np.abs(off), np.nan))
        motion = self._motion[computed].reshape(int(computed.sum()), -1)
        self._squares += [float(((values[:, computed] @ motion) ** 2).sum()) for values in (off, wanted)]

    def result(self, columns: Sequence[int]) -> FitError:
        """Return the errors of the frames that were added; those of FAPs in these columns one by one."""
        differences = np.concatenate(self._differences)
        reach = np.linalg.norm(self._motion, axis=2).max(axis=1, initial=0.0)
        listed = []
        for column in columns:
            own = differences[~np.isnan(differences[:, column]), column]
            if len(own):
                steps = Spread.measure(own / fap_steps()[column])
                listed.append(FapError(column + 1, steps, float(own.max() * reach[column])))
        missed, moved = self._squares
        explained = 1.0 - missed / moved if moved else 1.0
        return FitError(Spread.measure(np.concatenate(self._distances)), float(explained), tuple(listed))


@dataclass(frozen=True, eq=False)
class LearntFit:
    """A table that was learned.

    sent: numbers of the FAPs that move and that no link gives, the most useful first, the head's rotation
    before all. computed: numbers of those that the table gives. frames: how many it was learned from.
    held_out: errors on streams (of a single stream: on fifths of it) that were not learned from, neither for
    the choice of FAPs nor for the coefficients. streams: how many were learned from.
    """

    table: InterpolationTable
    sent: tuple[int, ...]
    computed: tuple[int, ...]
    frames: int
    streams: int
    held_out: FitError


def learn_fit(
    tracks: Sequence[FaceTrack],
    model: FaceModel | None = None,
    *,
    count: int = FAPS,
    tolerance: float | None = None,
) -> LearntFit:
    """Return a table that gives most FAPs of a performer from a few.

    Sent are the FAPs with which the others are given best, measured in mm on the model, one after another;
    the rotation of the head always, and nothing is computed from it. Every other FAP becomes a sum of at
    most ten of those sent; one that always equals a sent one becomes exactly that. FAPs that never move are
    left out. Errors are those on streams held out one at a time.

    tracks: streams of one performer; of several, what they have in common is learned. model: the head that is
    to use the table, by default the built-in one. count: FAPs to send. tolerance: mm; in place of count, as
    many FAPs are sent as it takes for 99 % of the held-out frames to have no vertex further off.

    Raises FbaError where there is nothing to learn: no FAP is sent or moves, fewer different poses than FAPs
    to send, or nothing is left to compute. ValueError for a count or tolerance that is not positive.
    """
    if count < 1 or (tolerance is not None and not 0 < tolerance < np.inf):
        raise ValueError(f"count and tolerance must be positive and finite, not {count} and {tolerance}")
    learner = _Learner(
        FaceModel.default() if model is None else model, [known_faps(track)[0] for track in tracks]
    )
    if tolerance is not None:
        count = learner.count_within(tolerance)
    learner.check(count)
    order = choose_order(learner.moments, learner.metric, count)
    table = make_table(fit_coefficients(learner.moments, order))
    linked = np.flatnonzero(linked_columns(table)).tolist()
    if not linked:
        raise FbaError(
            f"{len(order)} FAPs are all that move, and sending {count} leaves nothing to compute; "
            "send fewer, or learn from streams that move more"
        )
    unlinked = np.setdiff1d(learner.moments.moving, [*order, *linked]).tolist()
    return LearntFit(
        table,
        tuple(column + 1 for column in [*order, *unlinked]),
        tuple(column + 1 for column in linked),
        frames=sum(len(track) for track in tracks),
        streams=len(tracks),
        held_out=learner.hold_out(count, linked),
    )


class _Learner:
    """Learns from the values of streams, int32 (T, 68) each, and from all but a part of them."""

    def __init__(self, model: FaceModel, streams: list[Int32]) -> None:
        if not any(stream.any() for stream in streams):
            raise FbaError("there is nothing to learn from: the streams send no low-level FAP that moves")
        self._parts = np.array_split(streams[0], BLOCKS) if len(streams) == 1 else streams
        self._part_moments = [measure(part) for part in self._parts]
        self._model = model
        self._deformer = Deformer(model)
        self._motion = unit_motions(self._deformer)
        flat = self._motion.reshape(FAP_COUNT, -1)
        self.metric: Float64 = flat @ flat.T + np.diag(UNSEEN_WEIGHT / fap_steps().astype(np.float64) ** 2)
        self.moments = add_up(self._part_moments)
        self._check_model(np.asarray(flat.any(axis=1)))

    def _check_model(self, shown: Bool) -> None:
        """Warn of FAPs that move and are not shown, bool (68,); ModelError if none is."""
        moving = [column for column in self.moments.moving if column not in HEAD_COLUMNS]
        unseen = [f"{column + 1} {faps()[column].name}" for column in moving if not shown[column]]
        if moving and len(unseen) == len(moving):
            raise ModelError(
                "the model shows none of the FAPs that the streams move, but at most the head's rotation; "
                "learn with one that does, such as the built-in head"
            )
        if unseen:
            warn(
                f"the model does not show FAP {', '.join(unseen)}: their errors do not count in millimetres",
                stacklevel=4,
            )

    def check(self, count: int) -> None:
        """Raise FbaError if this number of FAPs cannot be learned from these streams."""
        least = fewest(self.moments)
        if count < least:
            raise FbaError(
                f"{count} FAPs to send are too few: what moves of the head's rotation, and one each "
                f"of the eyes and of the rest of the face if they move, take {least}; send at least as many"
            )
        poses = len(np.unique(np.concatenate(self._parts), axis=0))
        if poses <= count:
            raise FbaError(
                f"the streams have {poses} different poses, but to send {count} FAPs takes at least "
                f"{count + 1}; send fewer, or learn from longer streams"
            )

    def count_within(self, tolerance: float) -> int:
        """Return how few FAPs keep 99 % of the held-out frames within a tolerance, mm."""
        moving = self.moments.moving
        for count in range(fewest(self.moments), len(moving) + 1):
            # The estimate saves moving the whole face for counts that are out of the question.
            if self._estimate(count) > tolerance:
                continue
            if self.hold_out(count, []).millimetres.percentile_99 <= tolerance:
                return count
        raise FbaError(
            f"even if all {len(moving)} FAPs that differ are sent, 1 % of the held-out frames are more than "
            f"{tolerance:g} mm off, because FAPs that equal others in some streams differ from them in the "
            "stream held out; allow more, or learn from more streams"
        )

    def hold_out(self, count: int, columns: list[int]) -> FitError:
        """Return the errors on parts that were not learned from. columns: FAPs to list one by one."""
        errors = ErrorSum(self._deformer, self._motion)
        for parts, coefficients in self._held_out(count):
            table = make_table(coefficients)
            face = replace(self._model, fit=table)
            for values in parts:
                track = FaceTrack(values, np.tile(_LOW_LEVEL, (len(values), 1)))
                shown = resolve(send_sources(track, table), face)
                errors.add(values.astype(np.float32), shown, linked_columns(table))
        return errors.result(columns)

    def _estimate(self, count: int) -> float:
        """Return how far off, in mm, 1 % of the held-out frames are at the vertices that FAPs move most."""
        distances = []
        for parts, coefficients in self._held_out(count):
            linked = coefficients.any(axis=0)
            off = np.where(linked, coefficients - np.eye(FAP_COUNT), 0.0)
            motion = np.einsum("sf,fpi->spi", off, self._motion, optimize=True).reshape(FAP_COUNT, -1)
            for values in parts:
                shifts = (values @ motion).reshape(len(values), -1, 3)
                distances.append(np.linalg.norm(shifts, axis=2).max(axis=1, initial=0.0))
        return float(np.quantile(np.concatenate(distances), 0.99))

    def _held_out(self, count: int) -> Iterator[tuple[list[Int32], Float64]]:
        """Yield parts of the streams, and the coefficients learned from all others."""
        indices = range(len(self._parts))
        for start in range(min(MOST_FOLDS, len(self._parts))):
            fold = indices[start::MOST_FOLDS]
            others = add_up(self._part_moments[i] for i in indices if i not in fold)
            order = choose_order(others, self.metric, count)
            yield [self._parts[i] for i in fold], fit_coefficients(others, order)
