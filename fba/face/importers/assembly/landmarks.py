"""Feature points of a head that nobody marked, found by its eyes and its shapes.

Reliable are the eyeballs (round parts), the lids (what a blink moves most), the lips (where an opening
jaw parts the midline), the corners of the mouth (what a smile moves most), the tip of the nose and the
edges on the profile. All other points are those of the adult head in `neutral.csv`, bent so that these
fit, and put on the skin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fba.arrays import Bool, Float64
from fba.errors import ModelError, Remedy
from fba.face.authoring.shapes.shape_names import canonical_names, fap_of
from fba.face.eyeball import sphere
from fba.face.importers.assembly._profile import profile_points
from fba.face.importers.assembly._warping import warp_points
from fba.face.importers.assembly.pieces import Piece
from fba.parameters import faps

NEEDED = ("eyeBlinkLeft", "eyeBlinkRight", "jawOpen")
"""Shapes without which the points of the FAPU are not found."""
OUTSIDE = 0.2
"""Skin of the face whose normal goes less than this forward is the inside of the mouth, or an ear."""
MOST_IN_COLUMN = 3000
"""So many vertices of one column of the face are compared with each other."""
PARTED = 0.25
"""Lips go apart by more than this share of the jaw's way."""
FEWEST_FAPS = 20
"""From so many shapes named after FAPs on, the points are where these move most."""


def find_points(pieces: Sequence[Piece], path: str) -> Float64:
    """Feature points (84, 3) of a head, in its own unit; +y up, looking to +z.

    Raises ModelError that says which eyes or shapes are missing, and how to give the points instead.
    """
    eyes = _eyes(pieces, path)
    skin = [piece for piece in pieces if piece.part.kind == "skin"]
    if not skin:
        raise ModelError(f"{path}: no part is skin; name the kinds of the parts").with_remedies(POINTS)
    shapes = _Shapes(skin[0])
    found = _from_faps(shapes) if shapes.faps >= FEWEST_FAPS else _from_arkit(shapes, eyes, path)
    for name, side in (("3.5", "left"), ("3.6", "right")):
        found[name] = eyes[side][2]
    found |= profile_points(skin[0].part, found)
    return warp_points(pieces, found | _tongue(pieces, found))


def _tongue(pieces: Sequence[Piece], found: Mapping[str, Float64]) -> dict[str, Float64]:
    """Tip, middle and borders of a tongue: its foremost place, and what is behind it."""
    tongues = [piece.part.vertices for piece in pieces if piece.part.kind == "tongue"]
    if not tongues:
        return {}
    vertices = np.concatenate(tongues).astype(np.float64)
    apart = float(found["3.5"][0] - found["3.6"][0])
    aside = vertices[:, 0] - float(found["3.5"][0] + found["3.6"][0]) / 2
    middle = np.abs(aside) < max(0.03 * apart, float(np.abs(aside).min()) * 1.001)
    tip = vertices[int(np.where(middle, vertices[:, 2], -np.inf).argmax())]
    body = np.abs(vertices[:, 2] - tip[2] + apart / 3) < 0.12 * apart
    if not (body & middle).any():
        return {"6.1": tip}
    points = {"6.1": tip, "6.2": vertices[int(np.where(body & middle, vertices[:, 1], -np.inf).argmax())]}
    points["6.3"] = vertices[int(np.where(body, aside, -np.inf).argmax())]
    points["6.4"] = vertices[int(np.where(body, -aside, -np.inf).argmax())]
    return points


class _Shapes:
    """The skin and its shapes by ARKit's names, or by FAPs."""

    def __init__(self, skin: Piece) -> None:
        self.vertices: Float64 = skin.part.vertices.astype(np.float64)
        assert skin.part.normals is not None
        self.normals: Float64 = skin.part.normals.astype(np.float64)
        self.arkit = {shape: skin.morphs[name] for shape, name in canonical_names(skin.morphs).items()}
        self.by_fap = {fap_of(name): morph for name, morph in skin.morphs.items() if fap_of(name)}
        self.faps = len(self.by_fap)

    def __getitem__(self, shape: str) -> Float64:
        return np.asarray(self.arkit[shape], dtype=np.float64)


def _eyes(pieces: Sequence[Piece], path: str) -> dict[str, tuple[Float64, float, Float64]]:
    """Centre, radius and pupil of each eyeball."""
    found = {}
    for piece in pieces:
        if piece.part.kind == "eye":
            ball = sphere(piece.part)
            if ball is not None:
                centre, radius = ball[0], ball[1]
                vertices = piece.part.vertices.astype(np.float64)
                away = np.hypot(vertices[:, 0] - centre[0], vertices[:, 1] - centre[1])
                away[vertices[:, 2] < centre[2]] = np.inf
                side = "left" if "left" in piece.part.name else "right"
                found[side] = (centre, radius, vertices[int(away.argmin())])
    missing = [f"the {side} eye" for side in ("left", "right") if side not in found]
    if missing:
        raise ModelError(
            f"{path}: {' and '.join(missing)} (feature points 3.5 and 3.6) not found: no part is named "
            f"as an eyeball, none is a round shell"
        ).with_remedies(POINTS)
    return found


POINTS = Remedy(
    "points",
    "put a file of its feature points beside the head, with lines 'name,x,y,z' or 'name,vertex', or name one "
    "with {}",
    "FILE",
)


def _from_faps(shapes: _Shapes) -> dict[str, Float64]:
    """Each point is where the shape named after its FAP moves the skin furthest."""
    found: dict[str, Float64] = {}
    for fap in faps():
        morph = shapes.by_fap.get(fap.number)
        if morph is None or len(fap.feature_points) != 1 or fap.number in (3, 14, 15):
            continue
        name = fap.feature_points[0]
        if name.split(".")[0] in ("6", "7") or name in ("3.5", "3.6") or name in found:
            continue
        found[name] = shapes.vertices[int(np.linalg.norm(morph, axis=1).argmax())]
    return found


def _from_arkit(
    shapes: _Shapes, eyes: Mapping[str, tuple[Float64, float, Float64]], path: str
) -> dict[str, Float64]:
    missing = [shape for shape in NEEDED if shape not in shapes.arkit]
    if missing:
        raise ModelError(
            f"{path}: the shapes {', '.join(missing)} are missing, by which the lids (3.1 to 3.4) and lips "
            f"(2.2, 2.3, 8.3, 8.4) would be found"
        ).with_remedies(POINTS)
    found: dict[str, Float64] = {}
    for side in ("left", "right"):
        found |= _lids(shapes, eyes[side], side)
    found |= _mouth(shapes, eyes, path)
    return found


def _lids(shapes: _Shapes, eye: tuple[Float64, float, Float64], side: str) -> dict[str, Float64]:
    """The margins: near the eyeball, what a blink lowers most, and what it then meets."""
    centre, radius, _ = eye
    blink = shapes["eyeBlinkLeft" if side == "left" else "eyeBlinkRight"]
    vertices = shapes.vertices
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
    names_ = ("3.1", "3.3") if side == "left" else ("3.2", "3.4")
    found = {names_[0]: vertices[upper], names_[1]: vertices[lower]}
    # the corners are as far aside as a blink takes the lid along
    size = np.linalg.norm(blink, axis=1)
    taken = near & (vertices[:, 2] > centre[2]) & (size > 0.1 * size[upper])
    corners = ("3.7", "3.11") if side == "left" else ("3.8", "3.12")
    for corner, way in zip(corners, (1.0, -1.0), strict=True):
        found[corner] = vertices[int(np.where(taken, way * vertices[:, 0], -np.inf).argmax())]
    opening = vertices[upper, 1] - vertices[lower, 1]
    if not opening > 0:
        raise ModelError(f"the lids of the {side} eye were not found: the shape of its blink opens it")
    return found


def _mouth(
    shapes: _Shapes, eyes: Mapping[str, tuple[Float64, float, Float64]], path: str
) -> dict[str, Float64]:
    vertices = shapes.vertices
    left, right = eyes["left"][0], eyes["right"][0]
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
    found = {"2.2": vertices[upper], "2.3": vertices[lower]}
    for side, sign, inner, outer in (("Left", 1, "2.4", "8.3"), ("Right", -1, "2.5", "8.4")):
        shape = next((s for s in (f"mouthSmile{side}", f"mouthStretch{side}") if s in shapes.arkit), None)
        if shape is None:
            continue
        level = np.abs(vertices[:, 1] - vertices[upper, 1]) < 0.25 * apart
        beside = (vertices[:, 0] - middle[0]) * sign > 0.15 * apart
        front = vertices[:, 2] > middle[2] - 0.6 * apart
        size = np.linalg.norm(shapes[shape], axis=1)
        # what moves furthest is the corner of the mouth, or the cheek behind it; only the outside counts
        off = np.abs(vertices[:, 1] - vertices[upper, 1]) / apart
        place = level & beside & front & (shapes.normals[:, 2] > OUTSIDE)
        if not place.any():
            continue
        best = np.where(place, size / max(float(size[place].max()), 1e-12) - 2 * off, -np.inf)
        corner = vertices[int(best.argmax())]
        within = (corner[0] - vertices[:, 0]) * sign > 0.015 * apart
        away = np.linalg.norm(vertices - corner + (0.035 * apart * sign, 0, 0), axis=1)
        found[outer] = corner
        found[inner] = vertices[int(np.where(within & front, away, np.inf).argmin())]
        line = ahead & (np.abs(vertices[:, 1] - vertices[upper, 1]) < 0.1 * apart)
        half = _lip_pair(vertices, drop, line, float(middle[0] + found[inner][0]) / 2, apart)
        if half is not None and np.linalg.norm(vertices[half[0]] - vertices[half[1]]) < 0.08 * apart:
            found[{"2.4": "2.6", "2.5": "2.7"}[inner]] = vertices[half[0]]
            found[{"2.4": "2.8", "2.5": "2.9"}[inner]] = vertices[half[1]]
    return found


def _lip_pair(
    vertices: Float64, drop: Float64, ahead: Bool, x: float, apart: float
) -> tuple[int, int] | None:
    """Upper and lower lip at some x: vertices close together that an opening jaw parts the furthest."""
    column = np.flatnonzero((np.abs(vertices[:, 0] - x) < 0.04 * apart) & ahead)
    if not len(column) or not drop[column].max() > 0:
        return None
    if len(column) > MOST_IN_COLUMN:  # a very fine mesh: every so many-th vertex shows as much
        column = column[:: len(column) // MOST_IN_COLUMN + 1]
    places, falls = vertices[column], drop[column]
    between = np.linalg.norm(places[:, None] - places[None], axis=2)
    differs = falls[None] - falls[:, None]
    for reach in (0.04, 0.08, 0.16):
        near = np.where(between < reach * apart, differs, -np.inf)
        above, below = np.unravel_index(int(near.argmax()), near.shape)
        if near[above, below] > PARTED * falls.max():
            break
    else:
        return None
    half = (falls[above] + falls[below]) / 2
    around = between[above] < reach * apart
    upper = np.where(around & (falls < half), places[:, 1], np.inf)
    lower = np.where(around & (falls >= half), places[:, 1], -np.inf)
    return int(column[int(upper.argmin())]), int(column[int(lower.argmax())])
