"""A captured motion beside the person who plays it, as a picture; needs no OpenGL.

Triangles are painted from back to front, so it works on every machine, and gives the same picture everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from fba.animation import Animation
from fba.arrays import Float64, UInt8
from fba.capture.comparison import Stick
from fba_player.export._sheet_layout import lay_out
from fba_player.scene.scene import Scene
from fba_player.view._camera import Camera, Subject
from fba_player.view._geometry import transform
from fba_player.view._view import FaceShape, View

TILE = (400, 480)
"""Width and height of one of the two pictures of a frame, in pixels."""
SUPERSAMPLING = 2
"""Everything is painted this many times larger, and then reduced, which smooths edges."""
TEXTURE_SIZE = 128
"""Pixels to which textures are reduced: a triangle has one colour."""
HIDDEN_KINDS = ("teeth", "tongue", "lash", "mouth")
"""Parts of a face that are too small to see, or behind the lips."""
COLOURS = {"l": "#1f77b4", "r": "#d1495b", "": "#4a4e57"}
PALM = "#f2b880"
BACK_OF_HAND = "#8d6b4f"
SOLE = "#b9bec9"
PAPER = "#f4f5f7"
FLOOR = "#dfe2e8"
INK = "#20242c"
FAINT = "#6b7280"
GRADES = {"good": "#2e7d32", "fair": "#a86500", "poor": "#c62828"}
LIGHT = np.array([0.35, 0.75, 0.56])
FILL_SHARE = 0.45
"""Share of the light that reaches surfaces facing away from the lamp."""
YAW = 32.0
PITCH = 7.0
"""Degrees by which the camera looks from the side, and from above."""
FIGURE_MARGIN = 0.16
"""Metres around the figures."""


@dataclass(frozen=True, eq=False)
class Sight:
    """A frame to show: its number and time, and the source as a stick figure.

    title: large text. note: small text below. grade: "good", "fair" or "poor". side: "left" or "right" for a
    camera on that side of the person.
    """

    frame: int
    title: str
    note: str
    grade: str
    side: str
    stick: Stick


def draw_sheet(animation: Animation, sights: Sequence[Sight], headline: str, grade: str) -> UInt8:
    """Return a picture, uint8 (H, W, 3): for every sight the source on the left, the result on the right.

    animation: the result, decoded. headline, grade: of the whole.
    """
    width, height = TILE
    caption = 52
    cell = (2 * width, height + caption)
    layout = lay_out(len(sights), cell, min(len(sights), 2) or 1, space=0, top=44)
    sheet = Image.new("RGB", layout.size, PAPER)
    draw = ImageDraw.Draw(sheet)
    draw.text((14, 10), headline, GRADES[grade], font=_font(20))
    assert animation.body is not None
    frames = [sight.frame for sight in sights]
    chosen = replace(animation.body, values=animation.body.values[frames], mask=animation.body.mask[frames])
    scene = Scene(Animation(Fraction(1), np.arange(max(len(frames), 1)), body=chosen)) if frames else None
    for number, (sight, (x, y)) in enumerate(zip(sights, layout.corners, strict=True)):
        assert scene is not None
        view = scene.view_at(float(number))
        for offset, picture in zip((0, width), _draw_pair(view, sight), strict=True):
            sheet.paste(picture, (x + offset, y + caption))
        draw.text((x + 14, y + 6), sight.title, GRADES[sight.grade], font=_font(16))
        draw.text((x + 14, y + 28), sight.note, FAINT, font=_font(13))
        draw.text((x + 14, y + caption + 6), "source", FAINT, font=_font(13))
        draw.text((x + width + 14, y + caption + 6), "result", FAINT, font=_font(13))
        draw.line([(x + width, y + caption), (x + width, y + caption + height)], FLOOR)
    return np.asarray(sheet)


def _draw_pair(view: View, sight: Sight) -> list[Image.Image]:
    """Return the pictures of the source and of the result, by the same camera."""
    triangles, colours = _person(view)
    corners = np.concatenate([sight.stick.corners, triangles.reshape(-1, 3)])
    camera = _camera(corners, sight)
    source, result = _Canvas(camera), _Canvas(camera)
    source.draw_floor(corners)
    source.draw_stick(sight.stick)
    result.draw_floor(corners)
    result.draw_triangles(triangles, colours)
    result.draw_lines(sight.stick, thin=True)
    return [canvas.picture.resize(TILE, Image.Resampling.LANCZOS) for canvas in (source, result)]


def _camera(corners: Float64, sight: Sight) -> Camera:
    """Return the camera that sees both figures, from ahead of the person and from one side."""
    low, high = np.percentile(corners, [0.5, 99.5], axis=0)
    low[1] = min(low[1], 0.0)
    centre = (low + high) / 2
    half = (high - low) / 2 + FIGURE_MARGIN
    left = _left(sight.stick)
    facing = np.degrees(np.arctan2(-left[2], left[0]))
    across = float(np.hypot(half[0], half[2]))
    subject = Subject(tuple(centre.tolist()), float(half[1]), across, across / 2)
    yaw = (facing + (YAW if sight.side == "left" else -YAW) + 180.0) % 360.0 - 180.0
    return Camera(yaw=float(yaw), pitch=PITCH).fit(subject, TILE[0] / TILE[1])


def _left(stick: Stick) -> Float64:
    """Return the horizontal vector from the middle of the right parts to that of the left parts."""
    sides = np.array(stick.sides)
    if not (sides == "l").any() or not (sides == "r").any():
        return np.array([1.0, 0.0, 0.0])
    # the first bones of each side end at the hips: the clearest ends
    begin = [stick.lines[sides == side][0].mean(axis=0) for side in "lr"]
    vector = begin[0] - begin[1]
    if np.hypot(vector[0], vector[2]) < 1e-3:
        vector = stick.lines[sides == "l"].mean(axis=(0, 1)) - stick.lines[sides == "r"].mean(axis=(0, 1))
    return np.array([vector[0], 0.0, vector[2]])


def _person(view: View) -> tuple[Float64, Float64]:
    """Return the triangles (N, 3, 3) of a view's person, in the world, and their colours (N, 3), linear."""
    triangles, colours = [], []
    for mesh in view.faces:
        if mesh.shape.kind in HIDDEN_KINDS or mesh.shape.across is not None:
            continue
        points = transform(mesh.positions.astype(np.float64), mesh.matrix)
        triangles.append(points[mesh.shape.triangles])
        colours.append(_triangle_colours(mesh.shape))
    return np.concatenate(triangles), np.concatenate(colours)


def _triangle_colours(shape: FaceShape) -> Float64:
    """Return (F, 3), the linear colours of a part's triangles, by its vertices and its texture."""
    colours: Float64 = shape.colours[shape.triangles, :3].mean(axis=1, dtype=np.float64)
    if shape.picture is not None and shape.texcoords is not None:
        pixels = shape.picture.reduced(max(1, max(shape.picture.size) // TEXTURE_SIZE))
        size = np.array(pixels.shape[1::-1])
        at = shape.texcoords[shape.triangles].mean(axis=1) % 1.0 * size
        column, row = np.minimum(at.astype(int), size - 1).T
        colours = colours * (pixels[row, column, :3] / 255) ** 2  # roots of linear light
    return colours


class _Canvas:
    """A picture by a camera, painted larger than it will be."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera
        size = (TILE[0] * SUPERSAMPLING, TILE[1] * SUPERSAMPLING)
        self.picture = Image.new("RGB", size, PAPER)
        self.draw = ImageDraw.Draw(self.picture)

    def project(self, points: Float64) -> tuple[Float64, Float64]:
        """Return pixels (..., 2) and distances (...) of points (..., 3)."""
        seen = transform(points, self.camera.view_matrix())
        away = np.maximum(-seen[..., 2], 1e-3)
        scale = self.picture.height / 2 / np.tan(np.radians(self.camera.field_of_view) / 2)
        pixels = seen[..., :2] / away[..., None] * scale * [1.0, -1.0] + np.array(self.picture.size) / 2
        return pixels, away

    def draw_triangles(self, triangles: Float64, colours: Float64) -> None:
        """Paint triangles that face the camera, from back to front."""
        pixels, away = self.project(triangles)
        one, other = pixels[:, 1] - pixels[:, 0], pixels[:, 2] - pixels[:, 0]
        seen = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0] < 0
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        axes = self.camera.view_matrix()[:3, :3]
        shade = FILL_SHARE + (1 - FILL_SHARE) * np.clip(normals @ axes.T @ LIGHT, 0.0, 1.0)
        shown = (np.clip(colours * shade[:, None], 0.0, 1.0) ** (1 / 2.2) * 255).astype(np.uint8)
        chosen = np.flatnonzero(seen)
        for number in chosen[np.argsort(-away[chosen].mean(axis=1))].tolist():
            self.draw.polygon(pixels[number].ravel().tolist(), fill=tuple(shown[number].tolist()))

    def draw_floor(self, corners: Float64) -> None:
        """Paint the floor at height 0 as lines half a metre apart."""
        middle = np.round(corners.mean(axis=0)[[0, 2]] * 2) / 2
        for step in np.arange(-1.5, 1.51, 0.5):
            for ends in (((step, -1.5), (step, 1.5)), ((-1.5, step), (1.5, step))):
                points = np.array([[middle[0] + x, 0.0, middle[1] + z] for x, z in ends])
                pixels, _ = self.project(points)
                self.draw.line(pixels.ravel().tolist(), FLOOR, SUPERSAMPLING)

    def draw_stick(self, stick: Stick) -> None:
        """Paint a stick figure: areas of palms and soles, bones from back to front."""
        for sole in stick.soles:
            pixels, _ = self.project(sole)
            self.draw.polygon(pixels.ravel().tolist(), fill=SOLE, outline=INK)
        self.draw_lines(stick, thin=False)
        eye = self.camera.eye
        for palm in stick.palms:
            pixels, _ = self.project(palm)
            normal = np.cross(palm[1] - palm[0], palm[3] - palm[0])
            colour = PALM if normal @ (eye - palm.mean(axis=0)) > 0 else BACK_OF_HAND
            self.draw.polygon(pixels.ravel().tolist(), fill=colour, outline=INK)

    def draw_lines(self, stick: Stick, *, thin: bool) -> None:
        pixels, away = self.project(stick.lines)
        width = SUPERSAMPLING if thin else 4 * SUPERSAMPLING
        for number in np.argsort(-away.mean(axis=1)).tolist():
            colour = COLOURS[stick.sides[number]]
            self.draw.line(pixels[number].ravel().tolist(), colour, width, joint="curve")
            if not thin:
                x, y = pixels[number, 1].tolist()
                reach = 2.5 * SUPERSAMPLING
                self.draw.ellipse((x - reach, y - reach, x + reach, y + reach), colour)


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)
