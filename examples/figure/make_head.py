"""Makes the built-in head: `fba/face/builtin/head.glb`.

    python examples/figure/make_head.py

Base figure, see NOTICE.txt: cut, given adult proportions and the standard's neutral face (`sculpt.py`),
refined about eyes, mouth and skull (`subdivide.py`); eyeballs, teeth, tongue added; feature points bound.
"""

from __future__ import annotations

import csv
from pathlib import Path

import eyeballs
import figure
import mouth
import numpy as np
import numpy.typing as npt
import sculpt
from sculpt import EYE_CENTRE, EYE_RADIUS, IRIS
from subdivide import Refined, refine

from fba.face.feature_points import MIRRORED, names, row_of
from fba.face.model import Material, Part

Float64 = npt.NDArray[np.float64]
HERE = Path(__file__).parent
ORIGIN = np.array([0.0, EYE_CENTRE[1], EYE_CENTRE[2] + EYE_RADIUS])
"""Between the pupils, in the frame of `figure.head`."""
TEETH = np.array([0.0, -0.0713, 0.0823])
"""Where the edges of the middle incisors meet."""
TONGUE = TEETH + (0.0, 0.0002, -0.0022)


def skin() -> tuple[Refined, sculpt.Marks]:
    """The refined skin in the final frame, and where its vertices are by rings."""
    base = figure.head()
    where = sculpt.marks(base)
    formed = sculpt.sculpted(base, where)
    centre = formed.vertices[formed.quads].mean(axis=1)
    x, y, z = centre.T
    from_eye = np.linalg.norm(np.stack([np.abs(x), y, z], axis=1) - EYE_CENTRE, axis=1)
    outside = formed.tile == 0
    eyes = (from_eye < 0.026) & (z > 0.066)
    lips = (np.abs(x) < 0.034) & (y < -0.025) & (y > -0.098) & (z > 0.07)
    refined = refine(formed, outside & (eyes | lips | (y > 0.03)))
    vertices = sculpt.laid_on_eyeballs(refined.vertices, carried(refined, where.eye)) - ORIGIN
    vertices = exactly_symmetric(vertices)
    return (
        Refined(vertices, refined.triangles, refined.corners, refined.uvs, refined.quads, refined.blend),
        where,
    )


def carried(refined: Refined, ring: npt.NDArray[np.int64]) -> Float64:
    """A ring number on the coarse vertices, on the fine ones between them too."""
    value = refined.blend @ ring.astype(np.float64)
    far = refined.blend @ (ring == sculpt.FAR).astype(np.float64)
    return np.where(far > 0, sculpt.FAR, value)


def exactly_symmetric(vertices: Float64) -> Float64:
    """Every vertex and its mirror image averaged, those of the midline put on it."""
    from scipy.spatial import cKDTree

    _, mate = cKDTree(vertices).query(vertices * (-1.0, 1.0, 1.0))
    if not (mate[mate] == np.arange(len(mate))).all():
        raise SystemExit("the head is not symmetric: a vertex has no mirror image of its own")
    return (vertices + vertices[mate] * (-1.0, 1.0, 1.0)) / 2


def shells() -> tuple[dict[str, mouth.Mesh], dict[str, int]]:
    """Eyes, teeth and tongue in the final frame, and the vertices of their feature points."""
    ball = eyeballs.eyeball(EYE_CENTRE, EYE_RADIUS, IRIS)
    other = (ball[0] * (-1.0, 1.0, 1.0), ball[1][:, ::-1].copy(), ball[2])
    upper, upper_points = mouth.teeth(TEETH, upper=True)
    lower, lower_points = mouth.teeth(TEETH, upper=False)
    tongue, tongue_points = mouth.tongue(TONGUE)
    meshes = {"eye_left": ball, "eye_right": other, "teeth_upper": upper, "teeth_lower": lower, "tongue": tongue}
    found = {"3.5": 0, "3.6": 0, "9.8": upper_points["root"], "9.10": upper_points["edge"],
             "9.9": lower_points["root"], "9.11": lower_points["edge"], **tongue_points}  # fmt: skip
    return {name: (mesh[0] - ORIGIN, mesh[1], mesh[2]) for name, mesh in meshes.items()}, found


KINDS = {"eye_left": "eye", "eye_right": "eye", "teeth_upper": "teeth", "teeth_lower": "teeth", "tongue": "tongue"}


def parts_and_points() -> tuple[tuple[Part, ...], Float64, npt.NDArray[np.int32]]:
    """Everything of the head but its tables: parts, feature points (84, 3) and bound vertices (84,)."""
    surface, where = skin()
    meshes, found = shells()
    parts = [_skin_part(surface, where)]
    for name, (vertices, triangles, colours) in meshes.items():
        material = Material(KINDS[name], (1.0, 1.0, 1.0), 0.3)
        parts.append(Part(name, KINDS[name], vertices, triangles, colours=colours, material=material))
    starts = dict(zip([p.name for p in parts], np.cumsum([0, *(len(p.vertices) for p in parts)]), strict=False))
    points, bound = _points(surface, where, meshes, found, starts)
    for row in np.flatnonzero(bound >= 0):
        points[row] = np.concatenate([p.vertices for p in parts])[bound[row]]
    return tuple(parts), points, bound


def _skin_part(surface: Refined, where: sculpt.Marks) -> Part:
    """The skin, its vertices doubled along the seam of the texture."""
    pairs = np.stack([surface.triangles.ravel(), surface.corners.ravel()], axis=1)
    inner = np.repeat(surface.uvs[surface.corners].mean(axis=1)[:, 0] >= 1.0, 3)
    pairs[inner, 1] = -1  # inside of mouth and eyes: no texture of its own
    seen = np.zeros(len(surface.vertices), dtype=int) - 1
    seen[pairs[~inner, 0]] = pairs[~inner, 1]
    pairs[inner, 1] = seen[pairs[inner, 0]]
    # A vertex keeps its number; only further corners of a seam get new ones.
    first = seen.copy()
    extra = pairs[pairs[:, 1] != first[pairs[:, 0]]]
    unique = np.unique(extra, axis=0)
    number = {tuple(pair): len(surface.vertices) + k for k, pair in enumerate(unique.tolist())}
    flat = [
        vertex if uv == first[vertex] else number[vertex, uv] for vertex, uv in pairs.tolist()
    ]
    vertices = np.concatenate([surface.vertices, surface.vertices[unique[:, 0]]])
    uv_rows = np.concatenate([first, unique[:, 1]])
    texcoords = np.where(uv_rows[:, None] >= 0, surface.uvs[uv_rows], (0.5, 0.372))
    texcoords = np.stack([texcoords[:, 0], 1 - texcoords[:, 1]], axis=1)
    triangles = np.array(flat).reshape(-1, 3)
    return Part("skin", "skin", vertices, triangles, texcoords=texcoords, material=Material("skin", (0.8, 0.6, 0.5)))


def _points(
    surface: Refined,
    where: sculpt.Marks,
    meshes: dict[str, mouth.Mesh],
    found: dict[str, int],
    starts: dict[str, int],
) -> tuple[Float64, npt.NDArray[np.int32]]:
    points, bound = np.full((len(names()), 3), np.nan), np.full(len(names()), -1, dtype=np.int32)
    finder = Finder(surface, where)
    with (HERE / "points.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            name, part = row["point"], row["part"]
            place = np.array([float(row[axis]) for axis in "xyz"])
            pair = [(name, place, 1.0)]
            if name in MIRRORED:
                pair.append((MIRRORED[name], place, -1.0))
            for point, target, side in pair:
                at = row_of()[point]
                if row["rule"] == "free":
                    points[at] = target / 1000
                elif part == "skin":
                    bound[at] = finder.find(row["rule"], target, side)
                else:
                    own = part.replace("left", "right") if side < 0 else part
                    bound[at] = starts[own] + found[point]
    return points, bound


class Finder:
    """Vertices of the skin by where they are."""

    def __init__(self, surface: Refined, where: sculpt.Marks) -> None:
        self.vertices = surface.vertices
        self.eye, self.mouth = carried(surface, where.eye), carried(surface, where.mouth)
        self.lip = surface.blend @ where.lip.astype(np.float64)
        from fba.face.normals import vertex_normals

        self.normals = vertex_normals(surface.vertices, surface.triangles)
        self.outside = np.zeros(len(self.vertices), dtype=bool)
        self.outside[surface.triangles[surface.uvs[surface.corners].mean(axis=1)[:, 0] < 1.0]] = True

    def find(self, rule: str, target: Float64, side: float) -> int:
        """The vertex of a rule of points.csv, on the left (side 1) or right (-1)."""
        places = self.vertices * (side, 1.0, 1.0)
        return int(getattr(self, f"_{rule}")(places, target))

    def _best(self, score: Float64, chosen: npt.NDArray[np.bool_]) -> int:
        return int(np.where(chosen, score, np.inf).argmin())

    def _near(self, places: Float64, target: Float64) -> int:
        face = self.outside & ((self.mouth == sculpt.FAR) | (self.mouth > 2))
        on_midline = np.abs(places[:, 0]) < 1e-6 if target[0] == 0 else np.abs(places[:, 0]) > 1e-6
        return self._best(np.linalg.norm(places - target / 1000, axis=1), face & on_midline)

    def _lip(self, places: Float64, target: Float64) -> int:
        ring = np.abs(self.mouth - sculpt.CONTACT_RING) < 1e-6
        widest = places[ring, 0].max()
        lips = ring & (self.lip * target[1] > 0) if target[1] else ring
        return self._best(np.abs(places[:, 0] - target[0] * widest), lips)

    def _lid(self, places: Float64, target: Float64) -> int:
        ring = (np.abs(self.eye - sculpt.MARGIN_RING) < 1e-6) & (places[:, 0] > 0)
        if target[0]:
            return self._best(-places[:, 0] * target[0], ring)
        height = places[:, 1] * target[1]
        centre = EYE_CENTRE - ORIGIN
        return self._best(np.abs(places[:, 0] - centre[0]), ring & (height > 0.002))

    def _top(self, places: Float64, target: Float64) -> int:
        return self._best(-places[:, 1], np.abs(places[:, 0]) < 1e-6)

    def _back(self, places: Float64, target: Float64) -> int:
        return self._best(places[:, 2], (np.abs(places[:, 0]) < 1e-6) & (places[:, 1] > -0.03))
