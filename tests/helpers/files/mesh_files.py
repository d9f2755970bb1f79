"""Mesh files of other programs, written for tests: OBJ, PLY and glTF."""

import json
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from fba.face.feature_points import names
from fba.face.model import FaceModel, Part


def write_obj(path: Path, parts: Sequence[Part], scale: float = 1.0, flip: bool = False) -> None:
    """Parts as groups, vertices times scale; flip: triangles the wrong way round."""
    lines, start = ["# test"], 1
    for part in parts:
        lines.append(f"g {part.name.replace(' ', '_')}")
        lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in part.vertices.astype(np.float64) * scale]
        triangles = part.triangles[:, ::-1] if flip else part.triangles
        lines += [f"f {a} {b} {c}" for a, b, c in triangles + start]
        start += len(part.vertices)
    path.write_text("\n".join(lines) + "\n")


def write_points(path: Path, model: FaceModel, scale: float = 1.0, vertices: bool = True) -> None:
    """Feature points as CSV: vertex numbers where bound, or positions."""
    lines = ["name,where"]
    for name, place, vertex in zip(names(), model.points * scale, model.bound, strict=True):
        if np.isnan(place).any():
            continue
        if vertices and vertex >= 0:
            lines.append(f"{name},{vertex}")
        else:
            lines.append(f"{name},{place[0]:.9g},{place[1]:.9g},{place[2]:.9g}")
    path.write_text("\n".join(lines) + "\n")


def ply(vertices: np.ndarray, faces: Sequence[Sequence[int]], order: str, extra: bool = False) -> bytes:
    """A PLY file. order: "ascii", "<" or ">". extra: colours, and a float before each face's list."""
    form = {"ascii": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = ["ply", f"format {form} 1.0", "comment test", f"element vertex {len(vertices)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    if extra:
        head += [f"property uchar {name}" for name in ("red", "green", "blue")]
    head += [f"element face {len(faces)}"]
    if extra:
        head += ["property float quality"]
    head += ["property list uchar int vertex_indices", "end_header", ""]
    body = b""
    for vertex in vertices:
        colour = (255, 0, 127) if extra else ()
        if order == "ascii":
            body += " ".join([*(repr(float(c)) for c in vertex), *map(str, colour)]).encode() + b"\n"
        else:
            body += struct.pack(f"{order}3f{len(colour)}B", *vertex, *colour)
    for face in faces:
        if order == "ascii":
            body += " ".join([*(["0.5"] if extra else []), str(len(face)), *map(str, face)]).encode() + b"\n"
        else:
            body += struct.pack(f"{order}f", 0.5) if extra else b""
            body += struct.pack(f"{order}B{len(face)}i", len(face), *face)
    return "\n".join(head).encode() + body


def write_glb(
    path: Path, parts: Sequence[Part], morphs: Mapping[str, Mapping[str, np.ndarray]] | None = None
) -> None:
    """Parts as nodes with morph targets (name of shape -> name of part -> displacements), by hand."""
    chunks: list[bytes] = []
    views: list[dict[str, int]] = []
    accessors: list[dict[str, object]] = []

    def accessor(array: np.ndarray, kind: str, component: int) -> int:
        data = np.ascontiguousarray(array).tobytes()
        offset = sum(map(len, chunks))
        chunks.append(data + b"\0" * (-len(data) % 4))
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(data)})
        entry: dict[str, object] = {
            "bufferView": len(views) - 1,
            "componentType": component,
            "count": array.size if kind == "SCALAR" else len(array),
            "type": kind,
        }
        if kind == "VEC3":
            entry |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        accessors.append(entry)
        return len(accessors) - 1

    meshes, nodes = [], []
    for part in parts:
        primitive: dict[str, object] = {
            "attributes": {"POSITION": accessor(part.vertices.astype("<f4"), "VEC3", 5126)},
            "indices": accessor(part.triangles.astype("<u4").reshape(-1), "SCALAR", 5125),
        }
        mesh: dict[str, object] = {"name": part.name, "primitives": [primitive]}
        moved = {shape: by[part.name] for shape, by in (morphs or {}).items() if part.name in by}
        if moved:
            primitive["targets"] = [
                {"POSITION": accessor(m.astype("<f4"), "VEC3", 5126)} for m in moved.values()
            ]
            mesh["extras"] = {"targetNames": list(moved)}
        meshes.append(mesh)
        nodes.append({"name": part.name, "mesh": len(meshes) - 1})
    data = b"".join(chunks)
    document = json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(nodes)))}],
            "nodes": nodes,
            "meshes": meshes,
            "accessors": accessors,
            "bufferViews": views,
            "buffers": [{"byteLength": len(data)}],
        }
    ).encode()
    document += b" " * (-len(document) % 4)
    length = 12 + 8 + len(document) + 8 + len(data)
    path.write_bytes(
        struct.pack("<4sII", b"glTF", 2, length)
        + struct.pack("<I4s", len(document), b"JSON")
        + document
        + struct.pack("<I4s", len(data), b"BIN\0")
        + data
    )
