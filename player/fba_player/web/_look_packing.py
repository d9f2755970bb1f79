"""Packs what changes how a figure looks as it moves: light, wrinkles, the skin's relief.

Light that reaches a vertex from a large lamp is a sum of 16 harmonics of the lamp's direction (see
`fba_player._figure.occlusion`). Few numbers make most of the difference between vertices: those on the first
principal axes over the directions that lamps have as a head turns. They are stored.
"""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from fba.arrays import Float64, Int64
from fba_player._figure.face import FaceFigure
from fba_player._figure.face_light import LIGHTS
from fba_player._figure.occlusion import FACTORS, harmonics
from fba_player._figure.wrinkles import OUTSIDE_OF_MAP, wrinkle_table
from fba_player._mesh.textures import RELIEF, skin_relief
from fba_player._mesh.wrinkle_map import BOTTOM, TOP, WIDTH, wrinkle_map
from fba_player.web._container import Container, rounded

VISIBLE, THROUGH = 12, 6
"""Numbers a vertex for the light that reaches it, and for that which comes through the skin."""
LIGHT_STEP = 1 / 60
"""Light is a sum of multiples of it: within 0.05 at 99 of 100 vertices."""
TURNS = 400
"""Rotations of a head over which that is optimal; half of them also turn all round, as bodies do."""
SPREADS = (28.0, 20.0, 12.0)
"""Standard deviations of a head's yaw, pitch and roll, degrees."""
PLACE_STEP = 1 / 512
"""Eye separations: places in the map of wrinkles are multiples of it."""
MAP_HALVINGS = 1
RELIEF_HALVINGS = 1
"""How often the pictures of wrinkles and relief are halved: pages are seldom larger than a screen."""
RELIEF_QUALITY = 50


def pack_face_light(container: Container, figure: FaceFigure, rows: Int64) -> dict[str, Any]:
    """Return the light on the vertices (W,) of a face's model, which `figure/light.js` puts together.

    "shut": `VISIBLE` numbers a vertex, `THROUGH` numbers and the open share of the sky, with the mouth shut;
    "wide": what these change by at the vertices `near` with the mouth wide open; "basis": weights of the
    numbers, as sums of 16 harmonics of a direction; "lips": the vertices between which `gaps` are measured
    (m); "reach": how far (m) a tongue is out when light falls on it freely.
    """
    baked = figure.light.baked
    near = baked.near[rows]
    places = np.flatnonzero(near)
    towards = _directions()
    tables, basis = [], []
    for name, count, lamps in (("light", VISIBLE, (0, 1)), ("through", THROUGH, (1,))):
        shut, wide = (
            getattr(visibility, name)[rows].astype(np.float64) for visibility in (baked.shut, baked.wide)
        )
        weights = np.concatenate([harmonics(towards[lamp]) for lamp in lamps]) * FACTORS
        root = np.linalg.cholesky(weights.T @ weights / len(weights) + 1e-9 * np.eye(weights.shape[1]))
        axes = np.linalg.svd(np.concatenate([shut, wide[places]]) @ root, full_matrices=False)[2][:count]
        tables.append([table @ root @ axes.T for table in (shut, wide)])
        basis.append(axes @ np.linalg.inv(root) * FACTORS)
    tables.append([visibility.open[rows, None] for visibility in (baked.shut, baked.wide)])
    shut, wide = (np.concatenate(columns, axis=1) for columns in zip(*tables, strict=True))
    steps = np.rint(shut / LIGHT_STEP) * LIGHT_STEP
    number = {int(row): place for place, row in enumerate(rows)}
    lips = [number.get(row, -1) for row in figure.light.lips]
    return {
        "shut": container.add_fractions(shut, LIGHT_STEP),
        "wide": container.add_fractions((wide - steps)[places], LIGHT_STEP),
        "near": container.add_integers(places),
        "basis": rounded(np.concatenate(basis).ravel(), 5),
        "visible": VISIBLE,
        "lips": lips if len(lips) == 2 and min(lips) >= 0 else [],
        "gaps": rounded(baked.gaps),
        "reach": rounded(0.12 * figure.model.fapu.ENS * 1024),
    }


def _directions() -> list[Float64]:
    """Return where the lamps are as seen from a head that turns: of each float64 (N, 3), unit vectors."""
    random = np.random.default_rng(27)
    angles = np.radians(random.standard_normal((TURNS, 3)) * SPREADS)
    angles[: TURNS // 2, 0] = random.uniform(-np.pi, np.pi, TURNS // 2)
    (cy, cx, cz), (sy, sx, sz) = np.cos(angles).T, np.sin(angles).T
    zero, one = np.zeros(TURNS), np.ones(TURNS)
    yaw = np.array([[cy, zero, sy], [zero, one, zero], [-sy, zero, cy]])
    pitch = np.array([[one, zero, zero], [zero, cx, -sx], [zero, sx, cx]])
    roll = np.array([[cz, -sz, zero], [sz, cz, zero], [zero, zero, one]])
    turns = np.einsum("ijn,jkn,kln->nil", yaw, pitch, roll)
    return [np.einsum("nij,i->nj", turns, lamp / np.linalg.norm(lamp)) for lamp in LIGHTS]


def pack_wrinkles(container: Container, figure: FaceFigure, rows: Int64) -> dict[str, Any] | None:
    """Return the wrinkles of a face: their map, where vertices lie in it, what FAPs bring out; or None."""
    places = np.full((len(figure.model.vertices), 2), OUTSIDE_OF_MAP)
    for name, shape in figure.shapes.items():
        if shape.wrinkle_places is not None:
            places[figure.rows(name)] = shape.wrinkle_places
    if (places[rows] == OUTSIDE_OF_MAP).all():
        return None
    kinds, columns, full = wrinkle_table()
    pixels = _halved(wrinkle_map(), MAP_HALVINGS)
    return {
        "places": container.add_fractions(places[rows], PLACE_STEP),
        "map": container.add_integers(pixels.reshape(-1, 4)),
        "width": pixels.shape[1],
        "window": rounded([1 / WIDTH, -1 / (TOP - BOTTOM), 0, TOP / (TOP - BOTTOM)]),
        "table": np.column_stack([kinds, columns.T, full]).tolist(),
    }


def pack_relief(container: Container) -> dict[str, Any]:
    """Return the picture of the skin's relief, and the metres after which it repeats."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(_halved(skin_relief(), RELIEF_HALVINGS)).save(
        file, "WEBP", quality=RELIEF_QUALITY, method=6
    )
    return {"picture": container.add_bytes(file.getvalue()), "metres": RELIEF}


def _halved(pixels: Any, times: int) -> Any:
    """Return pixels (H, W, K), halved so often."""
    from PIL import Image

    channels = [
        np.asarray(Image.fromarray(pixels[..., k].copy()).reduce(2**times)) for k in range(pixels.shape[2])
    ]
    return np.stack(channels, axis=2)
