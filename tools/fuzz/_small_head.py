"""The smallest head that imports: what stands beside the files of the fuzzer that name or need one."""

from __future__ import annotations

import numpy as np

from fba.face import feature_point_names, neutral_points

EYE_RADIUS = 0.012
"""Metres, as of the built-in head."""
_INSIDE = ("3.5", "3.6", "6.", "9.8", "9.9", "9.10", "9.11")
"""Feature points that are not on the skin: pupils, tongue, teeth."""
_OCTAHEDRON = [(s * (axis == 0), s * (axis == 1), s * (axis == 2)) for axis in range(3) for s in (1, -1)]
_OCTANTS = [(x, y, z) for x in (0, 1) for y in (2, 3) for z in (4, 5)]


def small_head() -> dict[str, tuple[np.ndarray, list[tuple[int, int, int]]]]:
    """Return the vertices, metres, and the triangles of a skin through feature points and of two eyeballs."""
    points = dict(zip(feature_point_names(), neutral_points(), strict=True))
    on_skin = sorted(
        {tuple(point) for name, point in points.items() if not name.startswith(_INSIDE)}, key=_row
    )
    parts = {"skin": (np.array(on_skin), [(n, n + 1, n + 2) for n in range(len(on_skin) - 2)])}
    for name, pupil in (("eye_left", "3.5"), ("eye_right", "3.6")):
        centre = points[pupil] - [0.0, 0.0, EYE_RADIUS]
        parts[name] = (centre + EYE_RADIUS * np.array(_OCTAHEDRON), list(_OCTANTS))
    return parts


def _row(point: tuple[float, ...]) -> tuple[float, ...]:
    return point[1], point[0], point[2]


def small_head_obj() -> bytes:
    """Return the head as an OBJ mesh."""
    lines, before = [], 1
    for name, (vertices, triangles) in small_head().items():
        lines += [f"o {name}", *(f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in vertices)]
        lines += [" ".join(["f", *(str(before + n) for n in triangle)]) for triangle in triangles]
        before += len(vertices)
    return "\n".join([*lines, ""]).encode()


def small_head_points() -> bytes:
    """Return its feature points as a table."""
    rows = zip(feature_point_names(), neutral_points(), strict=True)
    return "".join(f"{name},{x:.4f},{y:.4f},{z:.4f}\n" for name, (x, y, z) in rows).encode()


def small_head_vrml() -> bytes:
    """Return the head as a VRML scene, a shape for each part."""
    shapes = []
    for vertices, triangles in small_head().values():
        points = ", ".join(f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in vertices)
        corners = " -1 ".join(f"{a} {b} {c}" for a, b, c in triangles)
        shapes.append(
            "Shape { geometry IndexedFaceSet { "
            f"coord Coordinate {{ point [ {points} ] }} coordIndex [ {corners} -1 ] }} }}"
        )
    return "\n".join(["#VRML V2.0 utf8", *shapes, ""]).encode()


def small_head_wfm() -> bytes:
    """Return the head as a wire frame of Candide's kind."""
    vertices: list[str] = []
    triangles: list[str] = []
    for part_vertices, part_triangles in small_head().values():
        triangles += [" ".join(str(len(vertices) + n) for n in triangle) for triangle in part_triangles]
        vertices += [f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in part_vertices]
    lists = ["# VERTEX LIST:", str(len(vertices)), *vertices, "# FACE LIST:", str(len(triangles)), *triangles]
    return "\n".join([*lists, "# END OF FILE", ""]).encode()


def small_head_fdp() -> bytes:
    """Return its feature points as a text FDP file."""
    return ("1.0 head\n" + small_head_points().decode().replace(",", " ")).encode()


def small_head_xface() -> bytes:
    """Return what Xface says of the VRML scene `head.wrl`: the vertex of each feature point, and the eyes."""
    rows = []
    for number, (vertices, _) in enumerate(small_head().values()):
        for name, point in zip(feature_point_names(), neutral_points(), strict=True):
            distance = np.abs(vertices - point).max(axis=1)
            if distance.min() < 1e-4:
                rows.append(f'<fdp affects="head.wrl_{number}" index="{distance.argmin()}" name="{name}">')
                rows.append("<indices>0 1 2</indices></fdp>")
    return f"""<?xml version="1.0"?><xfdp>
<source><entity alias="Rest" category="Expression"><mesh file="head.wrl" format="wrl"/>
<bind item="LeftEye" submesh="head.wrl_1"/><bind item="RightEye" submesh="head.wrl_2"/></entity></source>
{chr(10).join(rows)}
</xfdp>
""".encode()
