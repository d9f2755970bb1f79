"""Heads that captured markers move, as glTF: shapes, weights and turns are those of the performance."""

import json
import struct
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from fba.capture.markers._motion import MarkerMotion
from fba.capture.markers._targets import target_points
from fba.capture.virtual_markers import MarkerMapping, VirtualMarker, head_of_model, move_head
from fba.formats.gltf.moved_head import write_moved_head
from fba.parameters import point_rows
from small_head import small_head

MARKED = ("2.1", "8.1", "8.2", "8.3", "8.4", "9.3", "11.1", "11.2", "11.3")
FIXED = ("9.3", "11.1", "11.2", "11.3")


def capture(frames: int = 20) -> MarkerMotion:
    """Markers at points of the small head; that of the lower lip goes down by 8 mm, and the head turns."""
    places = target_points(small_head().points)
    positions = np.repeat(np.array([places[name] for name in MARKED])[None], frames, axis=0)
    positions[10:, MARKED.index("8.2"), 1] -= 0.008
    turn = np.array([[0.96, 0.0, 0.28], [0.0, 1.0, 0.0], [-0.28, 0.0, 0.96]])
    positions[15:] = positions[15:] @ turn.T
    return MarkerMotion(MARKED, positions, np.arange(frames) / 50, Fraction(50), "m", "+y", "lip")


def mapping() -> MarkerMapping:
    bound = small_head().bound
    return MarkerMapping(
        {name: VirtualMarker(int(bound[point_rows()[name]]), 0.02, 0.02, name in FIXED) for name in MARKED}
    )


def test_shapes_weights_and_turns(tmp_path: Path) -> None:
    moved = tmp_path / "moved.glb"
    head = head_of_model(small_head())
    shown = move_head(capture(), head, mapping())
    write_moved_head(moved, shown)
    data = moved.read_bytes()
    size = struct.unpack("<I", data[12:16])[0]
    document, body = json.loads(data[20 : 20 + size]), data[28 + size :]

    def numbers(index: int) -> np.ndarray:
        entry = document["accessors"][index]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[entry["type"]]
        result = np.zeros((entry["count"], width), np.float32)
        if "bufferView" in entry:
            result = block(entry["bufferView"], entry.get("byteOffset", 0), "<f4", result.size).reshape(
                -1, width
            )
        if "sparse" in entry:
            sparse = entry["sparse"]
            kind = {5123: "<u2", 5125: "<u4"}[sparse["indices"]["componentType"]]
            rows = block(
                sparse["indices"]["bufferView"], sparse["indices"].get("byteOffset", 0), kind, sparse["count"]
            )
            values = sparse["values"]
            result = result.copy()
            result[rows] = block(
                values["bufferView"], values.get("byteOffset", 0), "<f4", sparse["count"] * width
            ).reshape(-1, width)
        return result

    def block(view: int, offset: int, kind: str, count: int) -> np.ndarray:
        start = document["bufferViews"][view].get("byteOffset", 0) + offset
        return np.frombuffer(body, kind, count, start)

    node = next(number for number, one in enumerate(document["nodes"]) if one["name"] == "skin")
    primitive = document["meshes"][document["nodes"][node]["mesh"]]["primitives"][0]
    channels = {
        (one["target"]["node"], one["target"]["path"]): document["animations"][0]["samplers"][one["sampler"]]
        for one in document["animations"][0]["channels"]
    }
    weights = numbers(channels[node, "weights"]["output"]).reshape(20, -1)
    targets = np.stack([numbers(one["POSITION"]) for one in primitive["targets"]])
    positions = numbers(primitive["attributes"]["POSITION"]) + np.einsum("k,kvc->vc", weights[12], targets)
    expected = shown.vertices(12)[head.rows[0]] * head.metres
    np.testing.assert_allclose(positions, expected, atol=1e-6)
    assert np.abs(positions - numbers(primitive["attributes"]["POSITION"])).max() > 0.007
    top = next(number for number, one in enumerate(document["nodes"]) if one["name"] == "head")
    assert document["nodes"][top]["children"]
    x, y, z, w = numbers(channels[top, "rotation"]["output"])[17]
    assert np.degrees(2 * np.arcsin(y)) == pytest.approx(np.degrees(np.arcsin(0.28)), abs=0.01)
    assert max(abs(x), abs(z)) < 1e-3
    assert w > 0.9
    np.testing.assert_allclose(
        numbers(channels[top, "rotation"]["input"])[:, 0], np.arange(20) / 50, atol=1e-6
    )
