"""`Index`: silhouettes of performances, drawn from many sides, in which an outline is found again.

Searches find the nearest of many silhouettes, exactly (`nearest`), and the likeliest sequence (`follow`).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float32, Float64, Floating, Int32, Int64, UInt8
from fba.body import BodyModel
from fba.errors import FbaError, LimitError
from fba.face import FaceModel
from fba.limits import DEFAULT_LIMITS, Limits
from fba.outlines._figure import Figure, read_poses
from fba.outlines._index_file import CANVAS, Stored, Stream, pack_mask, read_index, unpack_mask, write_index
from fba.outlines._mask import fit_mask, without_specks
from fba.outlines._methods import (
    Ground,
    describe_points,
    earth_movers_distance,
    lower_bounds,
    outline_distances,
    project,
)
from fba.outlines._raster import View, draw_silhouette
from fba.parameters import BAP_COUNT, FAP_COUNT, FIRST_LOW_LEVEL_FAP, bap_angles
from fba.tracks import BodyTrack, FaceTrack

MOST_SILHOUETTES = 200_000
"""Largest number of silhouettes of an index, which take about 2 kB each."""
POSE_WEIGHT = 0.02
"""Cost of a mean change by 1 radian, or by 1000 of FAPs, from one picture to the next."""
VIEW_WEIGHT = 0.01
"""Cost of a change of the side by 1 radian from one picture to the next."""
CHOICES = 60
"""Silhouettes nearest by the earth mover's distance, whose outlines are compared."""


@dataclass(frozen=True)
class Choice:
    """What is drawn for an index.

    views: number of sides, evenly around the figure. every: the step between frames that are drawn. pitches:
    degrees from above from which each side is drawn. Raises ValueError for none of these.
    """

    views: int = 24
    every: int = 5
    pitches: tuple[float, ...] = (0.0,)

    def __post_init__(self) -> None:
        if self.views < 1 or self.every < 1 or not self.pitches:
            raise ValueError("Choice: views and every must be at least 1, and a pitch is needed")

    @property
    def all_views(self) -> tuple[View, ...]:
        """The sides at all pitches."""
        yaws = [(180.0 + 360.0 * number / self.views) % 360.0 - 180.0 for number in range(self.views)]
        return tuple(View(yaw, pitch) for pitch in self.pitches for yaw in sorted(yaws, key=abs))


@dataclass(frozen=True)
class Hit:
    """A silhouette that was found.

    stream: name of the performance. frame: its number in there, from 0. seconds: its time. view: the side.
    distance: `outline_distances`, relative to the longer side of the figure. number: of the silhouette.
    """

    stream: str
    frame: int
    seconds: float
    view: View
    distance: float
    number: int


class Index:
    """Silhouettes of performances, each from the same sides; `build_index` and `Index.load` make one.

    stored: its arrays. Silhouette n shows pose n // V from view n % V.
    """

    def __init__(self, stored: Stored) -> None:
        self.stored = stored

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, limits: Limits = DEFAULT_LIMITS) -> Index:
        """Read an index.

        Raises FormatError for another kind of file, a damaged or a contradictory one; LimitError.
        """
        return cls(read_index(path, limits))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the index, whole or not at all. Raises FormatError where that fails."""
        write_index(path, self.stored)

    def __len__(self) -> int:
        return len(self.stored.descriptions)

    @property
    def streams(self) -> tuple[Stream, ...]:
        """The performances."""
        return self.stored.streams

    @property
    def views(self) -> tuple[View, ...]:
        """The sides from which each pose was drawn."""
        return self.stored.views

    def silhouette(self, number: int) -> Bool:
        """Return a silhouette, (100, 100)."""
        return unpack_mask(self.stored.masks[number])

    def search(self, mask: Bool, count: int = 10, *, away_from: View | None = None) -> list[Hit]:
        """Return the silhouettes nearest to one as `read_mask` returns it, the nearest first.

        away_from: only from sides that are at least 60 degrees from this one.
        """
        return self._nearest(fit_mask(mask), count, self._far_from(away_from))

    def search_sequence(self, masks: Sequence[Bool]) -> list[Hit]:
        """Return a silhouette for each of several that follow each other in time.

        Of 60 that are near each, those are chosen that are near and change least in pose and side from one to
        the next.
        """
        found = [self._nearest(fit_mask(mask), CHOICES, self._far_from(None)) for mask in masks]
        costs = [np.array([hit.distance for hit in hits]) for hits in found]
        steps = [self._change(before, after) for before, after in pairwise(found)]
        return [hits[number] for hits, number in zip(found, follow(costs, steps), strict=True)]

    def animation(self, hits: Sequence[Hit], rate: Fraction) -> Animation:
        """Return the poses that were found as the frames of an animation: BAPs, and low-level FAPs."""
        stored, poses = self.stored, [hit.number // len(self.views) for hit in hits]
        of_stream = stored.pose_streams[poses]
        faces = np.array([stream.face for stream in self.streams])[of_stream]
        bodies = np.array([stream.body for stream in self.streams])[of_stream]
        face = FaceTrack(np.where(faces, stored.faps[poses], 0), faces) if faces.any() else None
        body = BodyTrack(np.where(bodies, stored.baps[poses], 0), bodies) if bodies.any() else None
        return Animation(rate, np.arange(len(hits)), face, body, "found")

    @cached_property
    def _projected(self) -> Float32:
        return np.asarray(project(self.stored.descriptions), dtype=np.float32)

    @cached_property
    def _yaws(self) -> Float64:
        return np.array([view.yaw for view in self.views])

    def _far_from(self, view: View | None) -> Int64:
        allowed = np.ones(len(self.views), dtype=bool) if view is None else _apart(self._yaws, view.yaw) >= 60
        return np.flatnonzero(np.tile(allowed, len(self.stored.pose_streams)))

    def _nearest(self, mask: Bool, count: int, among: Int64) -> list[Hit]:
        """Return those of the nearest by the earth mover's distance whose outlines are nearest, too."""
        rows = self.stored.descriptions[among]
        tried = max(count, CHOICES)
        numbers, _, _ = nearest(describe_points(mask), rows, tried, projected=self._projected[among])
        numbers = among[numbers]
        others = np.array([self.silhouette(number) for number in numbers]).reshape(-1, CANVAS, CANVAS)
        distances = outline_distances(unpack_mask(pack_mask(mask)), others)
        order = np.argsort(distances, kind="stable")[:count]
        return [self._hit(int(numbers[n]), float(distances[n])) for n in order]

    def _hit(self, number: int, distance: float) -> Hit:
        pose, view = divmod(number, len(self.views))
        stream = self.streams[self.stored.pose_streams[pose]]
        frame = int(self.stored.pose_frames[pose])
        seconds = float(self.stored.pose_indices[pose] / stream.rate)
        return Hit(stream.name, frame, seconds, self.views[view], distance, number)

    def _change(self, before: Sequence[Hit], after: Sequence[Hit]) -> Float64:
        """Return the cost (K, L) of going from silhouettes to others."""
        one, other = (np.array([hit.number for hit in hits]) for hits in (before, after))
        count = len(self.views)
        turned = np.radians(_apart(self._yaws[one % count][:, None], self._yaws[other % count]))
        posed = np.abs(self._postures[one // count][:, None] - self._postures[other // count]).mean(axis=-1)
        return np.asarray(VIEW_WEIGHT * turned + POSE_WEIGHT * posed)

    @cached_property
    def _postures(self) -> Float64:
        """Angles of the joints that move, radians, and FAPs that move, thousands: (K, P)."""
        angles = np.where(bap_angles(), self.stored.baps, 0) * 1e-5
        joined = np.concatenate([angles, self.stored.faps * 1e-3], axis=1)
        moving = np.ptp(joined, axis=0) > 0
        return joined[:, moving] if moving.any() else joined[:, :1]


def build_index(
    performances: Iterable[tuple[str, Animation]],
    choice: Choice = Choice(),
    *,
    model: FaceModel | None = None,
    body: BodyModel | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Index:
    """Return an index of the silhouettes of performances, by name.

    One with a body is drawn as a person, another as a head. model, body: by default the built-in ones.
    progress: called with (done, total) silhouettes. Raises ModelError for a figure without triangles,
    LimitError for too many silhouettes, FbaError without any frames.
    """
    face = model or FaceModel.default()
    listed = [(name, animation, range(0, len(animation), choice.every)) for name, animation in performances]
    total = sum(len(frames) for _, _, frames in listed) * choice.views * len(choice.pitches)
    if not total:
        raise FbaError("an index needs at least one frame; the files have 0")
    if total > MOST_SILHOUETTES:
        raise LimitError(
            f"{total} silhouettes are more than the {MOST_SILHOUETTES} that an index holds; "
            "draw fewer views, or frames at a larger step",
            limit="silhouettes", found=total, allowed=MOST_SILHOUETTES,
        )  # fmt: skip
    views = choice.all_views
    figures: dict[bool, Figure] = {}
    masks, descriptions = list[UInt8](), list[Float64]()
    tables = list[tuple[Int32, Int32, Int64, Int64, Int32]]()
    for stream, (_, animation, frames) in enumerate(listed):
        has_body = animation.body is not None
        if has_body not in figures:
            figures[has_body] = Figure(face, (body or BodyModel.default()) if has_body else None)
        figure, poses, chosen = (
            figures[has_body],
            read_poses(animation, face),
            np.array(frames, dtype=np.int64),
        )
        owner = np.full(len(chosen), stream, dtype=np.int32)
        tables.append((poses.faps[chosen], poses.baps[chosen], chosen, animation.index[chosen], owner))
        for frame in frames:
            vertices = figure.vertices(poses.faps[frame], poses.baps[frame])
            for view in views:
                # Locks of hair leave specks, holes and empty rows: cut out and fit, as queries are.
                mask = fit_mask(without_specks(draw_silhouette(vertices, figure.triangles, view)))
                masks.append(pack_mask(mask))
                descriptions.append(describe_points(mask))
                if progress is not None:
                    progress(len(masks), total)
    faps, baps, pose_frames, pose_indices, pose_streams = (
        np.concatenate(each) for each in zip(*tables, strict=True)
    )
    stored = Stored(
        streams=tuple(_stream(name, animation) for name, animation, _ in listed), views=views, faps=faps,
        baps=baps, pose_frames=pose_frames, pose_indices=pose_indices, pose_streams=pose_streams,
        masks=np.stack(masks), descriptions=np.stack(descriptions).astype(np.float32),
    )  # fmt: skip
    return Index(stored)


def _stream(name: str, animation: Animation) -> Stream:
    face, body = animation.face, animation.body
    shown = tuple(face is not None and fap >= FIRST_LOW_LEVEL_FAP for fap in range(1, FAP_COUNT + 1))
    sent = np.zeros(BAP_COUNT, dtype=bool)
    if body is not None:
        sent |= body.mask.any(axis=0)
    return Stream(name, animation.rate, shown, tuple(map(bool, sent)))


def _apart(yaws: Float64, yaw: Float64 | float) -> Float64:
    """Return the angles between sides, degrees, 0 to 180."""
    return np.asarray(np.abs((yaws - yaw + 180) % 360 - 180))


def nearest(
    query: Floating,
    descriptions: Float32,
    count: int,
    *,
    projected: Float32 | None = None,
    ground: Ground = "cityblock",
    prune: bool = True,
) -> tuple[Int64, Float64, int]:
    """Return the numbers (count,) of the nearest descriptions, the nearest first, and their distances.

    query: (N, D). descriptions: (S, N, D), of equal mass. projected: (S, D, N), `project` of these, where it
    is at hand. prune: leave out what lower bounds exclude, which changes no result. The third result is the
    number of distances that were computed.
    """
    total = len(descriptions)
    bounds = np.zeros(total)
    if prune:
        bounds = lower_bounds(
            project(query), project(descriptions) if projected is None else projected, ground
        )
    found: list[tuple[float, int]] = []
    compared = 0
    for number in np.argsort(bounds, kind="stable").tolist():
        # Bounds of float32 projections may exceed the distance by rounding.
        if len(found) == count and bounds[number] > found[-1][0] * (1 + 1e-5) + 1e-6:
            break
        distance = earth_movers_distance(query, descriptions[number], ground)
        compared += 1
        found = sorted([*found, (distance, number)])[:count]
    return (
        np.array([number for _, number in found], dtype=np.int64),
        np.array([distance for distance, _ in found]),
        compared,
    )


def follow(costs: Sequence[Floating], steps: Sequence[Floating]) -> list[int]:
    """Return the choice for each picture that costs least over all (Viterbi's algorithm).

    costs: (K,) for each picture, of its choices. steps: (K, L) from each picture to the next, the cost of
    going from a choice to another.
    """
    best = np.asarray(costs[0], dtype=np.float64)
    came: list[Int64] = []
    for cost, step in zip(costs[1:], steps, strict=True):
        over = best[:, None] + step
        came.append(over.argmin(axis=0))
        best = over.min(axis=0) + cost
    chosen = [int(best.argmin())]
    for before in reversed(came):
        chosen.append(int(before[chosen[-1]]))
    return chosen[::-1]
