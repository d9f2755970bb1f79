"""Pictures of faces with known feature points: the built-in head, its shape, colours and light varied."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from PIL import Image

from fba import Animation, FaceTrack, player
from fba.arrays import Float64, UInt8
from fba.errors import FbaError, FbaWarning
from fba.face import FaceModel
from fba.face.calibration import fit
from fba.face.fitting._points_file import HIDDEN
from fba.face.fitting._views import face_covariance
from fba.face.model import Part
from fba.mesh import read_pixels
from fba.parameters import point_rows

SIZE = (360, 440)
DISTANCE = 1.5
SKIN_RANGE = (0.25, 1.25)
"""Factors on the brightness of the built-in skin, from dark to pale."""
INNER = (*HIDDEN, "11.1", "11.2", "11.3", "11.4", "11.6")
"""Points that are not varied: inside, or on the skull."""
HAIR = 110
"""Brightness of the built-in skin's picture below which it is hair."""


def rendered_faces(count: int, seed: int) -> Iterator[tuple[UInt8, Float64]]:
    """Yield pictures uint8 (H, W, 3) and the places (84, 2) of the feature points on them, pixels."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        head = None
        while head is None:
            head = varied_head(random)
        yield _photographed(head, random)


def varied_head(random: np.random.Generator) -> FaceModel | None:
    """Return the built-in head in another shape and other colours; None if the shape is impossible."""
    base = FaceModel.default()
    outer = [row for name, row in point_rows().items() if name not in INNER]
    points = np.full_like(base.points, np.nan)
    shift = random.multivariate_normal(
        np.zeros(3 * len(outer)), face_covariance(base.points[outer]), method="cholesky"
    )
    points[outer] = base.points[outer] + shift.reshape(-1, 3)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FbaWarning)
            head = fit(replace(base, tables=()), points, unit="m")
    except FbaError:
        return None
    return replace(
        head, parts=tuple(_coloured(part, random) if part.kind == "skin" else part for part in head.parts)
    )


def _coloured(part: Part, random: np.random.Generator) -> Part:
    """Return the skin with other colours: of the skin, the lips' strength, the hair, or without any hair."""
    pixels = read_pixels(part.material.texture or b"", 1024)
    assert pixels is not None
    picture = pixels[..., :3].astype(np.float64)
    hair = picture.mean(axis=2) < HAIR
    low, high = SKIN_RANGE
    tone = random.uniform(low, high) * (1 + 0.12 * random.standard_normal(3) * (0.3, 0.6, 1.0))
    mean = picture[~hair].mean(axis=0)
    skin = mean + (picture - mean) * random.uniform(0.4, 1.3)
    shade = random.uniform(0.2, 2.0) * (1 + 0.15 * random.standard_normal(3))
    bald = random.random() < 0.3
    upper = np.arange(len(picture))[:, None] < 0.22 * len(picture)
    brows = hair & ~upper
    brows &= np.abs(np.arange(picture.shape[1]) / picture.shape[1] - 0.5)[None, :] < 0.2
    strength = random.uniform(0.5, 1.0)
    result = skin * tone
    painted = picture * shade
    result[hair & ~brows] = (mean * tone) if bald else painted[hair & ~brows]
    result[brows] = strength * painted[brows] + (1 - strength) * (mean * tone)
    file = io.BytesIO()
    Image.fromarray(np.clip(result, 0, 255).astype(np.uint8)).save(file, "JPEG", quality=90)
    return replace(part, material=replace(part.material, texture=file.getvalue()))


def _photographed(head: FaceModel, random: np.random.Generator) -> tuple[UInt8, Float64]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)  # it has no FAPs
        scene = player.Scene(Animation(25, np.arange(1), FaceTrack.empty(1)), model=head)
    row = point_rows()
    tip, pupil = head.points[row["9.3"]], head.points[row["3.5"]]
    shift = random.uniform(-0.02, 0.02, 2)
    camera = player.Camera(
        target=(float(shift[0]), float(tip[1] + 0.01 + shift[1]), float(pupil[2] - 0.06)),
        yaw=random.uniform(-12, 12), pitch=random.uniform(-12, 12), distance=DISTANCE,
        field_of_view=2 * float(np.degrees(np.arctan(random.uniform(0.15, 0.2) / DISTANCE))),
    )  # fmt: skip
    with player.Offscreen(scene, SIZE, samples=2) as view:
        view.camera = camera
        pixels = view.still(np.zeros(68))[..., :3].astype(np.float64)
    across, down = np.meshgrid(np.linspace(-1, 1, SIZE[0]), np.linspace(-1, 1, SIZE[1]))
    ramp = 1 + random.uniform(-0.45, 0.45) * across + random.uniform(-0.3, 0.3) * down
    lit = 255 * (np.clip(pixels / 255 * ramp[..., None], 0, 1) ** random.uniform(0.7, 1.5))
    lit += random.normal(0, random.uniform(0, 6), lit.shape)
    clip = np.column_stack([head.points, np.ones(len(head.points))]) @ camera.clip_matrix(SIZE).T
    flat = clip[:, :2] / clip[:, 3:]
    return np.clip(lit, 0, 255).astype(np.uint8), (flat * (0.5, -0.5) + 0.5) * SIZE
