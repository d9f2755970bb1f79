"""Pictures of faces with known feature points: the built-in head, its shape, colours and light varied."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

import numpy as np
from PIL import Image, ImageDraw
from scipy.ndimage import gaussian_filter, maximum_filter

from fba import Animation, FaceTrack, player
from fba.arrays import Float64, UInt8
from fba.emotion import expressions
from fba.errors import FbaError, FbaWarning
from fba.face import Deformer, FaceModel
from fba.face.calibration import fit
from fba.face.fitting._points_file import HIDDEN
from fba.face.fitting._views import face_covariance
from fba.face.model import Part
from fba.mesh import read_pixels
from fba.parameters import fap_numbers, point_rows

SIZE = (320, 380)
VIEWS = 6
"""Pictures of each head."""
HAIRY, BEARDED, FRINGED = 0.6, 0.3, 0.2
"""Shares of the pictures in which hair (the built-in head has no mesh of it), beard or fringe is painted."""
OTHER_BROWS = 0.6
"""Share of the heads whose brows are painted on each picture, in another shape, place and colour."""
MOVED = 0.45
"""Share of the pictures with a smile, which a mouth that is a little open often goes with."""
DISTANCE = 1.5
SKIN_RANGE = (0.25, 1.25)
"""Factors on the brightness of the built-in skin, from dark to pale."""
INNER = (*HIDDEN, "11.1", "11.2", "11.3", "11.4", "11.6")
"""Points that are not varied: inside, or on the skull."""
HAIR = 120
"""Red of the built-in skin's picture below which it is hair."""
STRANDS = 3.0
"""Pixels over which that is blurred: bright strands are hair, too."""
AROUND_BROWS = (35, 101)
"""Height and width, pixels, of what goes with each dark pixel of a brow: its tips are thin and pale."""


def rendered_faces(count: int, seed: int) -> Iterator[tuple[UInt8, Float64]]:
    """Yield pictures uint8 (H, W, 3) of each head, and the places (84, 2) of its feature points, pixels."""
    for number in range(count):
        random = np.random.default_rng((seed, number))
        head, brows = None, random.random() >= OTHER_BROWS
        while head is None:
            head = varied_head(random, brows=brows)
        # The tables move a head of another shape about as far, which is good enough for a picture.
        for pixels, true in _photographed(replace(head, tables=FaceModel.default().tables), random):
            face = pixels.astype(np.float64)
            places = true if brows else _paint_brows(face, true, random)
            yield _exposed(_with_surroundings(face, places, random), random), places


def varied_head(random: np.random.Generator, *, brows: bool = True) -> FaceModel | None:
    """Return the built-in head in another shape and other colours; None if the shape is impossible.

    brows: whether it keeps those of its skin.
    """
    base = FaceModel.default()
    outer = [row for name, row in point_rows().items() if name not in INNER]
    points = np.full_like(base.points, np.nan)
    shift = random.multivariate_normal(
        np.zeros(3 * len(outer)), face_covariance(base.points[outer]), method="cholesky"
    )
    points[outer] = base.points[outer] + shift.reshape(-1, 3)
    try:
        with warnings.catch_warnings(action="ignore", category=FbaWarning):
            head = fit(replace(base, tables=()), points, unit="m")
    except FbaError:
        return None
    parts = {part.name: part for part in head.parts}
    for part in head.parts:
        if part.kind == "skin":
            parts[part.name] = _coloured(part, random, brows)
        elif part.kind == "hair" and part.colours is not None:  # locks have the colours of other hair
            parts[part.name] = replace(part, colours=part.colours * np.float32([1, 1, 1, 0]))
    return replace(head, parts=tuple(parts.values()))


def _coloured(part: Part, random: np.random.Generator, with_brows: bool) -> Part:
    """Return the skin with other colours: of the skin, the lips' strength, the hair, or without any hair."""
    pixels = read_pixels(part.material.texture or b"", 1024)
    assert pixels is not None
    picture = pixels[..., :3].astype(np.float64)
    hair = gaussian_filter(picture[..., 0], STRANDS) < HAIR
    low, high = SKIN_RANGE
    tone = random.uniform(low, high) * (1 + 0.12 * random.standard_normal(3) * (0.3, 0.6, 1.0))
    mean = picture[~hair].mean(axis=0)
    skin = mean + (picture - mean) * random.uniform(0.4, 1.3)
    shade = random.uniform(0.2, 2.0) * (1 + 0.15 * random.standard_normal(3))
    bald = random.random() < 0.3
    upper = np.arange(len(picture))[:, None] < 0.22 * len(picture)
    brows = hair & ~upper
    brows &= np.abs(np.arange(picture.shape[1]) / picture.shape[1] - 0.5)[None, :] < 0.2
    strength = random.uniform(0.3, 1.0)
    result = skin * tone
    painted = picture * shade
    result[hair & ~brows] = (mean * tone) if bald else painted[hair & ~brows]
    if with_brows:
        result[brows] = strength * painted[brows] + (1 - strength) * (mean * tone)
    else:
        gone = gaussian_filter(maximum_filter(brows, AROUND_BROWS).astype(np.float64), 3)[..., None]
        result += gone * (mean * tone - result)
    file = io.BytesIO()
    Image.fromarray(np.clip(result, 0, 255).astype(np.uint8)).save(file, "JPEG", quality=90)
    return replace(part, material=replace(part.material, texture=file.getvalue()))


def _photographed(head: FaceModel, random: np.random.Generator) -> Iterator[tuple[UInt8, Float64]]:
    """Yield pictures (H, W, 4) of a head from several sides, in other light and with other faces."""
    scene = player.Scene(Animation(Fraction(25), np.arange(1), FaceTrack.empty(1)), model=head)
    scene.show("background", "transparent")
    deform, row = Deformer(head), point_rows()
    friendly = [one.faps for one in expressions() if one.family == "joy"]
    with player.Offscreen(scene, SIZE, samples=2) as view:
        for _ in range(VIEWS):
            faps = friendly[int(random.integers(len(friendly)))] * 0.0
            if random.random() < MOVED:
                faps = friendly[int(random.integers(len(friendly)))] * random.random()
                faps[fap_numbers()["open_jaw"] - 1] += random.choice([0.0, 200.0 * random.random()])
            light, nod = random.uniform(-80, 80), random.uniform(-20, 20)
            faps[fap_numbers()["head_yaw"] - 1] = np.radians(light) * 1e5
            faps[fap_numbers()["head_pitch"] - 1] = np.radians(nod) * 1e5
            points = deform.feature_points(faps)
            middle = points[[row[name] for name in ("3.5", "3.6", "9.3")]].mean(axis=0)
            x, y, z = middle + np.append(random.uniform(-0.03, 0.03, 2), 0)
            view.camera = player.Camera(
                target=(float(x), float(y), float(z)), yaw=light + random.uniform(-15, 15),
                pitch=random.uniform(-15, 15) - nod, distance=DISTANCE,
                field_of_view=2 * float(np.degrees(np.arctan(random.uniform(0.14, 0.2) / DISTANCE))),
            )  # fmt: skip
            clip = np.column_stack([points, np.ones(len(points))]) @ view.camera.clip_matrix(SIZE).T
            places = (clip[:, :2] / clip[:, 3:] * (0.5, -0.5) + 0.5) * SIZE
            yield view.still(faps), places


def _paint_brows(face: Float64, places: Float64, random: np.random.Generator) -> Float64:
    """Paint brows of any shape on a picture (H, W, 4) of a head without; return places (84, 2) with theirs.

    As on the built-in head, the inner point is the upper corner, the middle one the highest, the outer one
    the tip.
    """
    row, finer = point_rows(), 4
    eyes = float(np.linalg.norm(places[row["3.5"]] - places[row["3.6"]]))
    down = np.array([0.0, eyes])
    wide = random.uniform(0.06, 0.22) * eyes
    moves = random.normal(0, (0.06, 0.04, 0.05, 0.05))  # of all, of each point more
    colour = random.uniform(0, 1.0) ** 2 * 170 * (1 + 0.2 * random.standard_normal(3))
    strength, blur = random.uniform(0.4, 1.0), random.uniform(0.4, 1.6)
    grain = np.clip(1 + random.uniform(0, 0.5) * _cloud(random, 1.0), 0, 1.2)
    result = places.copy()
    for names in (("4.1", "4.3", "4.5"), ("4.2", "4.4", "4.6")):
        rows = [row[name] for name in names]
        own = random.normal(0, 0.015, (3, 2)) * eyes
        inner, top, tip = places[rows] + (moves[0] + moves[1:, None]) * down + own
        along = np.linspace(0, 1, 24)[:, None]
        shift = random.uniform(0.4, 0.65)  # where along the brow it is highest
        bend = inner + (tip - inner) * shift
        top = np.array([bend[0], min(top[1], inner[1] - 0.01 * eyes, tip[1] - 0.01 * eyes)])
        lift = top - bend
        # a curve through inner end and tip that is highest at `top`: a parabola on each side of it
        side = np.where(along < shift, (along - shift) / shift, (along - shift) / (1 - shift))
        upper = inner + (tip - inner) * along + lift * (1 - side**2)
        lower = upper + np.array([0.0, 1.0]) * wide * np.clip(3.0 * (1 - along) ** 0.8, 0, 1)
        lower[0] -= np.array([(tip - inner)[0] * random.uniform(0, 0.08), 0.0])
        image = Image.new("L", (SIZE[0] * finer, SIZE[1] * finer))
        outline = np.concatenate([upper, lower[::-1]]) * finer
        ImageDraw.Draw(image).polygon([tuple(one) for one in outline.tolist()], fill=255)
        shape = np.asarray(image.resize(SIZE, Image.Resampling.BOX)) / 255.0
        shape = strength * gaussian_filter(shape, blur) * grain
        face[..., :3] += shape[..., None] * (colour - face[..., :3])
        result[rows] = inner, upper[int(upper[:, 1].argmin())], tip
    return result


def _with_surroundings(pixels: Float64, places: Float64, random: np.random.Generator) -> Float64:
    """Return a picture (H, W, 4) with something behind the head, often hair or a beard, too: (H, W, 3)."""
    row = point_rows()
    opaque = pixels[..., 3:] / 255.0
    face = pixels[..., :3].copy()
    across, down = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    right, left, chin, mouth = (places[row[name]] for name in ("3.6", "3.5", "2.1", "2.2"))
    middle, eyes = (left + right) / 2, float(np.linalg.norm(left - right))
    if random.random() < BEARDED:
        soft = random.uniform(0.7, 5)
        low = 1 / (1 + np.exp(-(down - (mouth[1] - 0.35 * eyes) - _cloud(random, 40) * 0.1 * eyes) / soft))
        wide, tall = random.uniform(0.38, 0.5) * eyes, random.uniform(0.16, 0.25) * eyes
        lips = np.exp(-(((across - mouth[0]) / wide) ** 4) - ((down - mouth[1]) / tall) ** 4)
        face *= 1 - (random.uniform(0.2, 0.8) * low * (1 - lips))[..., None]
    result = _backdrop(random) * (1 - opaque) + face * opaque
    if random.random() < HAIRY:  # what lies outside of an egg around the face, down to some height
        wide, tall = random.uniform(1.0, 1.35) * eyes, random.uniform(1.1, 1.5) * eyes
        far = np.hypot(
            (across - middle[0]) / wide, (down - middle[1]) / np.where(down < middle[1], tall, 9 * eyes)
        )
        edge = 1 + 0.08 * _cloud(random, 6)
        end = random.uniform(middle[1], chin[1] + eyes) + 4 * _cloud(random, 6)
        hair = np.clip((far - edge) * 12, 0, 1) * (far < random.uniform(1.3, 2.2)) * (down < end)
        strands = 1 + 0.15 * _cloud(random, 2) + 0.2 * _cloud(random, 12)
        colour = random.uniform(10, 230) * (1 + 0.2 * random.standard_normal(3))
        result += (strands[..., None] * colour - result) * hair[..., None]
        if random.random() < FRINGED / HAIRY:
            brow = places[[row[name] for name in ("4.3", "4.4")], 1].min()
            edge = brow - random.uniform(0.0, 0.4) * eyes + 2 * _cloud(random, 8) + 0.7 * _cloud(random, 1)
            side = np.abs(across - middle[0]) < random.uniform(0.9, 1.3) * eyes
            fringe = np.clip((edge - down) / 1.5, 0, 1) * (opaque[..., 0] > 0) * side
            result += (strands[..., None] * colour - result) * fringe[..., None]
    return result


def _backdrop(random: np.random.Generator) -> Float64:
    """Return something to stand before: even, cloudy, or with edges (H, W, 3)."""
    colours = random.uniform(0, 255, (3, 3))
    strength = random.uniform(0, 1.0)
    share = np.clip(0.5 + strength * _cloud(random, 40) + strength * 0.5 * _cloud(random, 5), 0, 1)
    result = colours[0] * share[..., None] + colours[1] * (1 - share[..., None])
    for _ in range(int(random.integers(0, 5))):
        x, y = random.integers(0, SIZE[0]), random.integers(0, SIZE[1])
        wide, high = random.integers(10, SIZE[0]), random.integers(10, SIZE[1])
        result[y : y + high, x : x + wide] = random.uniform(0, 255, 3)
    return np.asarray(result)


def _cloud(random: np.random.Generator, reach: float) -> Float64:
    """Return noise (H, W) of standard deviation 1 that is alike over some pixels."""
    noise = gaussian_filter(random.standard_normal(SIZE[::-1]), reach, mode="wrap")
    return np.asarray(noise / noise.std())


def _exposed(pixels: Float64, random: np.random.Generator) -> UInt8:
    """Return a picture in another light and exposure, blurred and with noise: uint8 (H, W, 3)."""
    across, down = np.meshgrid(np.linspace(-1, 1, SIZE[0]), np.linspace(-1, 1, SIZE[1]))
    ramp = 1 + random.uniform(-0.45, 0.45) * across + random.uniform(-0.3, 0.3) * down
    lit = 255 * (np.clip(pixels / 255 * ramp[..., None], 0, 1) ** random.uniform(0.6, 1.6))
    lit = gaussian_filter(lit, (*[random.uniform(0, 1.5)] * 2, 0))
    noisy = lit + random.normal(0, random.uniform(0, 8), lit.shape)
    return np.asarray(np.clip(noisy, 0, 255), dtype=np.uint8)
