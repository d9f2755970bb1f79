"""Packs a face for the web player, with the motion of each FAP as few shapes.

What a FAP does to N vertices at its K interval borders is a matrix (3 N, K). Most are products of one or two
shapes (3 N,) with curves over the FAP's value, piecewise linear between the borders; so these are stored:
shapes as multiples of a hundredth of a millimetre, in as many as bring every vertex at every border within
`SHAPE_ERROR` of the `FaceDefTables`.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Float64, Int32, Int64, Integer
from fba.body import BodyPart
from fba.face import FaceDefMesh, FaceModel, InterpolationTable, Part, Term
from fba.face.deform.flat_tables import KIND_ORDER, flatten_transforms
from fba.parameters import EXPRESSION_FIELDS, VISEME_FIELDS, faps
from fba_player._figure._tongue import Tongue
from fba_player._figure.face import FaceFigure
from fba_player._mesh.textures import load_picture
from fba_player.view._view import FaceShape
from fba_player.web._container import Container, rounded
from fba_player.web._look_packing import pack_face_light, pack_wrinkles

STEP = 1.5e-5
"""Metres: positions are multiples of it."""
SHAPE_STEP = 1.85e-5
"""Metres: shapes are multiples of it."""
SHAPE_ERROR = 2e-5
"""Largest error of a vertex's shift by one FAP within its borders, in metres along each axis."""
REACH = 1000
"""Values beyond a FAP's borders for which that holds, too."""
TEXTURE_BYTES = 60_000
"""Pictures with more bytes are stored smaller."""
TEXTURE_SIZE = 1024
"""Pixels that the wider side of such a picture keeps."""
TEXTURE_QUALITY = 29
COORDINATE_STEP = 1 / 4096
SWAY_STEP = 1 / 8192
HAIR_STEP = 1 / 127
LENGTH_STEP = 1 / 1024
"""Of a tongue's cross sections."""
WIDTH_STEP = 1e-6
"""Metres: widths of hairs are multiples of it."""


@dataclass(frozen=True, eq=False)
class Reduced:
    """The parts of a figure, with the vertices of their triangles.

    rows: int64 (W,), vertices of the model that stay, in their new order. header: what describes the parts.
    """

    rows: Int64
    header: list[dict[str, Any]]


Chosen = tuple[Part | BodyPart, Int32, int, FaceShape | None]
"""A part, its triangles (F, 3), its first vertex in the model, and its shape; None for an eyeball."""


def reduce_parts(container: Container, parts: Iterable[Chosen], groups: Integer | None = None) -> Reduced:
    """Pack parts of a figure with the vertices of their triangles. groups: see `Deformer.normal_groups`."""
    rows, header = [np.zeros(0, dtype=np.int64)], list[dict[str, Any]]()
    for part, triangles, start, shape in parts:
        ordered = order_triangles(triangles)
        used, first, corners = np.unique(ordered, return_index=True, return_inverse=True)
        order = np.argsort(first)
        number = np.empty_like(order)
        number[order] = np.arange(len(order))
        chosen = used[order].astype(np.int64)
        entry: dict[str, Any] = {
            "name": part.name,
            "kind": part.kind,
            "count": len(chosen),
            "triangles": container.add_triangles(number[corners].reshape(-1, 3)),
            **_pack_surface(container, part, chosen, shape),
        }
        rows.append(chosen + start)
        if groups is not None:  # how far before each vertex the first is that shares its normal
            _, leaders, shared = np.unique(groups[rows[-1]], return_index=True, return_inverse=True)
            entry["seams"] = container.add_integers(np.arange(len(chosen)) - leaders[shared])
        header.append(entry)
    return Reduced(np.concatenate(rows), header)


def order_triangles(triangles: Int32) -> Int64:
    """Return the same triangles (F, 3), each next to the one before it where possible."""
    faces: list[list[int]] = triangles.tolist()
    beside: dict[tuple[int, int], list[int]] = {}
    for number, corners in enumerate(faces):
        for k in range(3):
            a, b = corners[k], corners[k - 1]
            beside.setdefault((min(a, b), max(a, b)), []).append(number)
    left, result, stack = [True] * len(faces), list[list[int]](), list[int]()
    for seed in range(len(faces)):
        stack.append(seed)
        while stack:
            number = stack.pop()
            if not left[number]:
                continue
            left[number] = False
            corners = faces[number]
            result.append(corners)
            for k in range(3):
                a, b = corners[k], corners[k - 1]
                stack += [other for other in beside[min(a, b), max(a, b)] if left[other]]
    return np.array(result, dtype=np.int64).reshape(-1, 3)


def _pack_surface(
    container: Container, part: Part | BodyPart, rows: Int64, shape: FaceShape | None
) -> dict[str, Any]:
    """Return how a part looks. rows: (W,), its vertices that stay."""
    material = part.material
    header: dict[str, Any] = {
        "colour": rounded(material.colour, 5),
        "gloss": round(material.gloss, 5),
        "opacity": material.opacity,
        "alpha": material.alpha,
        "cutoff": material.cutoff,
        "twoSided": material.two_sided if shape is None else shape.two_sided,
        **_pack_shape(container, shape, rows),
    }
    if part.colours is not None:
        colours = part.colours[rows].astype(np.float64)
        if np.ptp(colours, axis=0).max(initial=0.0) < 1 / 255:
            header["colour"], header["gloss"] = rounded(colours[0, :3], 5), round(float(colours[0, 3]), 5)
        else:  # roots: as bytes, light would show steps in the dark
            coded = np.concatenate([np.sqrt(np.clip(colours[:, :3], 0, 1)), colours[:, 3:]], axis=1)
            header["colours"] = container.add_fractions(coded, 1 / 255)
    picture = None if shape is None or shape.picture is None else shape.picture.data
    if picture is not None and part.texcoords is not None:
        header["texture"] = container.add_bytes(_smaller_picture(picture))
        header["texcoords"] = container.add_fractions(part.texcoords[rows], COORDINATE_STEP)
    return header


def _pack_shape(container: Container, shape: FaceShape | None, rows: Int64) -> dict[str, Any]:
    """Return how shaders draw a part, as `FaceShape` says; eyeballs, without a shape, have their own."""
    if shape is None:
        return {"ball": True}
    header: dict[str, Any] = {
        "scatter": shape.scatter,
        "closed": shape.closed,
        "smooth": shape.smooth,
        "opaque": shape.picture is None or shape.picture.opaque,
        "fine": rounded(shape.fine),
    }
    if shape.folds:
        header["folds"] = True
    if shape.across is not None:
        across = shape.across[rows].astype(np.float64)
        header["across"] = container.add_fractions(np.delete(across, 3, axis=1), HAIR_STEP)
        header["widths"] = container.add_fractions(across[:, 3:4], WIDTH_STEP)
    return header


def _smaller_picture(data: bytes) -> bytes:
    """Return a picture's bytes, or those of a smaller one if they are many."""
    if len(data) <= TEXTURE_BYTES:
        return data
    from PIL import Image

    loaded = load_picture(data)
    picture = Image.fromarray(loaded.pixels)
    if loaded.opaque:
        picture = picture.convert("RGB")
    picture.thumbnail((TEXTURE_SIZE, TEXTURE_SIZE), Image.Resampling.LANCZOS)
    result = io.BytesIO()
    picture.save(result, "WEBP", quality=TEXTURE_QUALITY, method=6)
    return min(result.getvalue(), data, key=len)


def pack_face_parts(
    container: Container, figure: FaceFigure, parts: Iterable[Chosen]
) -> tuple[dict[str, Any], Int64]:
    """Return the header of a face, and the vertices of its model that stay, in their new order."""
    model, size = figure.model, figure.scale
    reduced = reduce_parts(container, parts, figure.deformer.normal_groups)
    subject = figure.subject
    places = {part["name"]: place for place, part in enumerate(reduced.header)}
    number = {int(row): place for place, row in enumerate(reduced.rows)}
    sways = np.ones(len(model.vertices), dtype=np.float32)
    for name, shape in figure.shapes.items():
        sways[figure.rows(name)] = shape.sway
    header = {
        "parts": reduced.header,
        "positions": container.add_fractions(model.vertices[reduced.rows], STEP * size, centred=True),
        "sway": container.add_fractions(sways[reduced.rows][:, None], SWAY_STEP),
        "centre": figure.centre.tolist(),
        "subject": {
            "centre": list(subject.centre),
            "halfHeight": subject.half_height,
            "halfWidth": subject.half_width,
        },
        "eyes": [
            {
                "part": places[part.name],
                "centre": ball.centre.tolist(),
                "numbers": [ball.side, ball.radius, ball.iris, ball.pupil, ball.step],
                "lids": [number.get(row, -1) for row in ball.lids],
            }
            for part, ball in figure.eyeballs
            if part.name in places
        ],
        "tongues": [
            {"part": places[tongue.part], **packed}
            for tongue in figure.tongues
            if tongue.part in places and (packed := _pack_tongue(container, tongue, reduced.rows, number))
        ],
        "light": pack_face_light(container, figure, reduced.rows),
        "wrinkles": pack_wrinkles(container, figure, reduced.rows),
        **pack_rules(model),
        **_pack_motion(container, figure, reduced.rows),
    }
    return header, reduced.rows


def _pack_tongue(
    container: Container, tongue: Tongue, rows: Int64, number: dict[int, int]
) -> dict[str, Any] | None:
    """Return what keeps a tongue in its place; None if vertices around it do not stay.

    rows: (W,), the model's vertices that stay, in their new order. number: the places of these vertices.
    """
    around = [*tongue.lips.tolist(), *tongue.teeth.tolist(), tongue.front]
    if not all(row in number for row in around):
        return None
    places = [number[row] for row in around]
    inside = rows[(rows >= tongue.rows.start) & (rows < tongue.rows.stop)] - tongue.rows.start
    return {
        "slices": container.add_integers(tongue.slice_of[inside]),
        "length": container.add_fractions(tongue.length[inside, None], LENGTH_STEP),
        "lips": places[:4],
        "teeth": places[4:8],
        "front": places[8],
        "size": tongue.size,
    }


def pack_rules(model: FaceModel) -> dict[str, Any]:
    """Return how a face fills in what is not sent: FAPs of each viseme and expression, and its FIT."""
    tables = (model.definitions.visemes, model.definitions.expressions)
    return {
        "definitions": [
            [{int(n) + 1: float(row[n]) for n in np.flatnonzero(row)} for row in table[1:]]
            for table in tables
        ],
        "fit": [] if model.fit is None else _pack_fit(model.fit),
    }


def _pack_motion(container: Container, figure: FaceFigure, rows: Int64) -> dict[str, Any]:
    """Return what FAPs do to a face. rows: (W,), the model's vertices that stay, in their new order."""
    model, size = figure.model, figure.scale
    number = np.full(len(model.vertices), -1)
    number[rows] = np.arange(len(rows))
    tracks, moved, shapes = [], [np.zeros(0, dtype=np.int64)], [np.zeros((0, 3))]
    for table in model.tables:
        unit = model.fapu.of_fap(table.fap)
        for mesh in table.meshes:
            vertices = number[mesh.vertices + model.starts[mesh.part]]
            order = np.argsort(vertices)[np.count_nonzero(vertices < 0) :]
            if not len(order):
                continue
            borders, shifts = shifts_at_borders(mesh, order, unit)
            curves, modes = factorise(shifts, SHAPE_ERROR * size, SHAPE_STEP * size)
            moving = np.flatnonzero(modes.any(axis=(0, 2)))
            if len(moving):
                tracks.append(
                    {
                        "fap": table.fap,
                        "borders": rounded(borders),
                        "curves": rounded(curves, 7),
                        "rows": len(moving),
                    }
                )
                moved.append(vertices[order[moving]])
                shapes += list(modes[:, moving])
    transforms = flatten_transforms(model)
    owners = np.repeat(np.arange(len(transforms.start) - 1), np.diff(transforms.start))
    parts = [*(part.name for part in model.parts), None]
    return {
        "tracks": tracks,
        "rows": container.add_integers(np.concatenate(moved)),
        "shapes": container.add_fractions(np.concatenate(shapes), SHAPE_STEP * size),
        "transforms": [
            {
                "part": parts[owner],
                "kind": KIND_ORDER[transforms.kind[k]],
                "fap": int(transforms.column[k]) + 1,
                "amount": transforms.amount[k].tolist(),
                "centre": transforms.centre[k].tolist(),
            }
            for k, owner in enumerate(owners)
        ],
    }


def shifts_at_borders(mesh: FaceDefMesh, chosen: Int64, unit: float) -> tuple[Float64, Float64]:
    """Return borders (K,) and the shifts (K, N, 3) of chosen vertices there, metres.

    The outermost intervals, which have no end, are given one.
    """
    borders = mesh.borders.astype(np.float64)
    zero = int(np.flatnonzero(borders == 0)[0])
    borders[0] = min(borders[0], (borders[1] if zero else 0) - REACH) if zero else borders[0]
    borders[-1] = max(borders[-1], borders[-2] + REACH) if zero < len(borders) - 1 else borders[-1]
    steps = mesh.displacements[chosen].astype(np.float64).transpose(1, 0, 2)
    shifts = np.zeros((len(borders), len(chosen), 3))
    np.cumsum(steps * np.diff(borders)[:, None, None] * unit, axis=0, out=shifts[1:])
    return borders, shifts - shifts[zero].copy()


def factorise(shifts: Float64, error: float, step: float) -> tuple[Float64, Float64]:
    """Return curves (R, K) and shapes (R, N, 3), multiples of a step, whose products are shifts (K, N, 3).

    No number is off by more than `error` and what rounding adds, which further shapes would add to.
    """
    flat = shifts.reshape(len(shifts), -1)
    left, sizes, right = np.linalg.svd(flat, full_matrices=False)
    for count in range(len(sizes) + 1):
        curves, modes = left[:, :count], sizes[:count, None] * right[:count]
        if np.abs(curves @ modes - flat).max(initial=0.0) <= error:
            break
    scale = np.abs(curves).max(axis=0, initial=0.0)
    curves, modes = (curves / scale).T, np.rint(modes * scale[:, None] / step) * step
    return curves, modes.reshape(count, *shifts.shape[1:])


def _pack_fit(table: InterpolationTable) -> list[dict[str, Any]]:
    """Return the links to each FAP, in the order in which they are computed.

    Numbers are named by places: FAPs by their columns, then the fields of viseme and expression.
    """
    names = [*(fap.name for fap in faps()), *VISEME_FIELDS[:3], *EXPRESSION_FIELDS[:4]]
    places = {name: place for place, name in enumerate(names)}

    def terms(listed: Iterable[Term]) -> list[list[Any]]:
        return [
            [
                term.coefficient,
                [[places[name], exponent] for name, exponent in term.powers.items()],
                None if term.when is None else [places[term.when[0]], term.when[1]],
            ]
            for term in listed
        ]

    return [
        {
            "fap": fap,
            "source": [places[name] for name in link.source],
            "numerator": terms(function.numerator),
            "denominator": terms(function.denominator),
        }
        for fap in table.order
        for link in table.links_to[fap]
        for function in (link.functions[faps()[fap - 1].name],)
    ]
