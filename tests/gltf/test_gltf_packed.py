"""Packed geometry: meshopt's streams after the examples of its specification, Draco's by its own encoder."""

import json
import struct
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from fba.errors import LimitError, ModelError
from fba.gltf import Gltf, read_gltf
from fba.limits import Limits
from gltf_documents import Sheet

MESHOPT, DRACO = "EXT_meshopt_compression", "KHR_draco_mesh_compression"
DELTAS = bytes.fromhex("175ff0bc77a921000000")[:8] + bytes.fromhex("34b5")
"""The specification's example of sixteen differences in 4 bits each, with two that do not fit."""
MEANT = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]


def packed(sheet: Sheet, stream: bytes, count: int, stride: int, mode: str, **more: object) -> int:
    """A buffer view whose bytes are in a stream; the view itself names a buffer without bytes."""
    stored = len(sheet.data)
    sheet.data += stream + b"\0" * (-len(stream) % 4)
    extension = {"buffer": 0, "byteOffset": stored, "byteLength": len(stream), "byteStride": stride}
    extension |= {"count": count, "mode": mode, **more}
    sheet.json["bufferViews"].append(
        {"buffer": 1, "byteLength": count * stride, "extensions": {MESHOPT: extension}}
        | ({"byteStride": stride} if mode == "ATTRIBUTES" else {})
    )
    return len(sheet.json["bufferViews"]) - 1


def read(sheet: Sheet, tmp_path: Path, limits: Limits | None = None) -> Gltf:
    fallback = {"byteLength": 1 << 20, "extensions": {MESHOPT: {"fallback": True}}}
    sheet.json["buffers"] = [{"byteLength": len(sheet.data)}, fallback]
    sheet.json["extensionsRequired"] = [MESHOPT]
    path = tmp_path / "packed.glb"
    text = json.dumps(sheet.json).encode()
    text += b" " * (-len(text) % 4)
    binary = sheet.data
    chunks = (
        struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    )
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return read_gltf(path) if limits is None else read_gltf(path, limits=limits)


def attributes_stream(columns: list[bytes], first: bytes) -> bytes:
    """A stream of one group: for each byte of an element its mode and differences; the first element."""
    body = b"".join(bytes([2 if column else 0]) + column for column in columns)
    return b"\xa0" + body + first.rjust(32, b"\0")


def show(sheet: Sheet, view: int, kind: int, count: int, **more: object) -> None:
    sheet.json["accessors"] = [{"bufferView": view, "componentType": kind, "count": count, **more}]
    sheet.show({"attributes": {"POSITION": 0}})


def test_the_example_of_the_specification(tmp_path: Path) -> None:
    sheet = Sheet()
    stream = attributes_stream([DELTAS, b"", b"", b""], b"\x00\x07\x08\x09")
    view = packed(sheet, stream, 15, 4, "ATTRIBUTES")
    show(sheet, view, 5120, 15, type="VEC3")
    (mesh,) = read(sheet, tmp_path).meshes
    expected = (np.cumsum(MEANT[:15]) + 128) % 256 - 128
    assert mesh.primitives[0].positions[:, 0].tolist() == expected.tolist()
    assert (mesh.primitives[0].positions[:, 1:] == (7, 8)).all()


def test_triangles_and_indices(tmp_path: Path) -> None:
    # 0xf0 with 0x00 in the table: three new vertices; 0x00: the newest edge, (0, 2), and a new one;
    # 0x12: the edge before, (2, 3) as (3, 2), and the third newest vertex, 1; 0xff, 0xff: three read
    table = bytes(16)
    codes = bytes([0xF0, 0x00, 0x12, 0xFF]) + bytes([0xFF, 2, 1, 4])
    corners = [[0, 1, 2], [0, 2, 3], [3, 2, 1], [1, 0, 2]]
    sheet = Sheet()
    places = sheet.array(np.eye(4, 3))
    view = packed(sheet, b"\xe1" + codes + table, 12, 2, "TRIANGLES")
    sheet.json["accessors"].append({"bufferView": view, "componentType": 5123, "count": 12, "type": "SCALAR"})
    sheet.show({"attributes": {"POSITION": places}, "indices": 1})
    (mesh,) = read(sheet, tmp_path).meshes
    assert mesh.primitives[0].triangles.tolist() == corners
    # low bit: which of two counters; then a difference: +1, and +3 of the second one, then -1 of the first
    view = packed(sheet, b"\xd1" + bytes([4, 13, 2]) + bytes(4), 3, 4, "INDICES")
    sheet.json["accessors"][1] |= {"bufferView": view, "componentType": 5125, "count": 3}
    (mesh,) = read(sheet, tmp_path).meshes
    assert mesh.primitives[0].triangles.tolist() == [[1, 3, 0]]


@pytest.mark.parametrize(
    ("name", "kind", "raw", "meant"),
    [
        # x and y as shares of the third number; what they lack is z
        ("OCTAHEDRAL", 5120, struct.pack("4b", 0, 0, 15, 1), [0, 0, 127]),
        ("OCTAHEDRAL", 5120, struct.pack("4b", 15, 0, 15, 1), [127, 0, 0]),
        ("EXPONENTIAL", 5126, struct.pack("<3i", -1 << 24 | 3, 2 << 24 | 5, -7 & 0xFFFFFF), [1.5, 20, -7]),
    ],
)
def test_filters(name: str, kind: int, raw: bytes, meant: list[float], tmp_path: Path) -> None:
    sheet = Sheet()
    stream = b"\xa0" + bytes(len(raw)) + raw.rjust(32, b"\0")
    show(sheet, packed(sheet, stream, 3, len(raw), "ATTRIBUTES", filter=name), kind, 3, type="VEC3")
    (mesh,) = read(sheet, tmp_path).meshes
    assert mesh.primitives[0].positions.tolist() == [meant] * 3


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"mode": "POINTS"}, "not one of ATTRIBUTES, TRIANGLES, INDICES"),
        ({"byteStride": 6}, "which ATTRIBUTES cannot have"),
        ({"filter": "ZIGZAG"}, "'ZIGZAG' does not exist"),
        ({"byteLength": 40}, "damaged"),
        ({"byteLength": 20}, "too few"),
        ({"count": 1 << 20}, "too few"),
    ],
)
def test_damaged_streams_are_refused(change: dict[str, object], text: str, tmp_path: Path) -> None:
    sheet = Sheet()
    view = packed(sheet, attributes_stream([DELTAS] * 4, bytes(4)), 15, 4, "ATTRIBUTES")
    sheet.json["bufferViews"][view]["extensions"][MESHOPT] |= change
    show(sheet, view, 5120, 15, type="VEC3")
    with pytest.raises(ModelError, match=f"bufferViews.*{text}"):
        read(sheet, tmp_path)


def test_any_bytes_are_read_or_refused(tmp_path: Path) -> None:
    good = attributes_stream([DELTAS] * 4, bytes(4))
    other = b"\xe1" + bytes([0xF0, 0x00, 0x1F, 0xFF, 0xFE]) + bytes([0xFF, 2, 1, 4, 0x21]) + bytes(16)
    random = np.random.default_rng(7)
    refused = 0
    for round_ in range(60):
        mode, stream = (("ATTRIBUTES", good), ("TRIANGLES", other))[round_ % 2]
        noisy = bytearray(stream)
        for place in random.integers(1, len(noisy), 3):
            noisy[place] = random.integers(256)
        sheet = Sheet()
        count = 15
        view = packed(sheet, bytes(noisy), count, 4, mode)
        sheet.json["accessors"] = [{"componentType": 5126, "count": 4, "type": "VEC3"}]
        sheet.json["accessors"] += [
            {"bufferView": view, "componentType": 5125, "count": count, "type": "SCALAR"}
        ]
        sheet.show({"attributes": {"POSITION": 0}, "indices": 1})
        try:
            read(sheet, tmp_path)
        except ModelError:
            refused += 1
    assert refused > 30


def test_a_small_stream_cannot_fill_the_memory(tmp_path: Path) -> None:
    sheet = Sheet()
    count = 64 * 20_000
    stream = b"\xa0" + bytes(count * 4 // 64) + bytes(32)
    show(sheet, packed(sheet, stream, count, 4, "ATTRIBUTES"), 5120, count, type="VEC3")
    with pytest.raises(LimitError):
        read(sheet, tmp_path, Limits(bytes=1 << 22))


@pytest.mark.skipif(find_spec("DracoPy") is None, reason="DracoPy is not installed")
class TestDraco:
    def sheet(self, data: bytes, vertices: int, corners: int) -> Sheet:
        sheet = Sheet()
        view = sheet.bytes(data)
        sheet.json["accessors"] = [
            {"componentType": 5126, "count": vertices, "type": "VEC3"},
            {"componentType": 5123, "count": corners, "type": "SCALAR"},
        ]
        packing = {"bufferView": view, "attributes": {"POSITION": 0}}
        sheet.show({"attributes": {"POSITION": 0}, "indices": 1, "extensions": {DRACO: packing}})
        sheet.json["extensionsRequired"] = [DRACO]
        return sheet

    def data(self) -> bytes:
        import DracoPy

        points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5]], dtype=np.float32)
        faces = np.array([[0, 1, 2], [2, 1, 3]], dtype=np.uint32)
        encoded: bytes = DracoPy.encode(points, faces, quantization_bits=14, preserve_order=True)
        return encoded

    def test_a_mesh(self, tmp_path: Path) -> None:
        (mesh,) = read_gltf(self.sheet(self.data(), 4, 6).save(tmp_path / "a.glb")).meshes
        corners = mesh.primitives[0].positions[mesh.primitives[0].triangles]
        assert np.allclose(corners[0], [[0, 0, 0], [1, 0, 0], [0, 1, 0]], atol=1e-3)
        assert np.allclose(corners[1], [[0, 1, 0], [1, 0, 0], [1, 1, 0.5]], atol=1e-3)

    def test_other_sizes_and_damage_are_refused(self, tmp_path: Path) -> None:
        with pytest.raises(ModelError, match=r"accessors\[0\]: 5 elements .* announced"):
            read_gltf(self.sheet(self.data(), 5, 6).save(tmp_path / "a.glb"))
        with pytest.raises(ModelError, match=r"accessors\[1\]: 9 elements .* announced"):
            read_gltf(self.sheet(self.data(), 4, 9).save(tmp_path / "a.glb"))
        with pytest.raises(ModelError, match=r"bufferViews\[0\]: Draco's data are damaged"):
            read_gltf(self.sheet(self.data()[:-20], 4, 6).save(tmp_path / "a.glb"))

    def test_without_the_package_it_says_what_to_do(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        path = self.sheet(self.data(), 4, 6).save(tmp_path / "a.glb")
        monkeypatch.setitem(sys.modules, "DracoPy", None)
        with pytest.raises(ModelError, match=r'"mpeg4-fba\[draco\]"'):
            read_gltf(path)
