"""Views of a head in photographs, and the head's points that all views together show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Float64, Floating
from fba.capture.points.picture import fit_poses
from fba.parameters import point_rows
from fba.rotations import turn as rotation_about

NOISE = 0.0004
"""Error of points placed on photographs, metres on the face."""
SPREADS = ((0.090, 0.006), (0.035, 0.004), (0.004, 0.002))
"""How faces differ: (length, metres, over which differences are alike; their usual size, metres)."""
ASYMMETRY = 0.2
"""Differences between the two sides of a face, as a share of those between faces."""
SKULL = {"11.1": 0.01, "11.4": 0.02, "11.6": 0.02}
"""How much further, metres, up or down and forwards or backwards, points of hairline and skull usually are
from those of another head: hair may be some centimetres thick, and does not say how deep a face is."""
ROUNDS = 25
TURN_STEP = 0.17
"""Usual turn of a camera in a round, radians: a profile of the middle alone hardly shows it."""
ROBUST = 3.0
"""Points that are further off than this many times the usual error count less."""


@dataclass(frozen=True, eq=False)
class View:
    """How a photograph shows a head.

    rotation: (3, 3), from the head's axes (left, up, forward) to the camera's (right, up, towards it).
    scale: pixels for a metre at the head's origin. shift: (2,), pixels, where the origin is. distance:
    metres from the camera to the origin.
    """

    rotation: Float64
    scale: float
    shift: Float64
    distance: float

    def project(self, points: Floating) -> Float64:
        """Return where points (..., 3), metres, are: pixels to the right and down, (..., 2)."""
        seen = points @ self.rotation.T
        nearer = self.scale / (1 - np.minimum(seen[..., 2:], self.distance / 2) / self.distance)
        return np.asarray(self.shift + seen[..., :2] * (nearer * np.array([1.0, -1.0])))

    def depth(self, points: Floating) -> Float64:
        """Return how much nearer to the camera than the origin points (..., 3) are: (...), metres."""
        return np.asarray(points @ self.rotation[2])

    @property
    def eye(self) -> Float64:
        """(3,), unit: direction from the head to the camera, in the head's axes."""
        return np.asarray(self.rotation[2])

    @property
    def degrees(self) -> tuple[float, float]:
        """Yaw (towards the subject's left is positive) and pitch (from above is positive) of the camera."""
        x, y, z = self.eye
        return float(np.degrees(np.arctan2(x, z))), float(np.degrees(np.arcsin(np.clip(y, -1, 1))))


@dataclass(frozen=True, eq=False)
class Observation:
    """Points of a head in one photograph. rows: (M,) numbers of the points. places: (M, 2), pixels."""

    rows: list[int]
    places: Float64


def first_view(shape: Float64, observed: Observation, distance: float, *, side: float = 0.0) -> View:
    """Return a first estimate of a view of a known shape (84, 3), metres.

    side: 0 for a frontal picture; 1 or -1 for a profile that shows the subject's left or right.
    """
    points = shape[observed.rows]
    places = observed.places * (1.0, -1.0)
    if side:
        turn = np.array([[0.0, 0.0, -side], [0.0, 1.0, 0.0], [side, 0.0, 0.0]])
        flat = (points @ turn.T)[:, :2]
        a, b = flat - flat.mean(axis=0), places - places.mean(axis=0)
        scale = float(np.sqrt((b**2).sum() / (a**2).sum()))
        shift = places.mean(axis=0) - scale * flat.mean(axis=0)
        return View(turn, scale, shift * (1.0, -1.0), distance)
    poses = fit_poses(points, places[None])
    return View(poses.rotation[0], float(poses.scale[0]), poses.shift[0] * (1.0, -1.0), distance)


def fit_views(shape: Float64, views: Sequence[View], seen: Sequence[Observation]) -> list[View]:
    """Return views refined to show a known shape (84, 3), metres, where it was observed."""
    return solve(shape, views, seen, rigid=True)[1]


def solve(
    template: Float64,
    views: Sequence[View],
    seen: Sequence[Observation],
    *,
    rigid: bool = False,
    noise: float | Float64 = NOISE,
    hidden: bool = False,
) -> tuple[Float64, list[View]]:
    """Return (points (84, 3), views): the most likely head near a template that the views show as observed.

    Gauss-Newton over views and shape at once; the shape differs from the template smoothly and nearly alike
    on both sides (see `SPREADS`). rigid: the shape is known. noise: error of the observed places, metres on
    the face, or of each place if there is one view. hidden: whether points that no view shows are estimated,
    too; otherwise they are NaN.
    """
    rows = sorted({row for one in seen for row in one.rows})
    if hidden:
        rows = np.flatnonzero(np.isfinite(template[:, 0])).tolist()
    number = {row: k for k, row in enumerate(rows)}
    base = template[rows]
    size = 0 if rigid else 3 * len(rows)
    prior = np.zeros((0, 0)) if rigid else np.linalg.inv(_covariance(template, rows, len(views) > 1))
    moved = np.zeros((len(rows), 3))
    views = list(views)
    count = size + 6 * len(views)
    for step in range(ROUNDS):
        normal, right = np.zeros((count, count)), np.zeros(count)
        normal[:size, :size] = prior
        right[:size] = -prior @ moved.ravel()[:size]
        for v, (view, one) in enumerate(zip(views, seen, strict=True)):
            at = np.array([number[row] for row in one.rows])
            off = one.places - view.project(base[at] + moved[at])
            by_point, by_view = _slopes(view, base[at] + moved[at])
            usual = noise * view.scale
            error = np.linalg.norm(off, axis=1) / usual
            limit = ROBUST * max(float(np.median(error)), 1.0)
            weight = np.minimum(1.0, limit / np.maximum(error, 1e-12)) / usual**2
            whole = np.zeros((len(at), 2, count))
            if size:
                for axis in range(3):
                    whole[np.arange(len(at)), :, 3 * at + axis] = by_point[:, :, axis]
            whole[:, :, size + 6 * v : size + 6 * v + 6] = by_view
            flat = whole.reshape(-1, count)
            scaled = flat * np.repeat(weight, 2)[:, None]
            normal += scaled.T @ flat
            right += scaled.T @ off.ravel()
        turns = [size + 6 * v + axis for v in range(len(views)) for axis in range(3)]
        normal[turns, turns] += 1 / TURN_STEP**2
        change = np.linalg.solve(normal + 1e-9 * np.eye(count), right)
        moved = moved + change[:size].reshape(-1, 3) if size else moved
        for v, view in enumerate(views):
            turn, grow, shift = np.split(change[size + 6 * v : size + 6 * v + 6], [3, 4])
            views[v] = replace(
                view,
                rotation=_turned(view.rotation, np.clip(turn, -0.3, 0.3)),
                scale=view.scale * float(np.exp(np.clip(grow[0], -0.5, 0.5))),
                shift=view.shift + shift,
            )
        if step > 3 and float(np.abs(change[:size]).max(initial=0.0)) < 1e-7:
            break
    points = np.full_like(template, np.nan)
    points[rows] = base + moved
    return points, views


def _covariance(template: Float64, rows: list[int], deep: bool) -> Float64:
    """Return (3K, 3K): how some points of one head differ from another's, square metres.

    deep: whether several views show depth, which `SKULL` must not change.
    """
    more = np.zeros((len(rows), 3))
    for name, usual in SKULL.items() if deep else ():
        more[np.array(rows) == point_rows()[name], 1:] = usual**2
    return face_covariance(template[rows]) + np.diag(more.ravel())


def _turned(rotation: Float64, vector: Float64) -> Float64:
    """Return a rotation followed by one about a vector (3,), whose length is the angle in radians."""
    angle = float(np.linalg.norm(vector))
    return (
        rotation
        if angle < 1e-12
        else np.asarray(rotation_about(vector / angle, np.asarray(angle)) @ rotation)
    )


def _slopes(view: View, points: Float64) -> tuple[Float64, Float64]:
    """Return the change of a view's places by its points (M, 2, 3), and by the view (M, 2, 6).

    The view's six are a turn (3) in the camera's axes, the logarithm of the scale, and the shift (2).
    """
    seen = points @ view.rotation.T
    nearer = 1 / (1 - seen[:, 2] / view.distance)
    flip = np.array([1.0, -1.0])
    camera = np.zeros((len(points), 2, 3))
    camera[:, 0, 0] = camera[:, 1, 1] = nearer
    camera[:, :, 2] = seen[:, :2] * (nearer**2 / view.distance)[:, None]
    camera *= view.scale * flip[:, None]
    x, y, z = seen.T
    nought = np.zeros_like(x)
    turned = np.stack([[nought, z, -y], [-z, nought, x], [y, -x, nought]]).transpose(2, 0, 1)
    by_view = np.zeros((len(points), 2, 6))
    by_view[:, :, :3] = camera @ turned
    by_view[:, :, 3] = view.project(points) - view.shift
    by_view[:, :, 4:] = np.eye(2)
    return camera @ view.rotation, by_view


def face_covariance(points: Float64) -> Float64:
    """Return (3K, 3K): how the points (K, 3) of one face differ from another's, square metres."""
    mirror = points * (-1.0, 1.0, 1.0)
    result = np.zeros((len(points), 3, len(points), 3))
    for length, usual in SPREADS:
        near, across = (
            np.exp(-((points[:, None] - other[None]) ** 2).sum(axis=2) / (2 * length**2))
            for other in (points, mirror)
        )
        for axis, sign in enumerate((-1.0, 1.0, 1.0)):
            alike = (near + sign * across) / 2
            unlike = (near - sign * across) / 2
            result[:, axis, :, axis] += usual**2 * (alike + ASYMMETRY**2 * unlike)
    flat = result.reshape(3 * len(points), -1)
    return np.asarray(flat + np.eye(len(flat)) * 1e-9)
