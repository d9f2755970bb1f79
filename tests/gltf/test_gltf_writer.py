"""Documents that the builder writes, read back by the reader, and byte by byte."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fba.errors import FormatError, ModelError
from fba.gltf import read_gltf
from fba.gltf._writer import Builder

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=np.float32)


def parsed(data: bytes) -> tuple[dict[str, Any], bytes]:
    """JSON and binary chunk, taken apart after the description of the container."""
    magic, version, length, text_length, kind = struct.unpack_from("<4sIII4s", data)
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
    document = json.loads(data[20 : 20 + text_length])
    binary_length, kind = struct.unpack_from("<I4s", data, 20 + text_length)
    binary = data[28 + text_length :]
    assert (binary_length, kind) == (len(binary), b"BIN\0")
    assert len(data) % 4 == text_length % 4 == 0
    return document, binary


def numbers(document: dict[str, Any], binary: bytes, index: int) -> np.ndarray:
    """A dense accessor, read without the project's reader."""
    entry = document["accessors"][index]
    view = document["bufferViews"][entry["bufferView"]]
    kind = {5126: "<f4", 5123: "<u2", 5125: "<u4", 5121: "u1"}[entry["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[entry["type"]]
    at = view["byteOffset"] + entry.get("byteOffset", 0)
    assert at % 4 == 0
    assert view.get("byteStride", np.dtype(kind).itemsize * width) == np.dtype(kind).itemsize * width
    return np.frombuffer(binary, kind, entry["count"] * width, at).reshape(-1, width)


def test_arrays_lie_where_the_document_says() -> None:
    builder = Builder()
    positions = builder.attribute(CORNERS, bounds=True)
    normals = builder.attribute(CORNERS[::-1])
    coordinates = builder.attribute(CORNERS[:, :2])
    joints = builder.attribute(np.array([[0, 1, 2, 3]] * 3, np.uint8))
    triangles = builder.triangles([[0, 1, 2]])
    keys = builder.data(np.linspace(0, 1, 5))
    matrices = builder.data(np.arange(32.0).reshape(2, 16))
    document, binary = parsed(builder.glb())
    for index, expected in (
        (positions, CORNERS),
        (normals, CORNERS[::-1]),
        (coordinates, CORNERS[:, :2]),
        (joints, [[0, 1, 2, 3]] * 3),
        (triangles, [[0], [1], [2]]),
        (keys, [[0], [0.25], [0.5], [0.75], [1]]),
        (matrices, np.arange(32).reshape(2, 16)),
    ):
        assert numbers(document, binary, index).tolist() == np.asarray(expected).tolist()
    assert document["accessors"][positions]["min"] == [0, 0, 0]
    assert document["accessors"][positions]["max"] == [1, 1, 0]
    assert document["buffers"] == [{"byteLength": len(binary)}]
    targets = [
        document["bufferViews"][document["accessors"][n]["bufferView"]].get("target") for n in range(7)
    ]
    assert targets == [34962] * 4 + [34963, None, None]


@pytest.mark.parametrize(("largest", "component"), [(65_534, 5123), (65_535, 5125), (70_000, 5125)])
def test_indices_take_as_few_bytes_as_they_can(largest: int, component: int) -> None:
    builder = Builder()
    builder.triangles([[0, 1, largest]])  # 65535 would start a new strip
    document, binary = parsed(builder.glb())
    assert document["accessors"][0]["componentType"] == component
    assert numbers(document, binary, 0).ravel().tolist() == [0, 1, largest]


def test_displacements_are_sparse_where_most_vertices_stay(tmp_path: Path) -> None:
    few, many, none = (np.zeros((100, 3), np.float32) for _ in range(3))
    few[[7, 40]] = (1, 2, 3), (0, 0, -4)
    many[:90] = 5
    builder = Builder()
    places = builder.attribute(np.ones((100, 3)), bounds=True)
    targets = [builder.displacements(shift) for shift in (few, many, none)]
    primitive = {"attributes": {"POSITION": places}, "indices": builder.triangles([[0, 1, 2]])}
    builder.add("meshes", {"primitives": [primitive | {"targets": [{"POSITION": n} for n in targets]}]})
    builder.save(tmp_path / "a.glb")
    document, _ = parsed((tmp_path / "a.glb").read_bytes())
    first, second, third = (document["accessors"][n] for n in targets)
    assert first["sparse"]["count"] == 2
    assert "bufferView" not in first
    assert (first["min"], first["max"]) == ([0, 0, -4], [1, 2, 3])
    assert "sparse" not in second
    assert not {"sparse", "bufferView"} & set(third)
    found = read_gltf(tmp_path / "a.glb").meshes[0].primitives[0].morphs
    for expected, morph in zip((few, many, none), found, strict=True):
        assert morph is not None
        assert np.array_equal(morph, expected)


@pytest.mark.parametrize(
    ("colours", "component", "size"),
    [
        ([[0, 0.2, 1, 1], [1, 1, 1, 1]], 5121, 8),  # 51 / 255
        ([[0, 13107 / 65535, 1, 1], [1 / 65535, 1, 1, 1]], 5123, 16),
        ([[0, 0.123, 1, 1], [1, 1, 1, 1]], 5126, 32),
        ([[0, 2, 1, 1], [1, 1, 1, 1]], 5126, 32),
    ],
)
def test_colours_take_few_bytes_only_without_loss(
    tmp_path: Path, colours: list[list[float]], component: int, size: int
) -> None:
    builder = Builder()
    shades = np.array(colours, np.float32)
    attributes = {"POSITION": builder.attribute(CORNERS[:2], bounds=True), "COLOR_0": builder.colours(shades)}
    primitive = {"attributes": attributes, "indices": builder.triangles([[0, 1, 0]])}
    builder.add("meshes", {"primitives": [primitive]})
    builder.save(tmp_path / "a.glb")
    document, _ = parsed((tmp_path / "a.glb").read_bytes())
    entry = document["accessors"][1]
    assert (entry["componentType"], entry.get("normalized", False)) == (component, component != 5126)
    assert document["bufferViews"][entry["bufferView"]]["byteLength"] == size
    found = read_gltf(tmp_path / "a.glb").meshes[0].primitives[0].colours
    assert found is not None
    assert np.array_equal(found, shades)


def test_a_picture_is_kept_once() -> None:
    builder = Builder()
    png = b"\x89PNG\r\n\x1a\n123"
    assert builder.image(png, "skin") == builder.image(png) == 0
    assert builder.image(b"\xff\xd8\xff") == 1
    with pytest.raises(ModelError, match="'hair' is neither PNG, JPEG nor WebP"):
        builder.image(b"GIF89a", "hair")
    document, binary = parsed(builder.glb())
    assert [image["mimeType"] for image in document["images"]] == ["image/png", "image/jpeg"]
    view = document["bufferViews"][0]
    assert binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]] == png


def test_textures_in_webp_need_an_extension() -> None:
    builder = Builder()
    builder.root["extensionsUsed"] = ["FBA_face"]
    plain, packed = (builder.image(data) for data in (b"\xff\xd8\xff", b"RIFF\4\0\0\0WEBP"))
    assert [builder.texture(plain), builder.texture(packed)] == [0, 1]
    document, _ = parsed(builder.glb())
    assert document["textures"] == [{"source": 0}, {"extensions": {"EXT_texture_webp": {"source": 1}}}]
    assert document["extensionsUsed"] == ["FBA_face", "EXT_texture_webp"]
    assert document["extensionsRequired"] == ["EXT_texture_webp"]


def test_what_glTF_cannot_hold() -> None:
    builder = Builder()
    with pytest.raises(TypeError, match="int64"):
        builder.attribute(np.array([[1, 2, 3]]))
    with pytest.raises(ModelError, match="1 to 4194304 elements, not 0"):
        builder.data(np.zeros((0, 3)))
    with pytest.raises(ModelError, match="1 to 4194304 elements, not 4194305"):
        builder.data(np.zeros(2**22 + 1))
    builder.root["extras"] = "\ud800"
    with pytest.raises(ModelError, match="half a character"):
        builder.glb()
    builder.root["extras"] = float("nan")
    with pytest.raises(ModelError, match="a number cannot be written"):
        builder.glb()


def test_an_old_file_stays_where_writing_fails(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(b"old")
    builder = Builder()
    builder.root["extras"] = float("inf")
    with pytest.raises(ModelError):
        builder.save(path)
    assert path.read_bytes() == b"old"
    with pytest.raises(FormatError, match="No such file"):
        Builder().save(tmp_path / "missing" / "a.glb")
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.glb"]
