"""`head_from_photos`: the built-in head in the shape and with the skin of a person in photographs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.errors import ModelError, warn
from fba.face import FaceModel
from fba.face.calibration import fit
from fba.face.feature_points import MIRRORED
from fba.face.fitting._brows import BROWS
from fba.face.fitting._measures import Measure, measure, with_average_forms
from fba.face.fitting._photographs import Photograph
from fba.face.fitting._points_file import FRONT_POINTS, HIDDEN, SIDE_POINTS, Points, check_inside
from fba.face.fitting._skin import paint
from fba.face.fitting._views import SKULL, Observation, View, first_view, fit_views, solve
from fba.face.importers.assembly._repair import repair_tables
from fba.geometry import fit_similarity
from fba.parameters import point_rows

DISTANCE = 1.5
"""Usual distance from the camera of a portrait, metres."""
EYE_DISTANCES = (0.045, 0.080)
"""Least and greatest distance between the pupils of people, metres."""
NEEDED = ("3.5", "3.6")
FEWEST = {"front": 8, "side": 5}
"""Least number of points in each view."""
MAX_TURN = {"front": 30.0, "side": 30.0}
"""Degrees by which a camera may be off the front or the side before the user is warned."""
OTHER_VIEW = 50.0
"""Degrees beyond which it cannot be that view at all."""
MISPLACED = 0.012
"""Metres by which a point is off the fitted head that is told to the user."""


@dataclass(frozen=True, eq=False)
class Photo:
    """A photograph and the feature points on it: pixels to the right and down from its top left corner."""

    photograph: Photograph
    points: Points


@dataclass(frozen=True, eq=False)
class PhotoHead:
    """A head made from photographs.

    model: the face; every FAP moves it. views: how each photograph shows it, the frontal one first. errors:
    for each view, distance of the points of the head from those given, metres on the face, by name.
    measures: of the face, beside those of the built-in head. seen: share of the face's skin that the
    photographs show.
    """

    model: FaceModel
    views: tuple[View, ...]
    errors: tuple[Mapping[str, float], ...]
    measures: tuple[Measure, ...]
    seen: float


def head_from_photos(
    front: Photo,
    side: Photo | None = None,
    *,
    eyes: float | None = None,
    distance: float = DISTANCE,
    hair: bool = True,
    name: str = "",
) -> PhotoHead:
    """Return the built-in head fitted to a person in a frontal photograph and, for its depth, a profile.

    eyes: metres between the person's pupils, which photographs do not tell; None for those of the built-in
    head. distance: metres from the camera to the head. hair: whether the built-in hair stays where no
    photograph shows anything. name: of the model.

    The head's skin is taken from the photographs: the frontal one, beyond about 45 degrees around the head
    the profile, mirrored for the other side, and the built-in skin in their tone where neither shows any.

    Raises ModelError naming the view for too few points, points outside the picture, or points of no face.
    Warns (FbaWarning) of views from elsewhere and of points that do not fit the others.
    """
    from fba.face.builtin import default

    base = default()
    model, views, seen = fit_head(base, front, side, eyes=eyes, distance=distance, name=name)
    photographs = [one.photograph for one in (front, side) if one is not None]
    errors = tuple(_errors(model, view, one) for view, one in zip(views, seen, strict=True))
    _warn_of_errors(["front", "side"][: len(views)], errors)
    model, share = paint(model, photographs, views, hair=hair)
    made = "frontal photograph and profile" if side is not None else "frontal photograph"
    model = model.with_notes({"skin": f"from a {made}"})
    return PhotoHead(model, tuple(views), errors, measure(model, base), share)


def fit_head(
    base: FaceModel,
    front: Photo,
    side: Photo | None = None,
    *,
    eyes: float | None = None,
    distance: float = DISTANCE,
    name: str = "",
) -> tuple[FaceModel, list[View], list[Observation]]:
    """Return (a head fitted to photographs, their views, what they show), as `head_from_photos` before it
    paints the skin. base: the head that is fitted.
    """
    if eyes is not None and not EYE_DISTANCES[0] <= eyes <= EYE_DISTANCES[1]:
        raise ModelError(
            f"pupils {eyes * 1000:g} mm apart are not those of a person: {EYE_DISTANCES[0] * 1000:g} to "
            f"{EYE_DISTANCES[1] * 1000:g} mm"
        )
    if not 0.3 <= distance <= 100:
        raise ModelError(f"a camera {distance:g} m from the head is impossible: 0.3 to 100 m")
    photos = [("front", front)] + ([("side", side)] if side is not None else [])
    for view, photo in photos:
        check_view(view, photo)
    seen = [_observe(photo.points) for _, photo in photos]
    views = [first_view(base.points, seen[0], distance)]
    if side is not None:
        profile = _profile_side(side)
        seen[1] = _observe(side.points, right=profile < 0)
        views.append(first_view(base.points, seen[1], distance, side=profile))
    views = fit_views(base.points, views, seen)
    points, views = solve(base.points, views, seen)
    _check_views([view for view, _ in photos], views)
    row = point_rows()
    apart = float(np.linalg.norm(points[row["3.5"]] - points[row["3.6"]]))
    usual = float(np.linalg.norm(base.points[row["3.5"]] - base.points[row["3.6"]]))
    points *= (usual if eyes is None else eyes) / apart
    usual_face = with_average_forms(base)
    fitted = fit(usual_face, _with_brows(points, usual_face.points), unit="m", name=name)
    model = repair_tables(fitted, fitted)  # a motion that folds such a face stops earlier
    views = fit_views(model.points, views, seen)
    return model, views, seen


def _with_brows(points: Float64, usual: Float64) -> Float64:
    """Return points (84, 3) with brows that no photograph shows where those of a usual face (84, 3) are.

    That face is laid on the other points; otherwise brows would follow the lids, however far these stand out.
    """
    brows = [point_rows()[name] for side in BROWS for name in side]
    known = np.asarray(np.isfinite(points + usual).all(axis=1))
    known[[point_rows()[name] for name in SKULL]] = False  # these are no place of their own
    if known[brows].any():
        return points
    result = points.copy()
    result[brows] = fit_similarity(usual[known], points[known]).apply(usual[brows])
    return result


def template_points(photograph: Photograph, view: str) -> dict[str, tuple[float, float]]:
    """Return the built-in head's points in the middle of a picture, to be dragged. view: front or side."""
    from fba.face.builtin import default

    points = default().points
    width, height = photograph.size
    turn = np.eye(3) if view == "front" else np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    shift = np.array([width / 2, height * 0.45]) + (0.0 if view == "front" else np.array([-0.2 * width, 0.0]))
    seen = View(turn, min(width, height) / 0.32, shift, DISTANCE)
    names = FRONT_POINTS if view == "front" else SIDE_POINTS
    places = seen.project(points[[point_rows()[name] for name in names]])
    return {name: (float(x), float(y)) for name, (x, y) in zip(names, places, strict=True)}


def check_view(view: str, photo: Photo) -> None:
    """Raise ModelError for points on a photograph from which no head can be made. view: front or side."""
    points, where = photo.points, f"{photo.photograph.name or 'the picture'} ({view})"
    check_inside(points, photo.photograph.size, where)
    hidden = [name for name in points if name in HIDDEN]
    if hidden:
        raise ModelError(f"{where}: no photograph shows point {hidden[0]}; leave it out")
    if view == "front":
        missing = [name for name in NEEDED if name not in points]
        if missing:
            raise ModelError(f"{where}: the pupils 3.5 and 3.6 are needed; {', '.join(missing)} is missing")
    if len(points) < FEWEST[view]:
        raise ModelError(f"{where}: {len(points)} points are too few; at least {FEWEST[view]} are needed")
    if view == "front":
        left, right = points["3.5"][0], points["3.6"][0]
        width = photo.photograph.size[0]
        if abs(left - right) < 0.01 * width:
            raise ModelError(
                f"{where}: the pupils are {abs(left - right):.0f} pixels apart in a picture {width} wide; is "
                "this the profile? Give the frontal picture first"
            )
        if left < right:
            raise ModelError(
                f"{where}: the left pupil (3.5) must be right of the right pupil (3.6) in the picture, as "
                "the subject faces the camera; are they exchanged, or is the picture mirrored?"
            )


def _observe(points: Points, *, right: bool = False) -> Observation:
    """Return points as numbers and places. right: whether they are on the subject's right side."""
    names = [MIRRORED.get(name, name) if right else name for name in points]
    return Observation(
        [point_rows()[name] for name in names], np.array(list(points.values()), dtype=np.float64)
    )


def _profile_side(side: Photo) -> float:
    """Return 1 for a profile that shows the subject's left side, -1 for its right. ModelError if neither."""
    where = side.photograph.name or "the picture"

    def column(*names: str) -> float:
        known = [side.points[name][0] for name in names if name in side.points]
        return float(np.mean(known)) if known else float("nan")

    middle, behind = (
        column("9.3", "9.15", "8.1", "2.10"),
        column("10.5", "10.9", "2.13", "3.7", "8.3", "11.6"),
    )
    ahead = middle - behind
    if np.isnan(ahead):  # of the middle alone, the tip of the nose is foremost
        ahead = column("9.3") - column("9.15", "8.1", "2.2", "2.10")
    if np.isnan(ahead):
        raise ModelError(
            f"{where} (side): a profile needs the tip of the nose (9.3) and a point behind it, such as 9.15, "
            "8.3 or 10.5"
        )
    if abs(ahead) < 0.005 * side.photograph.size[0]:
        raise ModelError(f"{where} (side): the nose is not beside the cheek; is this the frontal picture?")
    return -1.0 if ahead > 0 else 1.0


def _check_views(names: list[str], views: list[View]) -> None:
    for name, view in zip(names, views, strict=True):
        yaw, pitch = view.degrees
        off = abs(yaw) if name == "front" else abs(abs(yaw) - 90)
        if off > OTHER_VIEW:
            other = "profile" if name == "front" else "frontal picture"
            raise ModelError(
                f"the {name} picture seems to be taken from {abs(yaw):.0f} degrees beside the face; is this "
                f"the {other}? Give the frontal picture first, then the profile"
            )
        if max(off, abs(pitch)) > MAX_TURN[name]:
            warn(
                f"the {name} picture seems to be taken from {abs(yaw):.0f} degrees beside and {pitch:.0f} "
                "degrees above the face: check the points, or take a straighter one",
                stacklevel=3,
            )


def _errors(model: FaceModel, view: View, seen: Observation) -> dict[str, float]:
    from fba.face.feature_points import names

    off = np.linalg.norm(view.project(model.points[seen.rows]) - seen.places, axis=1) / view.scale
    return {names()[row]: float(error) for row, error in zip(seen.rows, off, strict=True)}


def _warn_of_errors(names: list[str], errors: tuple[Mapping[str, float], ...]) -> None:
    for view, by_name in zip(names, errors, strict=True):
        far = [f"{name} ({off * 1000:.0f} mm)" for name, off in by_name.items() if off > MISPLACED]
        if far:
            warn(f"points of the {view} picture that do not fit the others: {', '.join(far)}", stacklevel=3)
