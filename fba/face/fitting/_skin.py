"""The skin of a head from photographs.

The head's texture unrolls it as a cylinder that is cut at the back, the folds of lips, lids and ears opened.
The source (Karpouzis, section 7.4) takes the head itself for a cylinder: a column x of the photograph goes to
r = R atan(x / R). Here the fitted head is known, so that every place of the texture is looked up where the
photograph shows it; the angle about the cylinder's axis only says which photograph is taken.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_dilation, binary_erosion, gaussian_filter

from fba.arrays import Bool, Float32, Float64, Floating, Int32, UInt8
from fba.errors import ModelError
from fba.face import FaceModel
from fba.face.fitting._photographs import Photograph
from fba.face.fitting._side_points import find_head
from fba.face.fitting._views import View
from fba.face.model import Part
from fba.mesh import read_pixels, vertex_normals
from fba.parameters import point_rows
from fba.sampling import smoothstep

SIZE = 2048
"""Width and height of the texture, pixels."""
ROWS = 128
"""Rows of the texture that are made at a time."""
AXIS_SHARE = 0.45
"""Where the cylinder's axis is, from the tip of the nose (0) to the back of the head (1)."""
SECTOR = 42.0
"""Degrees from the front beyond which the profile is taken."""
ALONE = 80.0
"""The same where there is no profile and the built-in skin takes over."""
OVERLAP = 14.0
"""Degrees either side of a sector's end over which two pictures are mixed."""
NECK = 0.012
"""Metres below the line from chin to jaw from which the photographs count; collars are not skin."""
NECK_FADE = 0.015
JAW = 0.03
"""Metres by which this line rises at most towards the back."""
FACING = (0.12, 0.45)
"""Cosines of the angle between skin and camera at which a photograph begins to count, and counts fully."""
HIDDEN_DEPTH = 0.004
"""Metres behind the visible surface from which skin is hidden."""
DEPTH_SIDE = 700
"""Pixels of the longer side of the picture of depths."""
HEAD_EDGE = 2
"""Pixels of that picture within the outline of a head before an even background that are not taken."""
LEAST_ON_HEAD = 0.85
"""Share of the feature points that must be on what is taken for the head."""
TONES = 128
"""Width and height of the grid on which tones are compared."""
HAIR = 0.085
"""Linear luminance of the built-in skin, without its finest detail, below which it is hair."""
STRANDS = 2.5
"""Texels over which that luminance is blurred: bright strands are hair, too."""
BROW_MARGIN = 0.006
"""Metres above the brows, and behind their ends, from which dark places are hair of the skull."""
BALD_EDGE = 6
"""Texels beside the hair of the built-in skin that skin takes the place of, too."""
TONE_RANGE = 1.2
"""Largest difference of tones that is evened, as a natural logarithm."""
REFLECTED = np.float32(0.72)
"""Share of the light that skin reflects when photographs show it at their own brightness."""
QUALITY = 92


@dataclass(frozen=True, eq=False)
class _Surface:
    """The skin as flat arrays: float64 vertices and normals (V, 3), int32 triangles (F, 3), texcoords."""

    vertices: Float64
    normals: Float64
    triangles: Int32
    texcoords: Float64


def paint(
    model: FaceModel, photographs: Sequence[Photograph], views: Sequence[View], *, hair: bool = True
) -> tuple[FaceModel, float]:
    """Return (the model with the skin of the photographs, share of the face's skin that they show).

    The first photograph is the frontal one, a second the profile, which also serves the other side mirrored.
    hair: whether the built-in hair stays where neither shows anything; otherwise skin is where it was.
    """
    part = next((one for one in model.of_kind("skin") if one.texcoords is not None), None)
    if part is None:
        raise ModelError("the head has no skin with texture coordinates to paint")
    vertices = part.vertices.astype(np.float64)
    surface = _Surface(
        vertices,
        vertex_normals(vertices, part.triangles).astype(np.float64),
        part.triangles,
        np.asarray(part.texcoords, dtype=np.float64),
    )
    corner = _triangle_map(surface.texcoords[surface.triangles] * SIZE - 0.5, (SIZE, SIZE))
    own = plain = _own_skin(part, surface, corner)
    skin = np.ones((SIZE, SIZE), dtype=np.float32)
    if not hair:
        own, skin = _without_hair(own, model, surface, corner)
    layers = [_Layer(surface, model, photographs[0], views[0], first=True, alone=len(views) == 1)]
    if len(views) > 1:
        layers.insert(0, _Layer(surface, model, photographs[1], views[1], first=False, alone=False))
    result, shown = own, np.zeros((SIZE, SIZE), dtype=np.float32)
    for layer in layers:
        colour = np.zeros((SIZE, SIZE, 3), dtype=np.float32)
        weight = np.zeros((SIZE, SIZE), dtype=np.float32)
        for rows, places, normals in _texels(surface, corner):
            colour[rows], weight[rows] = layer.look_up(places, normals)
        weight *= skin
        result = _even(result, colour, weight, own)
        result += weight[..., None] * (colour - result)
        shown = np.maximum(shown, weight)
    pixels = np.round(_to_srgb(result) * 255).astype(np.uint8)
    face = _face_texels(model, surface, corner)
    seen = float((shown[face] > 0.5).mean()) if face.any() else 0.0
    parts = []
    for one in model.parts:
        changed = _with_locks(one, plain, result, hair=hair) if one.kind == "hair" else one
        parts.append(_with_texture(one, pixels) if one is part else changed)
    return replace(model, parts=tuple(parts)), seen


class _Layer:
    """What one photograph shows of the skin."""

    def __init__(
        self,
        surface: _Surface,
        model: FaceModel,
        photograph: Photograph,
        view: View,
        *,
        first: bool,
        alone: bool,
    ) -> None:
        self.view, self.first = view, first
        self.scale = photograph.scale
        self.pixels = photograph.pixels
        self.sector = ALONE if alone else SECTOR
        self.side = 1.0 if view.eye[0] >= 0 else -1.0
        front, back = surface.vertices[:, 2].max(), surface.vertices[:, 2].min()
        self.axis = front + AXIS_SHARE * (back - front)
        chin = model.points[[point_rows()["2.1"], point_rows()["2.13"]]]
        self.below = chin[0, 1] - NECK
        self.rise = (chin[1, 1] - chin[0, 1]) / max(chin[0, 2] - chin[1, 2], 1e-3)
        self.chin = chin[0, 2]
        self._depth, self._factor = _depths(model, photograph, view)
        self._head = _find_cover(model, photograph, view, self._depth.shape)

    def look_up(self, places: Float64, normals: Float64) -> tuple[Float32, Float32]:
        """Return linear colours (..., 3) and weights (...) of places on the skin (..., 3)."""
        around = np.degrees(np.arctan2(places[..., 0], places[..., 2] - self.axis))
        # Below the line from chin to jaw there are collars and the shadow of the head.
        jaw = self.below + np.clip((self.chin - places[..., 2]) * self.rise, 0, JAW)
        above = smoothstep((places[..., 1] - jaw) / NECK_FADE)
        edge = (np.abs(around) - self.sector) / OVERLAP
        if self.first:
            return self._project(places, normals, above * (1 - smoothstep((edge + 1) / 2)))
        mirror = np.where(around * self.side < 0, -1.0, 1.0)
        flip = np.stack([mirror, np.ones_like(mirror), np.ones_like(mirror)], axis=-1)
        return self._project(places * flip, normals * flip, above)

    def _project(self, places: Float64, normals: Float64, share: Float64) -> tuple[Float32, Float32]:
        view = self.view
        at = view.project(places)
        height, width = self.pixels.shape[:2]
        x, y = at[..., 0] / self.scale - 0.5, at[..., 1] / self.scale - 0.5
        inside = (x > 0) & (y > 0) & (x < width - 1) & (y < height - 1)
        to_eye = view.eye * view.distance - places
        to_eye /= np.linalg.norm(to_eye, axis=-1, keepdims=True)
        facing = (normals * to_eye).sum(axis=-1)
        low, high = FACING
        grid = at * self._factor
        column = np.clip(grid[..., 0].astype(np.intp), 0, self._depth.shape[1] - 1)
        line = np.clip(grid[..., 1].astype(np.intp), 0, self._depth.shape[0] - 1)
        open_ = view.depth(places) > self._depth[line, column] - HIDDEN_DEPTH
        open_ &= self._head[line, column]
        weight = share * smoothstep((facing - low) / (high - low)) * inside * open_
        return REFLECTED * _to_linear(_bilinear(self.pixels, x, y) / 255), weight.astype(np.float32)


def _bilinear(pixels: UInt8, x: Float64, y: Float64) -> Float32:
    """Return the colours (..., 3) of a picture (H, W, 3) at x and y in pixels, interpolated linearly."""
    height, width = pixels.shape[:2]
    column = np.clip(np.floor(x), 0, width - 2).astype(np.intp)
    line = np.clip(np.floor(y), 0, height - 2).astype(np.intp)
    right = np.clip(x - column, 0, 1).astype(np.float32)[..., None]
    down = np.clip(y - line, 0, 1).astype(np.float32)[..., None]
    upper = pixels[line, column] * (1 - right) + pixels[line, column + 1] * right
    lower = pixels[line + 1, column] * (1 - right) + pixels[line + 1, column + 1] * right
    return np.asarray(upper * (1 - down) + lower * down)


def _depths(model: FaceModel, photograph: Photograph, view: View) -> tuple[Float32, float]:
    """Return the nearest depths (H, W) of the head in a small copy of the picture, and its scale."""
    factor = DEPTH_SIDE / max(photograph.size)
    width, height = (max(round(side * factor), 1) for side in photograph.size)
    vertices = model.vertices.astype(np.float64)
    corners = np.concatenate([part.triangles + model.starts[part.name] for part in model.parts])
    depth = view.depth(vertices)
    order = np.argsort(depth[corners].mean(axis=1), kind="stable")  # far ones first: near ones cover them
    corners = corners[order]
    numbers = _triangle_map(view.project(vertices)[corners] * factor - 0.5, (height, width))
    result = np.full((height, width), -np.inf, dtype=np.float32)
    known = numbers >= 0
    result[known] = depth[corners].min(axis=1)[numbers[known]]
    return result, factor


def _find_cover(model: FaceModel, photograph: Photograph, view: View, shape: tuple[int, int]) -> Bool:
    """Return the mask (H, W) of the head in a small copy of the picture; all where the background is uneven.

    A fitted head is never exactly as wide as the person, and what is beside that is no skin.
    """
    pixels = photograph.pixels
    rows, columns = (np.arange(most) * size // most for most, size in zip(shape, pixels.shape, strict=False))
    try:
        head = find_head(pixels[rows[:, None], columns], photograph.name)
    except ModelError:
        return np.ones(shape, dtype=bool)
    head = binary_erosion(head, iterations=HEAD_EDGE)
    bound = model.bound[model.bound >= 0]
    at = view.project(model.vertices[bound].astype(np.float64)) / photograph.size * shape[::-1]
    column, row = np.clip(at.astype(np.intp), 0, np.array(shape[::-1]) - 1).T
    on_head = binary_dilation(head, iterations=3 * HEAD_EDGE)[row, column]
    return head if on_head.mean() >= LEAST_ON_HEAD else np.ones(shape, dtype=bool)


def _triangle_map(corners: Float64, shape: tuple[int, int]) -> Int32:
    """Return int32 (H, W): the number of the triangle drawn last on each pixel, -1 for none.

    corners: (F, 3, 2), x and y in pixels, 0 in the middle of the first.
    """
    from PIL import Image, ImageDraw

    image = Image.new("I", (shape[1], shape[0]), -1)
    pen = ImageDraw.Draw(image)
    for number, places in enumerate(np.clip(corners, -1e5, 1e5).reshape(len(corners), 6).tolist()):
        pen.polygon(places, fill=number, outline=number)
    return np.array(image, dtype=np.int32)


def _texels(surface: _Surface, corner: Int32) -> Iterator[tuple[slice, Float64, Float64]]:
    """Yield rows of the texture with the places and normals of its texels on the skin, each (R, W, 3)."""
    for rows, triangles, shares in _corners_of_texels(surface, corner):
        places = np.einsum("rck,rckd->rcd", shares, surface.vertices[triangles])
        normals = np.einsum("rck,rckd->rcd", shares, surface.normals[triangles])
        normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
        normals[corner[rows] < 0] = 0.0
        yield rows, places, normals


def _corners_of_texels(surface: _Surface, corner: Int32) -> Iterator[tuple[slice, Int32, Float64]]:
    """Yield rows of the texture with the vertices around each texel and their shares, each (R, W, 3)."""
    texcoords = surface.texcoords * SIZE - 0.5
    for start in range(0, SIZE, ROWS):
        rows = slice(start, start + ROWS)
        triangles = surface.triangles[np.maximum(corner[rows], 0)]
        y, x = np.mgrid[start : start + ROWS, 0:SIZE].astype(np.float64)
        yield rows, triangles, _shares(texcoords[triangles], np.stack([x, y], axis=-1))


def _shares(corners: Float64, at: Float64) -> Float64:
    """Return the shares (..., 3) of triangles' corners (..., 3, 2) at points (..., 2), each 0 to 1."""
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    first, second, here = b - a, c - a, at - a
    area = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    area = np.where(np.abs(area) < 1e-12, 1e-12, area)
    v = (here[..., 0] * second[..., 1] - here[..., 1] * second[..., 0]) / area
    w = (first[..., 0] * here[..., 1] - first[..., 1] * here[..., 0]) / area
    shares = np.clip(np.stack([1 - v - w, v, w], axis=-1), 0.0, 1.0)
    return np.asarray(shares / np.maximum(shares.sum(axis=-1, keepdims=True), 1e-12))


def _own_skin(part: Part, surface: _Surface, corner: Int32) -> Float32:
    """Return the head's own skin, linear light, float32 (SIZE, SIZE, 3), its vertices' colours in it."""
    pixels = read_pixels(part.material.texture or b"")
    if pixels is None:
        plain = np.ones((SIZE, SIZE, 3), dtype=np.float32) * np.array(part.material.colour, dtype=np.float32)
    else:
        from PIL import Image

        image = Image.fromarray(pixels[..., :3]).resize((SIZE, SIZE))
        plain = _to_linear(np.asarray(image, dtype=np.float32) / 255)
    if part.colours is not None:
        for rows, triangles, shares in _corners_of_texels(surface, corner):
            plain[rows] *= np.einsum("rck,rckd->rcd", shares, part.colours[triangles, :3])
    return plain


def _without_hair(
    own: Float32, model: FaceModel, surface: _Surface, corner: Int32
) -> tuple[Float32, Float32]:
    """Return the head's own skin with the tone of the skin nearby where hair of the skull was, and where not.

    The second, (SIZE, SIZE), is 0 where hair was: photographs may show there what is behind the head.
    """
    brows = float(model.points[[point_rows()["4.3"], point_rows()["4.4"]], 1].max())
    temples = float(model.points[[point_rows()["4.5"], point_rows()["4.6"]], 2].min())
    middle = surface.vertices[surface.triangles].mean(axis=1)
    skull = (middle[:, 1] > brows + BROW_MARGIN) | (middle[:, 2] < temples - BROW_MARGIN)
    dark = _is_hair(own)
    gone = dark & skull[np.maximum(corner, 0)] & (corner >= 0)
    gone = binary_dilation(gone, iterations=BALD_EDGE)
    known = (~gone & ~dark & (corner >= 0)).astype(np.float32)
    share = _shrink(known)
    tones = [
        _spread(_shrink(own[..., channel] * known) / np.maximum(share, 1e-6), share) for channel in range(3)
    ]
    weight = gaussian_filter(gone.astype(np.float32), BALD_EDGE / 2)[..., None]
    bald = own + weight * (_grow(np.stack(tones, axis=-1)) - own)
    return bald.astype(np.float32), 1 - weight[..., 0]


def _is_hair(own: Float32) -> Bool:
    """Return the mask (SIZE, SIZE) of texels of the head's own skin that are dark as hair."""
    return np.asarray(
        gaussian_filter(own @ np.array([0.2126, 0.7152, 0.0722], dtype=np.float32), STRANDS) < HAIR
    )


def _with_locks(part: Part, own: Float32, shown: Float32, *, hair: bool) -> Part:
    """Return a part of single hairs in the tone that the hair painted on the skin has got, or invisible."""
    if part.colours is None or not hair:
        return replace(part, material=replace(part.material, alpha="blend", opacity=0.0))
    where = _is_hair(own)
    tint = shown[where].mean(axis=0) / np.maximum(own[where].mean(axis=0), 1e-4) if where.any() else 1.0
    colours = part.colours.copy()
    colours[:, :3] = np.clip(colours[:, :3] * tint, 0.0, 1.0)
    return replace(part, colours=colours)


def _even(below: Float32, above: Float32, weight: Float32, own: Float32) -> Float32:
    """Return the picture below in the tone of the one above, so that no seam shows where they meet.

    The ratio of their tones, known where both are, goes on smoothly elsewhere; of skin and hair for each.
    """
    hair = _is_hair(own)
    result = below.copy()
    for kind in (hair, ~hair):
        share = _shrink(weight * kind)
        if share.max() < 1e-3:
            continue
        field = np.zeros((TONES, TONES, 3))
        for channel in range(3):
            with np.errstate(divide="ignore"):
                tones = [
                    np.log(
                        np.maximum(_shrink(one[..., channel] * weight * kind) / np.maximum(share, 1e-6), 1e-4)
                    )
                    for one in (above, below)
                ]
            ratio = np.clip(tones[0] - tones[1], -TONE_RANGE, TONE_RANGE)
            field[..., channel] = _spread(ratio, share)
        grown = np.exp(_grow(field)).astype(np.float32)
        result[kind] *= grown[kind]
    return result


def _shrink(values: Float32) -> Float64:
    """Return the means (TONES, TONES) of the blocks of a picture (SIZE, SIZE)."""
    block = SIZE // TONES
    return np.asarray(values.reshape(TONES, block, TONES, block).mean(axis=(1, 3), dtype=np.float64))


def _spread(values: Float64, weight: Float64) -> Float64:
    """Return values (N, N) known by weight, spread smoothly to where the weight is 0."""
    result, done = np.zeros_like(values), np.zeros_like(values)
    for sigma in (1.5, 3.0, 6.0, 12.0, 24.0, 48.0):
        here = gaussian_filter(weight, sigma)
        share = np.clip(here / 0.05, 0, 1) * (1 - done)
        result += share * gaussian_filter(values * weight, sigma) / np.maximum(here, 1e-9)
        done += share
    mean = float((values * weight).sum() / weight.sum())
    return np.asarray(gaussian_filter(result + (1 - done) * mean, 1.0))


def _grow(field: Float64) -> Float64:
    """Return a field (TONES, TONES, 3) at the size of the texture, interpolated linearly."""
    at = (np.arange(SIZE) + 0.5) * TONES / SIZE - 0.5
    low = np.clip(np.floor(at).astype(np.intp), 0, TONES - 2)
    share = np.clip(at - low, 0, 1)
    rows: Float64 = field[low] * (1 - share)[:, None, None] + field[low + 1] * share[:, None, None]
    return rows[:, low] * (1 - share)[None, :, None] + rows[:, low + 1] * share[None, :, None]


def _face_texels(model: FaceModel, surface: _Surface, corner: Int32) -> Bool:
    """Return the mask (SIZE, SIZE) of the texels between hairline, ears and chin."""

    def at(name: str) -> Float64:
        return np.asarray(model.points[point_rows()[name]])

    middle = surface.vertices[surface.triangles].mean(axis=1)
    face = (middle[:, 1] < at("11.1")[1]) & (middle[:, 1] > at("2.1")[1]) & (middle[:, 2] > at("10.7")[2])
    outward = surface.normals[surface.triangles].mean(axis=1)[:, 2] > -0.2
    return np.asarray((face & outward)[np.maximum(corner, 0)] & (corner >= 0))


def _with_texture(part: Part, pixels: UInt8) -> Part:
    """Return the part with a picture as its skin, and no colour of its own."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=QUALITY)
    colours = None if part.colours is None else part.colours.copy()
    if colours is not None:
        colours[:, :3] = 1.0
    return replace(
        part,
        colours=colours,
        material=replace(part.material, colour=(1.0, 1.0, 1.0), texture=file.getvalue()),
    )


def _to_linear(values: Floating) -> Float32:
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _to_srgb(values: Float32) -> Float32:
    values = np.clip(values, 0, 1)
    return np.where(values <= 0.0031308, values * 12.92, 1.055 * values ** (1 / 2.4) - 0.055).astype(
        np.float32
    )
