"""The contours of a face: margins and folds of the lids, contours of the lips, brows.

Each is a curve through feature points: its neutral places, and how much of each feature point's motion
every place takes. Built for the left side; the right side is its mirror image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.face.feature_points import MIRRORED, names, row_of
from fba.face.points import FeaturePointFace

Float64 = npt.NDArray[np.float64]

EYE_STEPS = 18
LIP_STEPS = 24
BROW_STEPS = 11
LID_GAP = 0.0005
"""The lids' margin stands this far (m) off the eyeball."""


@dataclass(frozen=True, eq=False)
class Curve:
    """places: (N, 3) neutral, metres. weights: (N, 84) share of each feature point's displacement."""

    places: Float64
    weights: Float64

    def mirrored(self) -> Curve:
        """The same curve on the other side of the face."""
        swap = np.arange(len(names()))
        for left, right in MIRRORED.items():
            swap[row_of()[left]], swap[row_of()[right]] = row_of()[right], row_of()[left]
        return Curve(self.places * (-1.0, 1.0, 1.0), self.weights[:, swap])


def _share(amounts: dict[str, Float64]) -> Float64:
    count = len(next(iter(amounts.values())))
    weights = np.zeros((count, len(names())))
    for name, amount in amounts.items():
        weights[:, row_of()[name]] = amount
    return weights


def lid(face: FeaturePointFace, *, upper: bool, fold: bool) -> Curve:
    """One lid of the left eye from the inner to the outer corner: its margin, or the fold behind it."""
    point = {name: face.points[row_of()[name]] for name in ("3.1", "3.3", "3.7", "3.11", "3.13", "3.9")}
    inner, outer = point["3.11"], point["3.7"]
    centre = face.eyeball_centres[0]
    u = np.cos(np.linspace(np.pi, 0.0, EYE_STEPS))
    sign = 1.0 if upper else -1.0
    middle = point["3.1" if upper else "3.3"]
    top = point["3.13" if upper else "3.9"]
    bulge = np.clip(1 - u * u, 0.0, None) ** (0.72 if upper else 0.85)
    x = (outer[0] + inner[0]) / 2 + u * (outer[0] - inner[0]) / 2
    line = inner[1] + (outer[1] - inner[1]) * (u + 1) / 2
    if fold:
        reach = 1.16
        x = centre[0] + (x - centre[0]) * reach
        y = line + sign * abs(top[1] - centre[1]) * (0.30 + 0.70 * bulge)
    else:
        y = line + (middle[1] - line[EYE_STEPS // 2 - 1 : EYE_STEPS // 2 + 1].mean()) * bulge
    radius = face.eyeball_radius + LID_GAP * (3.2 if fold else 1.0)
    on_ball = centre[2] + np.sqrt(np.clip(radius**2 - (x - centre[0]) ** 2 - (y - centre[1]) ** 2, 0, None))
    corner = np.where(u < 0, inner[2], outer[2])
    blend = np.clip((np.abs(u) - 0.55) / 0.45, 0, 1) ** 1.5
    z = on_ball * (1 - blend) + corner * blend
    places = np.stack([x, y, z], axis=1)
    if fold:
        return Curve(places, _share({"3.13" if upper else "3.9": bulge}))
    # Half of upper and lower arch together: a lid lowered by the whole opening meets the other all along.
    opening = (np.clip(1 - u * u, 0.0, None) ** 0.72 + np.clip(1 - u * u, 0.0, None) ** 0.85) / 2
    return Curve(places, _share({"3.1" if upper else "3.3": opening}))


def lip(face: FeaturePointFace, *, upper: bool, inner: bool) -> Curve:
    """One contour of one lip, from the right corner to the left, through its five feature points."""
    if inner:
        chain = ("2.5", "2.7", "2.2", "2.6", "2.4") if upper else ("2.5", "2.9", "2.3", "2.8", "2.4")
    else:
        chain = ("8.4", "8.6", "8.1", "8.5", "8.3") if upper else ("8.4", "8.8", "8.2", "8.7", "8.3")
    shaping = ("8.4", "8.6", "8.9", "8.1", "8.10", "8.5", "8.3") if upper and not inner else chain
    u = np.linspace(-1.0, 1.0, LIP_STEPS * 2 + 1)
    u = np.sign(u) * (1 - (1 - np.abs(u)) ** 1.25)  # closer together at the corners
    knots = np.array([face.points[row_of()[name]] for name in shaping])
    at = knots[:, 0] / knots[-1, 0]
    places = spline_basis(at, u) @ knots
    even = np.array([face.points[row_of()[name]][0] for name in chain]) / knots[-1, 0]
    basis = spline_basis(even, u)
    return Curve(places, _share({name: basis[:, i] for i, name in enumerate(chain)}))


def brow(face: FeaturePointFace) -> Curve:
    """The left brow, from its inner to its outer end, a little arched."""
    chain = ("4.1", "4.3", "4.5")
    u = np.linspace(-1.0, 1.0, BROW_STEPS)
    basis = np.stack([u * (u - 1) / 2, 1 - u * u, u * (u + 1) / 2], axis=1)
    knots = np.array([face.points[row_of()[name]] for name in chain])
    return Curve(basis @ knots, _share({name: basis[:, i] for i, name in enumerate(chain)}))


def spline_basis(knots: Float64, at: Float64) -> Float64:
    """(len(at), len(knots)) shares of each knot: the natural cubic spline through them."""
    from scipy.interpolate import CubicSpline

    basis: Float64 = CubicSpline(knots, np.eye(len(knots)), bc_type="natural")(at)
    return basis
