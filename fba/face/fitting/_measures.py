"""The measures of a face that two photographs give: angles of its profile, proportions of its front.

They are those of K. Karpouzis' thesis (National Technical University of Athens), Table 7-2. It numbers the
points of the profile upwards from the chin; these are the feature points of ISO/IEC 14496-2 that correspond.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Float64, Floating
from fba.face import FaceModel
from fba.face.calibration import rebuild_part
from fba.mesh import vertex_normals
from fba.parameters import point_rows
from fba.sampling import smoothstep
from fba.text_files import packaged_rows

FOLD = "the fold between lower lip and chin"
PROFILE = {
    "1": "2.1", "2": "2.10", "3": FOLD, "4": "8.2", "5": "2.2", "6": "8.1", "7": "9.15", "8": "9.3",
    "9": "9.6 9.7", "10": "11.1",
}  # fmt: skip
"""Points of the profile: a feature point, the middle of two, or the deepest place of the fold at the chin."""
FOLD_WIDTH = 0.004
"""Metres either side of the middle in which the profile is looked for."""


@dataclass(frozen=True)
class Measure:
    """A measure of a face, and the same of the built-in head.

    view: "profile" or "front". value, usual: degrees if `angle`, else a ratio of lengths. usual: of the
    built-in head, a derived average adult: a comparison, no norm.
    """

    view: str
    name: str
    value: float
    usual: float
    angle: bool


def measure(model: FaceModel, reference: FaceModel) -> tuple[Measure, ...]:
    """Return the 14 measures of a face, beside those of a reference; NaN where points are missing."""
    pairs = zip(_measure(model), _measure(reference), strict=True)
    return tuple(
        Measure(view, name, value, usual, angle) for (view, name, value, angle), (*_, usual, _) in pairs
    )


def _measure(model: FaceModel) -> list[tuple[str, str, float, bool]]:
    at = {number: _place(model, place) for number, place in PROFILE.items()}

    def point(name: str) -> Float64:
        return np.asarray(model.points[point_rows()[name]])

    def apart(a: Float64, b: Float64) -> float:
        return float(np.linalg.norm(a - b))

    def angle(a: str, b: str, c: str) -> float:
        first, second = at[a] - at[b], at[c] - at[b]
        cosine = first @ second / (np.linalg.norm(first) * np.linalg.norm(second))
        return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))

    wide = apart(point("10.9"), point("10.10"))
    eyes = (apart(point("3.7"), point("3.11")) + apart(point("3.8"), point("3.12"))) / 2
    upper, tall = apart(at["8"], at["10"]), apart(at["4"], at["9"])
    lids = (apart(point("3.1"), point("3.3")) + apart(point("3.2"), point("3.4"))) / 2
    return [
        ("profile", "angle at the chin, 1-2-3", angle("1", "2", "3"), True),
        ("profile", "angle at the tip of the nose, 7-8-9", angle("7", "8", "9"), True),
        ("profile", "upper face to lower, d(8,10) / d(2,8)", upper / apart(at["2"], at["8"]), False),
        ("profile", "angle at the upper lip, 5-6-7", angle("5", "6", "7"), True),
        ("profile", "angle at the lower lip, 3-4-5", angle("3", "4", "5"), True),
        ("profile", "angle between the lips, 4-5-6", angle("4", "5", "6"), True),
        ("front", "width of the face to its height, d(14,15) / d(4,9)", wide / tall, False),
        ("front", "between the eyes, d(12,13)", apart(point("3.5"), point("3.6")) / wide, False),
        ("front", "width of the mouth, d(5a,5b)", apart(point("8.3"), point("8.4")) / wide, False),
        ("front", "height of the mouth, d(4,6)", apart(at["4"], at["6"]) / wide, False),
        ("front", "width of an eye, d(12a,12b)", eyes / wide, False),
        ("front", "height of an eye, d(12c,12d)", lids / wide, False),
        ("front", "height of the nose, d(8,9)", apart(at["8"], at["9"]) / wide, False),
        ("front", "width of the nose, d(8a,8b)", apart(point("9.1"), point("9.2")) / wide, False),
    ]  # fmt: skip


def _place(model: FaceModel, place: str) -> Float64:
    if place != FOLD:
        return np.asarray(model.points[[point_rows()[name] for name in place.split()]].mean(axis=0))
    lip, chin = (model.points[point_rows()[name]] for name in ("8.2", "2.10"))
    skin = np.concatenate([part.vertices for part in model.of_kind("skin")]).astype(np.float64)
    middle = (lip[0] + chin[0]) / 2
    near = skin[(np.abs(skin[:, 0] - middle) < FOLD_WIDTH) & (skin[:, 1] < lip[1]) & (skin[:, 1] > chin[1])]
    near = near[near[:, 2] > min(lip[2], chin[2]) - 0.02]
    if not len(near):
        return np.full(3, np.nan)
    share = (near[:, 1] - chin[1]) / (lip[1] - chin[1])
    return np.asarray(near[int((near[:, 2] - chin[2] - share * (lip[2] - chin[2])).argmin())])


FADE = 0.025
"""Metres over which a form fades between the places where it is known."""
LIDS = (0.018, 0.026)
"""Metres from the pupils up to which nothing moves, as lids must meet, and from which all does."""
CHEEKS = ("5.1", "5.2", "5.3", "5.4")
"""Points that no photograph shows."""


def with_average_forms(base: FaceModel) -> FaceModel:
    """Return the built-in head with the skin of an average face between its own feature points."""
    rows = packaged_rows(__package__, "average_forms.csv")
    places = np.array([[float(one[axis]) for axis in "xyz"] for one in rows]) / 1000
    out = np.array([float(one["out"]) for one in rows]) / 1000
    part = base.part("skin")
    normals = vertex_normals(part.vertices, part.triangles)
    moved = part.vertices + normals * (forms(base.points, places, part.vertices) @ out)[:, None]
    parts = tuple(rebuild_part(one, moved) if one is part else one for one in base.parts)
    own = base.bound - base.starts["skin"]
    bound = (own >= 0) & (own < len(moved))
    points = base.points.copy()
    points[bound] = parts[base.parts.index(part)].vertices[own[bound]]
    return replace(base, parts=parts, points=points)


def forms(points: Float64, places: Float64, at: Floating) -> Float64:
    """Return (N, K): how far points at (N, 3) move if one of K places, and its mirror image, moves by 1.

    points: (84, 3), feature points, which stay but for those of the cheeks. places: (K, 3), with x of 0 and
    above.
    """
    from scipy.interpolate import RBFInterpolator

    row = point_rows()
    known = [here for name, here in row.items() if name not in CHEEKS and np.isfinite(points[here, 0])]
    fixed = np.unique(np.round(points[known], 5), axis=0)
    beside = places[:, 0] > 0
    centres = np.concatenate([fixed, places, places[beside] * (-1, 1, 1)])
    own = np.eye(len(places))
    values = np.concatenate([np.zeros((len(fixed), len(places))), own, own[beside]])
    field = RBFInterpolator(centres, values, kernel="gaussian", epsilon=1 / FADE, smoothing=1e-6, degree=-1)
    pupils = points[[row["3.5"], row["3.6"]]]
    apart = np.linalg.norm(at[:, None] - pupils, axis=2).min(axis=1)
    return np.asarray(field(at) * smoothstep((apart - LIDS[0]) / (LIDS[1] - LIDS[0]))[:, None])
