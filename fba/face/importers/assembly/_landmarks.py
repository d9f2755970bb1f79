"""Locates the feature points of a head that comes without them, by its eyes and its shapes.

Reliable are the eyeballs (round parts), the lids (what a blink moves most), the lips (where an opening
jaw parts the midline), the corners of the mouth (what a smile moves most), the tip of the nose and the
edges on the profile. All other points are those of the adult head in `neutral.csv`, warped to fit these and
moved onto the skin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fba.arrays import Bool, Float32, Float64
from fba.errors import ModelError, Remedy
from fba.face.authoring.surface.binding import SURFACE_KINDS
from fba.face.authoring.surface.surface import weld_parts
from fba.face.eyeball import LID_POINTS, PUPIL_POINT, flat_width, sphere
from fba.face.importers.assembly._outlines import (
    find_eye_loop,
    lid_points_of_loop,
    mouth_points,
    profile_points,
)
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.importers.assembly._symmetry import mirror_points
from fba.face.importers.assembly._warping import warp_points
from fba.face.model import Part
from fba.face.points import EYEBALL_PER_IRIS
from fba.face.shape_names import canonical_names, fap_of
from fba.parameters import faps, point_rows

RIGHT_LID = ("3.2", "3.4", "3.8", "3.12")
"""Points of the right lids' margins and of the corners between them."""
EYE_CORNERS = {"left": ("3.7", "3.11"), "right": ("3.8", "3.12")}
"""Left and right corner of each eye."""


@dataclass(frozen=True)
class Tuning:
    """Constants of the search for feature points."""

    min_outside_z: float = 0.2  # z of normals; with less, skin is the inside of the mouth, or an ear
    max_in_column: int = 3000  # vertices of a column of the face that are compared with each other
    min_parted_share: float = 0.25  # lips part by at least this share of the jaw's motion
    lip_slope: float = 0.05  # by which a vertex must be nearer to the other lip to be farther aside
    max_half_mouth: float = 0.7  # width that half a mouth has at most, in distances of the eyes
    slit_step: float = 0.02  # width of a step along the line between the lips, in distances of the eyes
    slit_end: float = 0.2  # lips still part at the corner by this share of their gap in the middle
    min_loop_vertices: int = 6  # number of vertices that the opening of an eye has around it at least
    # distance of front teeth from the middle, and from the foremost of the row, in distances of the pupils
    front_teeth: float = 0.12
    corner_width: float = 0.055  # between outer and inner corner of the lips, in distances of the pupils
    max_radius_ratio: float = 1.3  # ratio of the radii above which two shells are not a pair of eyes
    min_pupil_distance: float = 0.7  # of a pupil from its eyeball's centre, forwards, in radii
    max_opening_difference: float = 0.02  # share by which openings differ where lids stay as located
    min_faps: int = 20  # with at least this many shapes named after FAPs, points are where these move most


TUNING = Tuning()


class Eye(NamedTuple):
    """The sphere and the pupil of an eye."""

    centre: Float64
    radius: float
    pupil: Float64


def find_points(
    pieces: Sequence[Piece], path: str, *, symmetric: bool = False, exactly: bool = False
) -> Float64:
    """Return the feature points (84, 3) of a head, in its own unit; +y up, looking to +z.

    symmetric: the points of the right side are the mirror images of those of the left. exactly: those of the
    margin of the lids too, whose rows of vertices otherwise need not be the same.

    Raises ModelError that says which eyes or shapes are missing, and how to give the points instead.
    """
    eyes = find_eyes(pieces, path)
    skin = [piece for piece in pieces if piece.part.kind == "skin"]
    if not skin:
        raise ModelError(f"{path}: no part is skin; give the kinds of the parts").with_remedies(POINTS)
    by_fap = {fap: morph for name, morph in skin[0].morphs.items() if (fap := fap_of(name)) is not None}
    vertices = skin[0].part.vertices.astype(np.float64)
    if len(by_fap) >= TUNING.min_faps:
        points = _from_faps(vertices, by_fap) | _lids_by_loops(pieces, eyes)
    else:
        points = _from_arkit(pieces, skin[0], vertices, eyes, path)
    for side, name in PUPIL_POINT.items():
        points[name] = eyes[side].pupil
    points |= profile_points(skin[0].part, points)
    points |= _tongue(pieces, points) | _teeth(pieces, points)
    if not symmetric:
        return warp_points(pieces, points)
    middle = float(eyes["left"].centre[0] + eyes["right"].centre[0]) / 2
    own = () if exactly or not _open_alike(points) else tuple(name for name in RIGHT_LID if name in points)
    return warp_points(pieces, mirror_points(points, middle, own), symmetric=True, own=own)


def _open_alike(points: Mapping[str, Float64]) -> bool:
    """Return whether both eyes are open equally far, as the one unit of their lids' FAPs needs."""
    if any(name not in points for pair in LID_POINTS.values() for name in pair):
        return False
    left, right = (float(points[upper][1] - points[lower][1]) for upper, lower in LID_POINTS.values())
    return abs(right - left) < TUNING.max_opening_difference * left


def find_eye_points(pieces: Sequence[Piece], path: str) -> Float64:
    """Return the pupils and lids (84, 3) of a head whose eyes can be found, NaN for all other points.

    Shells that cannot be two eyes, such as a bun of hair, give nothing: they overlap, or differ in size.
    """
    points = np.full((len(point_rows()), 3), np.nan)
    try:
        eyes = find_eyes(pieces, path)
    except ModelError:
        return points
    (left, size_left, _), (right, size_right, _) = eyes["left"], eyes["right"]
    alike = max(size_left, size_right) < TUNING.max_radius_ratio * min(size_left, size_right)
    if not alike or left[0] - right[0] < size_left + size_right:
        return points
    found = _lids_by_loops(pieces, eyes)
    for side, (centre, radius, pupil) in eyes.items():
        if pupil[2] - centre[2] > TUNING.min_pupil_distance * radius:
            found[PUPIL_POINT[side]] = pupil
    for name, position in found.items():
        points[point_rows()[name]] = position
    return points


def _tongue(pieces: Sequence[Piece], located: Mapping[str, Float64]) -> dict[str, Float64]:
    """Return a tongue's tip, and its middle and borders a third of the pupils' distance behind that."""
    tongues = [piece.part.vertices for piece in pieces if piece.part.kind == "tongue"]
    if not tongues:
        return {}
    vertices = np.concatenate(tongues).astype(np.float64)
    left, right = float(located["3.5"][0]), float(located["3.6"][0])
    apart, aside = left - right, vertices[:, 0] - (left + right) / 2
    middle = np.abs(aside) < max(0.03 * apart, float(np.abs(aside).min()) * 1.001)
    tip = vertices[int(np.where(middle, vertices[:, 2], -np.inf).argmax())]
    body = np.abs(vertices[:, 2] - tip[2] + apart / 3) < 0.12 * apart
    if not (body & middle).any():
        return {"6.1": tip}
    points = {"6.1": tip, "6.2": vertices[int(np.where(body & middle, vertices[:, 1], -np.inf).argmax())]}
    points["6.3"] = vertices[int(np.where(body, aside, -np.inf).argmax())]
    points["6.4"] = vertices[int(np.where(body, -aside, -np.inf).argmax())]
    return points


def _teeth(pieces: Sequence[Piece], located: Mapping[str, Float64]) -> dict[str, Float64]:
    """Return the edges of the upper and the lower front teeth, in the middle of the row."""
    left, right = float(located["3.5"][0]), float(located["3.6"][0])
    apart, middle = left - right, (left + right) / 2
    points = {}
    for row, name, way in (("upper teeth", "9.10", -1.0), ("lower teeth", "9.11", 1.0)):
        for piece in pieces:
            if piece.part.name == row:
                vertices = piece.part.vertices.astype(np.float64)
                front = vertices[:, 2] > vertices[:, 2].max() - TUNING.front_teeth * apart
                aside = np.abs(vertices[:, 0] - middle)
                front &= aside < max(TUNING.front_teeth * apart, float(aside[front].min()) * 1.001)
                points[name] = vertices[int(np.where(front, way * vertices[:, 1], -np.inf).argmax())]
    return points


def find_eyes(pieces: Sequence[Piece], path: str) -> dict[str, Eye]:
    """Return the left and the right eye."""
    eyes = {}
    for piece in pieces:
        if piece.part.kind == "eye":
            side = "left" if "left" in piece.part.name else "right"
            vertices = piece.part.vertices.astype(np.float64)
            width = flat_width(piece.part)
            if width is not None:  # a drawn eye: its pupil is in its middle
                middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
                pupil = vertices[int(np.linalg.norm((vertices - middle)[:, :2], axis=1).argmin())]
                radius = EYEBALL_PER_IRIS * width
                eyes[side] = Eye(pupil - (0.0, 0.0, radius), radius, pupil)
            elif (ball := sphere(piece.part)) is not None:
                centre, radius = ball[0], ball[1]
                away = np.hypot(vertices[:, 0] - centre[0], vertices[:, 1] - centre[1])
                ahead = vertices[:, 2] - centre[2]
                # the flat back of half a ball has a vertex on the axis, too
                least = TUNING.min_pupil_distance * radius
                away[ahead < (least if ahead.max() > least else 0.0)] = np.inf
                eyes[side] = Eye(centre, radius, vertices[int(away.argmin())])
    missing = [f"the {side} eye" for side in ("left", "right") if side not in eyes]
    if missing:
        raise ModelError(
            f"{path}: {' and '.join(missing)} (feature points 3.5 and 3.6) not found: no part is named "
            f"as an eyeball, none is a round shell"
        ).with_remedies(POINTS)
    return eyes


POINTS = Remedy(
    "points",
    "put a file of its feature points beside the head, with lines 'name,x,y,z' or 'name,vertex', or name one "
    "with {}; fba model points lets you place them by hand",
    "FILE",
)


def _from_faps(vertices: Float64, by_fap: Mapping[int, Float32]) -> dict[str, Float64]:
    """Return the points of the skin, each where the shape named after its FAP moves it furthest."""
    points: dict[str, Float64] = {}
    for fap in faps():
        morph = by_fap.get(fap.number)
        if morph is None or len(fap.feature_points) != 1 or fap.number in (3, 14, 15):
            continue
        name = fap.feature_points[0]
        if name.split(".")[0] in ("6", "7") or name in ("3.5", "3.6") or name in points:
            continue
        points[name] = vertices[int(np.linalg.norm(morph, axis=1).argmax())]
    return points


def _from_arkit(
    pieces: Sequence[Piece], skin: Piece, vertices: Float64, eyes: Mapping[str, Eye], path: str
) -> dict[str, Float64]:
    """Return the points of the lids and the mouth, by shapes named as ARKit's."""
    moving = [name for name, morph in skin.morphs.items() if np.abs(morph).max(initial=0.0) > 0]
    shapes = {shape: skin.morphs[name].astype(np.float64) for shape, name in canonical_names(moving).items()}
    points = _lids_by_loops(pieces, eyes)
    lidless = [side for side, names in LID_POINTS.items() if names[0] not in points]
    needed = (*(f"eyeBlink{side.title()}" for side in lidless), "jawOpen")
    missing = [shape for shape in needed if shape not in shapes]
    if missing:
        has = f"; of its {len(skin.morphs)} shapes, {len(shapes)} are known" if skin.morphs else ""
        raise ModelError(
            f"{path}: the shapes {', '.join(missing)} are missing, by which the lids (3.1 to 3.4) and lips "
            f"(2.2, 2.3, 8.3, 8.4) would be found{has}"
        ).with_remedies(POINTS)
    assert skin.part.normals is not None
    facing = skin.part.normals[:, 2].astype(np.float64) > TUNING.min_outside_z
    for side in lidless:
        points |= _lids(vertices, shapes[f"eyeBlink{side.title()}"], eyes[side], side)
    return points | _mouth(skin.part, facing, shapes, eyes, path)


def _lids(vertices: Float64, blink: Float64, eye: Eye, side: str) -> dict[str, Float64]:
    """Return the lid margins' middles, what a blink lowers most and what it meets, and their corners."""
    centre, radius, _ = eye
    distance = np.linalg.norm(vertices - centre, axis=1)
    near = distance < 1.3 * radius
    column = (
        (distance < 1.6 * radius)
        & (np.abs(vertices[:, 0] - centre[0]) < 0.35 * radius)
        & (vertices[:, 2] > centre[2])
    )
    upper_side = column & (vertices[:, 1] > centre[1] - 0.2 * radius)
    fall = np.where(upper_side, -blink[:, 1], -np.inf)
    # several rows of a margin fall as far; its edge is the lowest and foremost of those
    far = fall > 0.9 * fall.max()
    off = np.abs(vertices[:, 0] - centre[0])
    edge = vertices[:, 1] - 0.2 * vertices[:, 2]
    upper = int(np.where(far, edge + 0.5 * off, np.inf).argmin())
    closed = vertices[upper] + blink[upper]
    rest = column & (vertices[:, 1] < vertices[upper, 1]) & (-blink[:, 1] < 0.4 * fall.max())
    meets = np.where(rest, np.linalg.norm(vertices + blink - closed, axis=1), np.inf)
    close = meets < meets.min() + 0.1 * radius
    edge = vertices[:, 1] + 0.5 * vertices[:, 2]
    lower = int(np.where(close, edge - 0.5 * off, -np.inf).argmax())
    points = dict(zip(LID_POINTS[side], (vertices[upper], vertices[lower]), strict=True))
    # the corners are the outermost vertices that a blink moves
    size = np.linalg.norm(blink, axis=1)
    taken = near & (vertices[:, 2] > centre[2]) & (size > 0.1 * size[upper])
    for corner, way in zip(EYE_CORNERS[side], (1.0, -1.0), strict=True):
        points[corner] = vertices[int(np.where(taken, way * vertices[:, 0], -np.inf).argmax())]
    opening = vertices[upper, 1] - vertices[lower, 1]
    if not opening > 0:
        raise ModelError(f"the lids of the {side} eye were not found: the shape of its blink opens it")
    return points


def _lids_by_loops(pieces: Sequence[Piece], eyes: Mapping[str, Eye]) -> dict[str, Float64]:
    """Return the middles of the lids and corners of the eyes, on the loops of edges around their openings."""
    surface = weld_parts([piece.part for piece in pieces], SURFACE_KINDS)
    points: dict[str, Float64] = {}
    for side, (centre, radius, pupil) in eyes.items():
        loop = find_eye_loop(surface, centre, radius)
        if len(loop) >= TUNING.min_loop_vertices:
            found = lid_points_of_loop(surface.vertices, loop, float(pupil[0]))
            named = zip(LID_POINTS[side] + EYE_CORNERS[side], found, strict=False)
            points |= {name: surface.vertices[vertex] for name, vertex in named}
    return points


def _mouth(
    skin: Part, facing: Bool, shapes: Mapping[str, Float64], eyes: Mapping[str, Eye], path: str
) -> dict[str, Float64]:
    """Return lip middles, mouth corners, and points between. facing: vertices that face forwards."""
    vertices = skin.vertices.astype(np.float64)
    left, right = eyes["left"].centre, eyes["right"].centre
    apart = left[0] - right[0]
    if not apart > 0:
        raise ModelError(
            f"{path}: the left eye is right of the right eye; the head must look to +z, up is +y"
        )
    middle = (left + right) / 2
    drop = -shapes["jawOpen"][:, 1]
    ahead = vertices[:, 2] > middle[2]
    pair = _lip_pair(vertices, drop, ahead, float(middle[0]), apart)
    if pair is None:
        raise ModelError(f"{path}: the shape jawOpen does not part any lips at the midline of the face")
    upper, lower = pair
    points = {"2.2": vertices[upper], "2.3": vertices[lower]}
    line = float(points["2.2"][1] + points["2.3"][1]) / 2  # one lip may reach behind the other
    on_edge = mouth_points(skin, drop, points["2.2"], points["2.3"], float(apart))
    for side, sign, inner, outer in (("Left", 1, "2.4", "8.3"), ("Right", -1, "2.5", "8.4")):
        level = np.abs(vertices[:, 1] - line) < 0.25 * apart
        beside = (vertices[:, 0] - middle[0]) * sign > 0.15 * apart
        front = vertices[:, 2] > middle[2] - 0.6 * apart
        candidates = level & beside & front & facing
        if not candidates.any():
            continue
        shape = next((s for s in (f"mouthSmile{side}", f"mouthStretch{side}") if s in shapes), None)
        end = _end_of_slit(vertices, drop, level & front, float(middle[0]), sign, apart)
        if shape is None:
            if end is None and inner not in on_edge:
                continue
            points[inner] = on_edge[inner] if end is None else vertices[end]
        else:
            size = np.linalg.norm(shapes[shape], axis=1)
            # what moves furthest is the corner of the mouth, or the cheek behind it; only the outside counts
            off = np.abs(vertices[:, 1] - line) / apart
            most = max(float(size[candidates].max()), 1e-12)
            corner = vertices[int(np.where(candidates, size / most - 2 * off, -np.inf).argmax())]
            within = (corner[0] - vertices[:, 0]) * sign > 0.015 * apart
            away = np.linalg.norm(vertices - corner + (0.035 * apart * sign, 0, 0), axis=1)
            points[inner] = vertices[int(np.where(within & front, away, np.inf).argmin())]
            # a smile can move the skin beside the lips further than their corner
            if end is not None and (points[inner][0] - vertices[end, 0]) * sign > 0:
                points[inner] = vertices[end]
        points[inner] = on_edge.get(inner, points[inner])
        # the contours need skin between them: next to each other, one could not move without the other
        beyond = points[inner] + (TUNING.corner_width * apart * sign, 0.0, 0.25 * TUNING.corner_width * apart)
        away = np.linalg.norm(vertices - beyond, axis=1)
        points[outer] = vertices[int(np.where(candidates, away, np.inf).argmin())]
        lips = ahead & (np.abs(vertices[:, 1] - line) < 0.1 * apart)
        half = _lip_pair(vertices, drop, lips, float(middle[0] + points[inner][0]) / 2, apart)
        if half is not None and np.linalg.norm(vertices[half[0]] - vertices[half[1]]) < 0.08 * apart:
            points[{"2.4": "2.6", "2.5": "2.7"}[inner]] = vertices[half[0]]
            points[{"2.4": "2.8", "2.5": "2.9"}[inner]] = vertices[half[1]]
    return points | on_edge


def _end_of_slit(
    vertices: Float64, drop: Float64, near: Bool, middle: float, sign: int, apart: float
) -> int | None:
    """Return the vertex at a corner of the mouth: beyond the last at which an opening jaw parts the lips.

    near: vertices that may be of the lips. middle: the x of the midline. sign: +1 for the left corner. None
    where the lips lie too far apart at rest for that.
    """
    first = 0.0
    last: int | None = None
    for step in np.arange(0.0, TUNING.max_half_mouth, TUNING.slit_step) * apart:
        column = np.flatnonzero((np.abs(vertices[:, 0] - middle - sign * step) < 0.04 * apart) & near)
        if not 0 < len(column) <= TUNING.max_in_column:
            continue
        between = np.linalg.norm(vertices[column][:, None] - vertices[column][None], axis=2)
        touching = np.maximum(1 - between / (0.04 * apart), 0.0)  # lips do, cheeks behind the corner do not
        parted = touching * (drop[column][None] - drop[column][:, None])
        above = np.unravel_index(int(parted.argmax()), parted.shape)[0]
        first = max(first, float(parted.max()))
        if not first > TUNING.min_parted_share * float(drop.max()):
            return None
        if parted.max() > TUNING.slit_end * first:
            last = int(column[above])
    if last is None:
        return None
    # the corner itself does not part: it is the next vertex outwards
    beyond = near & ((vertices[:, 0] - vertices[last, 0]) * sign > 0.015 * apart)
    away = np.where(beyond, np.linalg.norm(vertices - vertices[last], axis=1), np.inf)
    return int(away.argmin()) if away.min() < 0.1 * apart else last


def _lip_pair(
    vertices: Float64, drop: Float64, ahead: Bool, x: float, apart: float
) -> tuple[int, int] | None:
    """Return the upper and lower lip at some x: close vertices that an opening jaw parts furthest."""
    column = np.flatnonzero((np.abs(vertices[:, 0] - x) < 0.04 * apart) & ahead)
    if not len(column) or not drop[column].max() > 0:
        return None
    if len(column) > TUNING.max_in_column:  # a very fine mesh: every few vertices are enough
        column = column[:: len(column) // TUNING.max_in_column + 1]
    positions, falls = vertices[column], drop[column]
    between = np.linalg.norm(positions[:, None] - positions[None], axis=2)
    differs = falls[None] - falls[:, None]
    for reach in (0.04, 0.08, 0.16):
        near = np.where(between < reach * apart, differs, -np.inf)
        above, below = np.unravel_index(int(near.argmax()), near.shape)
        if near[above, below] > TUNING.min_parted_share * falls.max():
            break
    else:
        return None
    half = (falls[above] + falls[below]) / 2
    around = between[above] < reach * apart
    aside = TUNING.lip_slope * np.abs(positions[:, 0] - x)  # of two as near to the other lip, the one at x
    upper = np.where(around & (falls < half), positions[:, 1] + aside, np.inf)
    lower = np.where(around & (falls >= half), positions[:, 1] - aside, -np.inf)
    return int(column[int(upper.argmin())]), int(column[int(lower.argmax())])
