"""A face model as the player shows it: FAPs in; meshes, eyes and feature points out."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fba.errors import FbaWarning
from fba.face.deformer import Deformer
from fba.face.model import FaceModel, Part, point_row
from player.camera import Subject
from player.eyeball import Eyeball, find_eyeball
from player.shapes import Eye, FaceMesh, FaceShape, rotation_vector
from player.visibility import Visibility, bake

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]

KEY_DIRECTION, RIM_DIRECTION = ((0.70, 0.68, 0.80), (-0.55, 0.50, -0.85))
"""As in shaders/lighting.glsl."""
SCATTER = {"skin": 1.0, "tongue": 0.8, "mouth": 0.8, "teeth": 0.5, "eye": 0.3}
TWO_SIDED = ("brow", "lash", "hair", "other", "teeth", "tongue")
LARGEST_PICTURE = 4096
"""Textures of more pixels across are made smaller."""
MOUTH_OPEN = {3: 700, 4: -250, 8: -200, 9: -200, 5: -900, 10: -700, 11: -700,
              51: -250, 55: -200, 56: -200, 52: -900, 57: -700, 58: -700}  # fmt: skip
"""FAPs of a mouth open so far that light falls in."""
ROUGH = 0.36
RELIEF = 0.022
"""Strength of the skin's relief, and metres until it repeats."""
NECK = 2.3
"""Length over which a neck bends, in distances from eyes to nose (ENS)."""
FREE = (0.9, 0.8, 0.0, 0.3)
"""The light that reaches a tongue put out."""
CUT = 0.45
"""On a body, what sways less than this is left out: the body has a neck of its own."""


@dataclass(frozen=True, eq=False)
class Pose:
    """The face for one set of FAPs: positions and normals float32 (V, 3), without the head's turn (4, 4)."""

    faps: Float32
    positions: Float32
    normals: Float32
    turn: Float64


class FaceFigure:
    """A face model ready to be shown.

    model: any face. The light that reaches its vertices is worked out on first use, in about a second.
    """

    def __init__(self, model: FaceModel) -> None:
        self.model = model
        self.deformer = Deformer(model)
        self._pose: Pose | None = None
        self._ranges = {
            part.name: slice(model.starts[part.name], model.starts[part.name] + len(part.vertices))
            for part in model.parts
        }
        self._eyeballs: list[tuple[Part, Eyeball]] = []
        self._shapes: dict[str, FaceShape] = {}
        self._sway = sways = sway(model)
        for part in model.parts:
            ball = find_eyeball(part, model) if part.kind == "eye" else None
            if ball is None:
                self._shapes[part.name] = _shape(part, sways[self._ranges[part.name]])
            else:
                self._eyeballs.append((part, ball))
        self._cut: dict[str, FaceShape] = {}
        self._centre = _head_centre(model)
        self._visibility: tuple[Visibility, Visibility] | None = None
        self._lit: tuple[tuple[float, ...], Float32] | None = None
        lips = [int(model.bound[point_row(name)]) for name in ("2.2", "2.3")]
        self._lips = lips if min(lips) >= 0 else None
        self._tongues = [part.name for part in model.of_kind("tongue")]

    @cached_property
    def between_eyes(self) -> Float64:
        """(3,) the point between the pupils, metres, in the frame of the model."""
        eyes = [self.model.points[point_row(name)] for name in ("3.5", "3.6")]
        middle: Float64 = np.mean(eyes, axis=0)
        return middle

    @cached_property
    def subject(self) -> Subject:
        """What a camera is to have in view: the head from its top to the upper chest."""
        model = self.model
        head = np.concatenate([part.vertices for part in model.of_kind("skin") or model.parts])
        chin = _known(model, ("2.10", "2.1"))
        tall = model.fapu.ENS * 1024 * 5.2
        top = float(head[:, 1].max())
        low = float(chin[1]) if chin is not None else top - tall
        if not 0.5 * tall < top - low < 2 * tall:  # hair, a hat, or a body below
            top = low + tall
        x, _, z = self.between_eyes
        centre = (float(x), (top + low) / 2 - 0.07 * (top - low), float(z) - 0.3 * (top - low))
        return Subject(centre, 0.71 * (top - low), 0.60 * (top - low))

    def pose(self, faps: Float32) -> Pose:
        """The face for FAPs (68,)."""
        if self._pose is None or not np.array_equal(self._pose.faps, faps):
            positions = np.empty((len(self.model.vertices), 3), dtype=np.float32)
            normals = np.empty_like(positions)
            self.deformer.local(faps, out=positions, normals=normals)
            self._pose = Pose(faps.copy(), positions, normals, self.deformer.head_matrices(faps))
        return self._pose

    def meshes(
        self, faps: Float32, matrix: Float64, *, on_body: bool = False, without: Sequence[str] = ()
    ) -> list[FaceMesh]:
        """The parts for FAPs (68,), put into the world by matrix (4, 4).

        on_body: without the lower neck and shoulders. without: kinds of parts that are left out.
        """
        pose = self.pose(faps)
        light = self._light(pose, matrix)
        axis = rotation_vector(pose.turn[:3, :3])
        found = []
        for name, shape in (self._on_body() if on_body else self._shapes).items():
            if self.model.part(name).kind in without:
                continue
            rows = self._ranges[name]
            arrays = pose.positions[rows], pose.normals[rows], light[rows]
            found.append(FaceMesh(shape, *arrays, matrix, axis, self._centre))
        return found

    def eyes(self, faps: Float32, matrix: Float64) -> list[Eye]:
        """The eyeballs for FAPs (68,), put into the world by matrix (4, 4)."""
        pose = self.pose(faps)
        placed = matrix @ pose.turn
        return [
            ball.posed(pose.positions[self._ranges[part.name]], pose.positions, faps, placed)
            for part, ball in self._eyeballs
        ]

    def points(self, faps: Float32, matrix: Float64) -> Float64:
        """(84, 3) feature points for FAPs (68,) in the world; NaN where the face has none."""
        places = self.deformer.feature_points(faps)
        moved: Float64 = places @ matrix[:3, :3].T + matrix[:3, 3]
        return moved

    def _on_body(self) -> dict[str, FaceShape]:
        if not self._cut:
            for name, shape in self._shapes.items():
                kept = (shape.sway[shape.triangles] > CUT).all(axis=1)
                if kept.any():
                    self._cut[name] = replace(shape, triangles=np.ascontiguousarray(shape.triangles[kept]))
        return self._cut

    def _light(self, pose: Pose, matrix: Float64) -> Float32:
        """(V, 4) what reaches each vertex, blended between mouth shut and open."""
        if self._visibility is None:
            self._visibility = self._baked()
        share = self._mouth_open(pose.positions)
        into = (matrix[:3, :3] @ pose.turn[:3, :3]).T
        out = {name: self._out_of_mouth(name, pose.positions) for name in self._tongues}
        key = (*np.round(into.ravel(), 3), round(share, 2), *(float(o.sum()) for o in out.values()))
        if self._lit is None or self._lit[0] != key:
            shut, wide = (_reaching(each, into) for each in self._visibility)
            light = (shut + (wide - shut) * np.float32(share)).astype(np.float32)
            for name, outside in out.items():
                rows = self._ranges[name]
                light[rows] += (np.array(FREE, dtype=np.float32) - light[rows]) * outside[:, None]
            self._lit = (key, light)
        return self._lit[1]

    def _out_of_mouth(self, name: str, positions: Float32) -> Float32:
        """(V,) how far the vertices of a tongue are out between the lips, 0..1."""
        if self._lips is None:
            return np.zeros(len(self.model.part(name).vertices), dtype=np.float32)
        lips = positions[self._lips, 2].min()
        reach = 0.2 * self.model.fapu.ENS * 1024
        share: Float32 = np.clip((positions[self._ranges[name], 2] - lips + reach) / reach, 0.0, 1.0)
        return share.astype(np.float32)

    def _mouth_open(self, positions: Float32) -> float:
        if self._lips is None:
            return 0.0
        upper, lower = self._lips
        gap = float(np.linalg.norm(positions[upper] - positions[lower]))
        share = np.clip((gap - self._gaps[0]) / max(self._gaps[1] - self._gaps[0], 1e-6), 0.0, 1.0)
        return float(np.sqrt(share))  # the first millimetres let most of the light in

    def _baked(self) -> tuple[Visibility, Visibility]:
        """What reaches the vertices with the mouth shut, and open."""
        solid = [part for part in self.model.parts if part.kind not in ("brow", "lash")]
        joined = [part.triangles + self.model.starts[part.name] for part in solid]
        triangles = np.ascontiguousarray(np.concatenate(joined), dtype=np.int32)
        pose = self.pose(np.zeros(68, dtype=np.float32))
        shut = bake(pose.positions, pose.normals, triangles, self._sway > 0.05)
        self._gaps = [0.0, 0.0]
        if self._lips is None:
            return shut, shut
        faps = np.zeros(68, dtype=np.float32)
        for fap, value in MOUTH_OPEN.items():
            faps[fap - 1] = value
        moved = self.pose(faps)
        for number, positions in enumerate((pose.positions, moved.positions)):
            upper, lower = positions[self._lips]
            self._gaps[number] = float(np.linalg.norm(upper - lower))
        near = self._near_mouth(pose.positions)
        wide = bake(moved.positions, moved.normals, triangles, near)
        arrays = []
        for before, after in zip(shut.arrays, wide.arrays, strict=True):
            arrays.append(np.where(near[:, None] if before.ndim == 2 else near, after, before))
        return shut, Visibility(*arrays)

    def _near_mouth(self, positions: Float32) -> npt.NDArray[np.bool_]:
        """(V,) vertices within half the height of the lower face of the mouth."""
        assert self._lips is not None
        away = np.linalg.norm(positions - positions[self._lips].mean(axis=0), axis=1)
        return np.asarray(away < 1.1 * self.model.fapu.ENS * 1024)


def sway(model: FaceModel) -> Float32:
    """(V,) how far each vertex goes with the head: 1 above jaw and ears, falling to 0 along the neck."""
    chin = _known(model, ("2.1", "2.10"))
    lobe = _known(model, ("10.7", "10.8", "10.5", "10.6", "7.1"))
    if chin is None or lobe is None:
        return np.ones(len(model.vertices), dtype=np.float32)
    reach = NECK * model.fapu.ENS * 1024
    y, z = model.vertices[:, 1].astype(np.float64), model.vertices[:, 2].astype(np.float64)
    # The border between head and neck rises from below the chin to below the ears, and stays level behind.
    along = np.clip((z - lobe[2]) / max(chin[2] - lobe[2], 1e-6), 0.0, 1.0)
    border = lobe[1] + (chin[1] - 0.12 * reach - lobe[1]) * along
    share = np.clip(1 - (border - y) / reach, 0.0, 1.0)
    smooth: Float32 = (share * share * (3 - 2 * share)).astype(np.float32)
    return smooth


def _known(model: FaceModel, names: Sequence[str]) -> Float64 | None:
    """Middle of the first two of those feature points that the face has, or None."""
    places = np.array([model.points[point_row(name)] for name in names])
    known = places[np.isfinite(places).all(axis=1)][:2]
    return np.asarray(known.mean(axis=0)) if len(known) else None


def _head_centre(model: FaceModel) -> Float64:
    """The point that the head turns about, as its tables say."""
    for number in (48, 49, 50):
        table = model.table_of.get(number)
        for transform in table.transforms if table is not None else ():
            if transform.kind == "rotation":
                return np.array(transform.centre)
    return np.zeros(3)


def _reaching(visibility: Visibility, into: Float64) -> Float32:
    key = visibility.towards(_unit(into @ KEY_DIRECTION))[0]
    rim, through = visibility.towards(_unit(into @ RIM_DIRECTION))
    return np.stack([key, visibility.open, through, rim], axis=1)


def _unit(vector: Float64) -> Float64:
    unit: Float64 = vector / np.linalg.norm(vector)
    return unit


def _shape(part: Part, sways: Float32) -> FaceShape:
    colours = part.colours
    if colours is None:
        row = (*part.material.colour, 1.0 - part.material.roughness)
        colours = np.tile(np.array(row, dtype=np.float32), (len(part.vertices), 1))
    picture = _picture(part) if part.texcoords is not None else None
    return FaceShape(
        part.triangles,
        colours,
        sways if part.kind in ("skin", "hair", "other") else np.ones_like(sways),
        part.texcoords,
        picture,
        SCATTER.get(part.kind, 0.0),
        _relief(part),
        part.kind in TWO_SIDED,
    )


def _relief(part: Part) -> tuple[float, float]:
    """Strength of the skin's relief and its repeats, so that a repeat is `RELIEF` metres wide."""
    if part.kind != "skin" or part.texcoords is None or not len(part.triangles):
        return (0.0, 1.0)
    corners, flat = part.vertices[part.triangles], part.texcoords[part.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    spread = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    laid = spread > 1e-9
    if not laid.any():
        return (0.0, 1.0)
    metres = float(np.sqrt(np.median(area[laid] / spread[laid])))  # across the whole picture
    return (ROUGH, min(metres / RELIEF, 200.0))


def _picture(part: Part) -> npt.NDArray[np.uint8] | None:
    """(H, W, 4) the part's texture, or None where there is none that can be read."""
    if part.material.texture is None:
        return None
    from PIL import Image

    try:
        with Image.open(io.BytesIO(part.material.texture), formats=("PNG", "JPEG")) as image:
            if max(image.size) > LARGEST_PICTURE:
                image.draft("RGB", (LARGEST_PICTURE, LARGEST_PICTURE))
                image.thumbnail((LARGEST_PICTURE, LARGEST_PICTURE))
            return np.asarray(image.convert("RGBA"))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        warnings.warn(
            f"the texture of part {part.name!r} cannot be read ({error}): its colour is shown instead",
            FbaWarning,
            stacklevel=2,
        )
        return None
