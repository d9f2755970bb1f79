"""What a head has besides its skin: ears, teeth, tongue, brows, lashes, neck and shoulders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.face.feature_points import MIRRORED, names, row_of
from fba.face.points import FeaturePointFace
from player.head.loops import spline_basis
from player.head.surface import Surface
from player.primitives import tube_mesh
from player.shapes import srgb

Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]

SKIN = srgb("#d6a48a")
LIP = srgb("#b8625a")
HAIR = srgb("#3a2a22")
IVORY = srgb("#e9e2d2")
GUM = srgb("#a5524f")
TONGUE = srgb("#b5605c")
SHIRT = srgb("#3f6276")
ARCH = 0.028
"""Half the width of the arch of the upper teeth, metres."""
HOLLOW = 0.036
"""Half the width of the hollow behind them, metres: as wide as lips can stretch."""
TEETH = 14
"""Teeth in a row."""


@dataclass(frozen=True, eq=False)
class Part:
    """vertices (V, 3), triangles (F, 3), weights (V, 84), colours (V, 4): moved like the skin is."""

    vertices: Float64
    triangles: Int32
    weights: Float64
    colours: Float64


@dataclass(frozen=True, eq=False)
class Attached:
    """Hair on the skin: each vertex is a skin vertex (rows) and an offset (V, 3)."""

    rows: npt.NDArray[np.intp]
    offsets: Float64
    triangles: Int32
    colours: Float64


def _flat(colour: tuple[float, float, float], count: int, gloss: float) -> Float64:
    return np.tile([*colour, gloss], (count, 1))


def hair_strip(surface: Surface, name: str, radii: Float64, gloss: float = 0.15) -> Attached:
    """A tapering tube along a named curve of the skin. radii: (N, 2) height and depth, metres."""
    rows = surface.parts[name]
    around = 10
    turn = np.linspace(0, 2 * np.pi, around, endpoint=False)
    ring = np.stack([np.zeros(around), np.cos(turn), np.sin(turn)], axis=1)
    scale = np.stack([np.zeros(len(rows)), radii[:, 0], radii[:, 1]], axis=1)
    offsets = (ring[None] * scale[:, None]).reshape(-1, 3)
    return Attached(
        np.repeat(rows, around), offsets, tube_mesh(len(rows), around), _flat(HAIR, len(offsets), gloss)
    )


def brows_and_lashes(surface: Surface) -> list[Attached]:
    """Both brows and both upper lash lines."""
    found = []
    for side in ("left", "right"):
        count = len(surface.parts[f"brow {side}"])
        u = np.linspace(0, 1, count)
        height = 0.0034 * np.clip(1.3 * (1 - u) ** 0.6, 0, 1) * np.clip(u / 0.22, 0, 1) ** 0.5
        found.append(hair_strip(surface, f"brow {side}", np.stack([height, height * 0.42 + 2e-4], axis=1)))
        count = len(surface.parts[f"lid margin {side} upper"])
        u = np.linspace(-1, 1, count)
        thick = 0.0002 + 0.00085 * np.clip(1 - np.abs(u) ** 3, 0, 1) * (0.75 + 0.25 * u)
        found.append(hair_strip(surface, f"lid margin {side} upper", np.stack([thick, thick * 1.5], axis=1)))
    return found


def ear(face: FeaturePointFace, side: str) -> Part:
    """One ear: a shell with rim, fold and bowl, held by the ear's five feature points."""
    chain = ("10.9", "10.1", "10.3", "10.5", "10.7")
    points = {name: face.points[row_of()[name]] for name in chain}
    between = {
        "up": points["10.9"] * 0.4 + points["10.1"] * 0.6 + (0.0, 0.003, 0.005),
        "out": (points["10.1"] + points["10.3"]) / 2 + (0.0015, 0.006, -0.004),
        "down": points["10.3"] * 0.45 + points["10.5"] * 0.55 + (0.001, -0.001, -0.008),
        "front": points["10.7"] * 0.55 + points["10.9"] * 0.45 + (0.001, 0.0, 0.003),
    }
    order = [points["10.9"], between["up"], points["10.1"], between["out"], points["10.3"], between["down"],
             points["10.5"], points["10.7"], between["front"], points["10.9"]]  # fmt: skip
    count = 36
    from scipy.interpolate import CubicSpline

    outline = CubicSpline(np.linspace(0, 1, len(order)), np.array(order), bc_type="periodic")(
        np.linspace(0, 1, count, endpoint=False)
    )
    bowl = points["10.9"] * 0.45 + points["10.7"] * 0.55 + (0.002, 0.0, -0.009)
    outward = np.array([0.86, 0.0, 0.38])
    rings = np.array([0.0, 0.25, 0.45, 0.58, 0.70, 0.80, 0.90, 0.97, 1.0])
    lift = np.array([-0.0055, -0.005, -0.001, 0.0022, 0.0008, -0.0004, 0.0018, 0.0012, -0.0010])
    backward = np.clip((bowl[2] - outline[:, 2]) / 0.02 + 0.6, 0.25, 1.0)  # the rim fades towards the face
    shell = bowl + (outline - bowl)[None] * rings[:, None, None]
    shell += outward * (lift[:, None] * backward)[..., None]
    root = points["10.9"] * 0.5 + points["10.7"] * 0.5 + (-0.006, 0.0, -0.012)
    behind = [
        root + (outline - root) * t - outward * d for t, d in ((0.95, 0.0035), (0.6, 0.008), (0.35, 0.014))
    ]
    vertices = np.concatenate([shell, np.array(behind)]).reshape(-1, 3)
    triangles = tube_mesh(len(rings) + len(behind), count)
    away = np.linalg.norm(vertices[:, None] - np.array(list(points.values())), axis=2)
    share = 1 / (away + 0.004) ** 2
    share /= share.sum(axis=1, keepdims=True)
    weights = np.zeros((len(vertices), len(names())))
    weights[:, [row_of()[name] for name in chain]] = share
    colours = _flat(SKIN, len(vertices), 0.3)
    depth = np.repeat(np.concatenate([lift, np.zeros(len(behind))]), count)
    colours[:, :3] *= np.where(depth < -0.002, 0.72, 1.0)[:, None] * np.array([1.0, 0.93, 0.92])
    if side == "right":
        vertices = vertices * (-1.0, 1.0, 1.0)
        triangles = triangles[:, ::-1]
        for left, right in MIRRORED.items():
            pair = [row_of()[left], row_of()[right]]
            weights[:, pair] = weights[:, pair[::-1]]
    return Part(vertices, triangles.copy(), weights, colours)


def teeth(face: FeaturePointFace, *, upper: bool) -> Part:
    """One row of teeth on its arch, with the gum."""
    root, edge = ("9.8", "9.10") if upper else ("9.9", "9.11")
    a, b = (face.points[row_of()[name]] for name in (root, edge))
    columns, rows = 99, 7
    x = np.linspace(-1, 1, columns)
    phase = np.abs(np.sin(np.pi * x * TEETH / 2))
    fall = np.linspace(0, 1, rows)
    arch = ARCH if upper else ARCH * 0.95
    bulge = 0.0011 * phase**0.5
    z = edge_depth(x, arch)
    vertices = np.empty((rows, columns, 3))
    vertices[..., 0] = x * arch
    vertices[..., 1] = (a[1] + (b[1] - a[1]) * fall)[:, None]
    vertices[-1, :, 1] -= (b[1] - a[1]) * 0.07 * (1 - phase**0.4)
    profile = 0.0012 * np.sin(np.pi * fall) - 0.0006 * fall
    vertices[..., 2] = (a[2] + (b[2] - a[2]) * fall + profile)[:, None] + z + bulge
    colours = np.tile([*IVORY, 0.55], (rows, columns, 1))
    colours[..., :3] *= (0.60 + 0.40 * np.clip(phase * 1.8, 0, 1) ** 0.7)[None, :, None]
    colours[..., :3] *= (1 - 0.55 * np.abs(x) ** 2)[None, :, None]  # the cheeks shade those behind
    colours[:3, :, :3] = np.array(GUM) * (1 - 0.6 * np.abs(x) ** 2)[None, :, None]
    flat = np.arange(rows * columns).reshape(rows, columns)
    quads = [flat[:-1, :-1], flat[:-1, 1:], flat[1:, 1:], flat[1:, :-1]]
    triangles = np.concatenate([np.stack([quads[0], quads[3], quads[2]], -1).reshape(-1, 3),
                                np.stack([quads[0], quads[2], quads[1]], -1).reshape(-1, 3)])  # fmt: skip
    weights = np.zeros((rows * columns, len(names())))
    weights[:, row_of()[root]] = np.repeat(1 - fall, columns)
    weights[:, row_of()[edge]] = np.repeat(fall, columns)
    return Part(vertices.reshape(-1, 3), triangles.astype(np.int32), weights, colours.reshape(-1, 4))


def edge_depth(x: Float64, arch: float) -> Float64:
    """How far back the arch of the teeth lies, for x in -1..1 across it."""
    depth: Float64 = -0.72 * arch * np.abs(x) ** 2.2
    return depth


def hollow(face: FeaturePointFace) -> Part:
    """The inside of the mouth: a dark bowl behind the teeth, whose floor goes with the lower jaw."""
    top, bottom = (face.points[row_of()[name]] for name in ("9.8", "9.9"))
    rings, around = 8, 32
    inward = np.linspace(0, np.pi / 2, rings)[:, None]
    turn = np.linspace(0, 2 * np.pi, around, endpoint=False)
    middle, half = (top[1] + bottom[1]) / 2, (top[1] - bottom[1]) / 2 + 0.003
    x = HOLLOW * np.cos(inward) * np.cos(turn)
    vertices = np.empty((rings, around, 3))
    vertices[..., 0] = x
    vertices[..., 1] = middle + half * np.cos(inward) * np.sin(turn)
    vertices[..., 2] = top[2] - 0.004 - 0.032 * (x / HOLLOW) ** 2 - 0.045 * np.sin(inward)
    weights = np.zeros((rings, around, len(names())))
    weights[..., row_of()["9.9"]] = np.clip(0.5 - 0.5 * np.sin(turn) * 1.4 * np.cos(inward), 0, 1)
    colours = np.tile([0.055, 0.012, 0.010, 0.0], (rings, around, 1))
    colours[..., :3] *= (0.25 + 0.75 * np.cos(inward))[..., None]
    count = rings * around
    return Part(
        vertices.reshape(-1, 3), tube_mesh(rings, around), weights.reshape(count, -1), colours.reshape(-1, 4)
    )


def tongue(face: FeaturePointFace) -> Part:
    """A tongue through its tip, body and borders."""
    tip, body, border = (face.points[row_of()[name]] for name in ("6.1", "6.2", "6.3"))
    rings, around = 13, 16
    v = np.linspace(0, 1, rings)
    back = body + np.array([0.0, -0.012, -0.022])
    spine = spline_basis(np.array([0.0, 0.5, 1.0]), v) @ np.array([back, body, tip])
    wide = border[0] * np.sqrt(np.clip(1 - ((v - 0.42) / 0.58) ** 4, 0, None))
    thick = 0.0065 * np.sqrt(np.clip(1 - np.clip((v - 0.3) / 0.7, 0, None) ** 3, 0, None)) + 0.0002
    turn = np.linspace(0, 2 * np.pi, around, endpoint=False)
    vertices = np.empty((rings, around, 3))
    vertices[..., 0] = spine[:, 0][:, None] + wide[:, None] * np.cos(turn)
    vertices[..., 1] = (spine[:, 1] - thick)[:, None] + thick[:, None] * np.sin(turn)
    vertices[..., 2] = spine[:, 2][:, None]
    basis = np.clip(spline_basis(np.array([0.0, 0.5, 1.0]), v), 0, 1)
    edge = np.abs(np.cos(turn))[None] ** 2 * np.exp(-(((v - 0.62) / 0.3) ** 2))[:, None]
    weights = np.zeros((rings, around, len(names())))
    weights[..., row_of()["6.1"]] = basis[:, 2:3] * (1 - edge)
    weights[..., row_of()["6.2"]] = basis[:, 1:2] * (1 - edge)
    weights[..., row_of()["9.11"]] = basis[:, 0:1] * (1 - edge)
    left = np.cos(turn)[None] > 0
    weights[..., row_of()["6.3"]] = edge * left
    weights[..., row_of()["6.4"]] = edge * ~left
    triangles = tube_mesh(rings, around)[:, ::-1].copy()
    count = rings * around
    return Part(vertices.reshape(-1, 3), triangles, weights.reshape(count, -1), _flat(TONGUE, count, 0.5))


def neck() -> Part:
    """Neck and shoulders for a head without a body; they stay where they are."""
    rows = np.array([
        # y, centre z, half width, half depth (mm), share of shirt
        (-55, -108, 40, 36, 0), (-85, -100, 50, 46, 0), (-105, -98, 54, 51, 0), (-125, -101, 55, 52, 0),
        (-140, -104, 58, 54, 0), (-152, -107, 65, 57, 0), (-161, -109, 78, 61, 0), (-166, -110, 92, 64, 1),
        (-172, -111, 112, 68, 1), (-180, -112, 136, 74, 1), (-192, -112, 163, 80, 1),
        (-210, -112, 184, 88, 1), (-235, -110, 197, 97, 1), (-270, -108, 204, 106, 1),
        (-330, -106, 206, 112, 1), (-420, -104, 205, 116, 1),
    ], dtype=float)  # fmt: skip
    fine = np.linspace(0, len(rows) - 1, 48)
    from scipy.interpolate import PchipInterpolator

    y, centre, wide, deep, shirt = PchipInterpolator(np.arange(len(rows)), rows)(fine).T
    around = 64
    turn = np.linspace(0, 2 * np.pi, around, endpoint=False)
    vertices = np.empty((len(fine), around, 3))
    vertices[..., 0] = wide[:, None] * np.sin(turn)
    vertices[..., 2] = centre[:, None] + deep[:, None] * np.cos(turn)
    # The base of the neck slopes: its front lies lower than its back.
    slope = np.interp(y, [-165, -110], [1.0, 0.0])[:, None] * np.interp(y, [-260, -165], [0.0, 1.0])[:, None]
    vertices[..., 1] = y[:, None] - 16 * slope * np.cos(turn)
    share = np.clip(shirt, 0, 1)[:, None, None]
    share = np.repeat(np.where(share > 0.5, 1.0, 0.0), around, axis=1)
    colours = np.concatenate(
        [np.array(SKIN) * 0.96 * (1 - share) + np.array(SHIRT) * share, 0.28 * (1 - share)], axis=2
    )
    count = len(fine) * around
    return Part(
        vertices.reshape(-1, 3) / 1000,
        tube_mesh(len(fine), around)[:, ::-1].copy(),
        np.zeros((count, len(names()))),
        colours.reshape(-1, 4),
    )
