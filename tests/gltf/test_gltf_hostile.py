"""Damaged and hostile glTF files: one clear error that names the place, soon and without much memory."""

import json
import os
import struct
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fba.errors import FbaWarning, FormatError, LimitError, ModelError
from fba.gltf import read_gltf
from fba.gltf._document import parse_document
from fba.gltf._reader import read_document
from gltf_documents import Sheet, container
from json_places import REMOVED, put


def good() -> Sheet:
    """A document with one of everything."""
    sheet = Sheet()
    primitive = sheet.triangle(material=0)
    primitive["targets"] = [{"POSITION": sheet.array(np.eye(3))}]
    primitive["attributes"] |= {
        "NORMAL": sheet.array([[0, 0, 1]] * 3),
        "TEXCOORD_0": sheet.array([[0, 0]] * 3),
        "COLOR_0": sheet.array([[1, 1, 1]] * 3),
        "JOINTS_0": sheet.array([[0, 0, 0, 0]] * 3, "u1"),
        "WEIGHTS_0": sheet.array([[1, 0, 0, 0]] * 3),
    }
    picture = sheet.bytes(b"\x89PNG\r\n\x1a\n")
    sheet.show(primitive, skin=0, children=[1])
    sheet.json["nodes"].append({})
    return sheet_with(
        sheet,
        images=[{"bufferView": picture, "mimeType": "image/png"}],
        textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        skins=[{"joints": [1], "inverseBindMatrices": sheet.array([np.eye(4).ravel()])}],
        scenes=[{"nodes": [0]}],
        scene=0,
        animations=[
            {
                "samplers": [{"input": sheet.array([0, 1]), "output": sheet.array([[0, 0, 0]] * 2)}],
                "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
            }
        ],
    )


def sheet_with(sheet: Sheet, **more: Any) -> Sheet:
    sheet.json |= more
    return sheet


def read(data: bytes) -> None:
    read_document(parse_document(data, "a.glb"))


def changed(place: str, value: Any) -> bytes:
    """The good document with one value replaced, or removed where `value` is `REMOVED`."""
    sheet = good()
    put(sheet.json, place, value)
    return sheet.glb()


PRIMITIVE = "meshes/0/primitives/0"
CASES: list[tuple[str, Any, str]] = [
    ("asset", REMOVED, "'asset' is missing"),
    ("asset/version", "1.0", r"asset\.version: is '1\.0'; only glTF 2"),
    ("bufferViews/0/byteLength", 10_000, r"bufferViews\[0\]: reaches from byte 0 to 10000"),
    ("bufferViews/0/byteOffset", -4, r"bufferViews\[0\]\.byteOffset: -4 is not within"),
    ("bufferViews/0/byteOffset", 2**62, r"bufferViews\[0\]\.byteOffset: .* is not within"),
    ("bufferViews/0/buffer", 1, r"bufferViews\[0\]\.buffer: 1 is not within 0\.\.0"),
    ("bufferViews/0/byteStride", 4, r"accessors\[0\]: elements of 12 bytes do not fit the stride"),
    ("accessors/0/count", 4, r"accessors\[0\]: 4 elements from byte 0 on need 48 bytes, but .* has 36"),
    ("accessors/0/count", 0, r"accessors\[0\]\.count: 0 is not within"),
    ("accessors/0/count", 10_000_000, r"accessors\[0\]\.count: more than the 4194304 elements that can be"),
    ("accessors/0/count", 10**400, r"accessors\[0\]\.count: more than"),
    ("accessors/0/count", True, r"accessors\[0\]\.count: expected a whole number, found True"),
    ("accessors/0/byteOffset", 8, r"accessors\[0\]: 3 elements from byte 8 on need 44 bytes"),
    ("accessors/0/componentType", 5124, r"accessors\[0\]: componentType 5124 is not one of"),
    ("accessors/0/type", "VEC2", r"attributes\.POSITION: accessors\[0\] holds VEC2 elements, but VEC3"),
    ("accessors/0/type", "MAT3", r"accessors\[0\]: type 'MAT3' is not one of"),
    ("accessors/0/bufferView", 99, r"accessors\[0\]\.bufferView: 99 is not within"),
    ("accessors/1/componentType", 5126, r"indices: accessors\[1\] must hold unsigned integers"),
    ("accessors/2/count", 2, r"targets\[0\]\.POSITION: accessors\[2\] has 2 elements, but 3 are needed"),
    ("accessors/3/count", 2, r"NORMAL: accessors\[3\] has 2 elements, but 3 are needed"),
    ("accessors/0/sparse", {"count": 9}, r"accessors\[0\]\.sparse\.count: 9 is not within 1\.\.3"),
    (PRIMITIVE + "/attributes/POSITION", 77, r"primitives\[0\]\.attributes\.POSITION: 77 is not within"),
    (PRIMITIVE + "/attributes/POSITION", REMOVED, r"attributes: 'POSITION' is missing"),
    (PRIMITIVE + "/attributes/JOINTS_0", REMOVED, "0 sets of JOINTS, but 1 of WEIGHTS"),
    (PRIMITIVE + "/material", 3, r"material: 3 is not within 0\.\.0"),
    (PRIMITIVE + "/mode", 9, r"mode: 9 is not within 0\.\.6"),
    (PRIMITIVE + "/targets", {"POSITION": 0}, r"targets: expected a list, found an object"),
    ("meshes/0/weights", [0, 0], r"meshes\[0\]\.weights: 2 weights for 1 morph targets"),
    ("meshes/0/name", 5, r"meshes\[0\]\.name: expected text, found 5"),
    ("meshes/0/name", "\ud800", "half a character"),
    ("nodes/0/mesh", 1, r"nodes\[0\]\.mesh: 1 is not within"),
    ("nodes/0/children", [0], r"nodes\[0\]: is its own ancestor"),
    ("nodes/1/children", [0], r"nodes\[0\]: is its own ancestor"),
    ("nodes/0/children", [1, 1], r"nodes\[0\]: names node 1 as a child, which is already a child"),
    ("nodes/0/rotation", [0, 0, 0, 0], r"nodes\[0\]\.rotation: is not a rotation"),
    ("nodes/0/matrix", [0] * 16, r"nodes\[0\]\.matrix: its last row"),
    ("nodes/0/scale", [1, 1], r"nodes\[0\]\.scale: expected a list of 3 numbers"),
    ("nodes/0/scale", [1, 1, 10**400], r"nodes\[0\]\.scale\[2\]: the number is too large"),
    ("scenes/0/nodes", [1], "names node 1, which is not a root: it is a child of node 0"),
    ("scene", 1, "scene: 1 is not within"),
    ("skins/0/joints", [], r"skins\[0\]\.joints: a skin needs at least one joint"),
    ("skins/0/joints", [1, 1], r"skins\[0\]\.joints: a node is listed twice"),
    ("skins/0/joints", [0, 1], r"inverseBindMatrices: 1 matrices for 2 joints"),
    ("materials/0/pbrMetallicRoughness/roughnessFactor", 2, r"roughnessFactor: 2 is not within 0\.\.1"),
    ("textures/0/source", 5, r"textures\[0\]\.source: 5 is not within"),
    ("images/0", {"uri": "data:image/png,xyz"}, r"images\[0\]\.uri: is not a data URI in base64"),
    ("images/0", {"uri": "data:image/png;base64,@"}, r"images\[0\]\.uri: the base64 .* is damaged"),
    ("animations/0/channels/0/sampler", 1, r"channels\[0\]\.sampler: 1 is not within"),
    ("animations/0/channels/0/target/path", "weights", "animates the weights of a node whose mesh"),
    ("animations/0/samplers/0/input", 0, r"samplers\[0\]\.input: accessors\[0\] holds VEC3 elements"),
    ("animations/0/samplers/0/interpolation", "CUBIC", "'CUBIC' is not one of LINEAR, STEP, CUBICSPLINE"),
]  # fmt: skip


def test_the_good_document_is_good() -> None:
    read(good().glb())


@pytest.mark.parametrize(("place", "value", "message"), CASES, ids=lambda case: str(case)[:50])
def test_the_error_names_the_place(place: str, value: Any, message: str) -> None:
    with pytest.raises(ModelError, match=rf"^a\.glb: .*{message}"):
        read(changed(place, value))


@pytest.mark.parametrize(
    ("which", "row", "message"),
    [
        (0, np.array([1, np.nan, 0], "<f4").tobytes(), r"accessors\[0\]: element 1 is \[1\.0, nan, 0\.0\]"),
        (0, np.array([np.inf, 0, 0], "<f4").tobytes(), "not finite"),
        (1, struct.pack("<H", 3), r"indices: element 1 names vertex 3, but there are 3"),
        (7, struct.pack("<4f", -1, 0, 0, 0), "a weight is negative"),
        (9, struct.pack("<f", 0), "times of the keys must increase"),
    ],
)  # fmt: skip
def test_bad_numbers_in_buffers(which: int, row: bytes, message: str) -> None:
    sheet = good()
    view = sheet.json["bufferViews"][sheet.json["accessors"][which]["bufferView"]]
    at = view["byteOffset"] + len(row)  # of element 1
    sheet.data = sheet.data[:at] + row + sheet.data[at + len(row) :]
    with pytest.raises(ModelError, match=message):
        read(sheet.glb())


@pytest.mark.parametrize(
    ("indices", "message"),
    [(b"\0\3", "names element 3, but there are 3"), (b"\1\1", "must increase"), (b"\2\1", "must increase")],
)
def test_bad_sparse_indices(indices: bytes, message: str) -> None:
    sheet = good()
    values = {"bufferView": sheet.bytes(bytes(24))}
    places = {"bufferView": sheet.bytes(indices), "componentType": 5121}
    sheet.json["accessors"][2]["sparse"] = {"count": 2, "indices": places, "values": values}
    with pytest.raises(ModelError, match=rf"accessors\[2\]\.sparse\.indices: .*{message}"):
        read(sheet.glb())


# --- containers ---------------------------------------------------------------------------------------


def test_cut_at_every_byte() -> None:
    data = good().glb()
    for end in range(len(data)):
        with pytest.raises(ModelError, match=r"^a\.glb: "):
            read(data[:end])


CONTAINERS: list[tuple[Callable[[bytes], bytes], str]] = [
    (lambda data: data[:4] + struct.pack("<I", 1) + data[8:], "this is glTF 1"),
    (lambda data: data[:8] + struct.pack("<I", 15) + data[12:15], "ends within the chunk's header"),
    (lambda data: data[:12] + struct.pack("<I", 2**32 - 1) + data[16:], "chunk 0: 4294967295 bytes long"),
    (lambda data: data[:16] + b"BIN\0" + data[20:], "chunk 0: the first chunk .* must be its JSON"),
    (lambda data: data[:20] + b"\xff" + data[21:], r"not UTF-8 text \(byte 0\)"),
    (lambda data: data[:20] + b"[" + data[21:], "JSON is damaged"),
    (lambda data: container(b"[]", b"1234"), "JSON must be an object, not list"),
    (lambda data: container(b'{"a":1,"a":2}', b"1234"), "names 'a' twice"),
    (lambda data: container(b'{"a":NaN}', b"1234"), "NaN is not a number"),
    (lambda data: container(b'{"a":-Infinity}', b"1234"), "-Infinity is not a number"),
    (lambda data: container(b'{"a":' + b"9" * 5000 + b"}", b"1234"), "JSON is damaged"),
    (lambda data: container(b'{"a":' + b"[" * 200_000, b"1234"), "nested too deeply"),
    (lambda data: container(b'{"a":' * 200_000, b"1234"), "nested too deeply"),
    (lambda data: container(b" " * (65 << 20), b"1234"), "bytes of JSON, more than the"),
    (lambda data: b"solid ascii STL", "is not glTF 2.0"),
    (lambda data: b'{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4}]}', "has no uri"),
]


@pytest.mark.parametrize(
    ("damage", "message"), CONTAINERS, ids=lambda case: case if isinstance(case, str) else ""
)
def test_damaged_containers(damage: Callable[[bytes], bytes], message: str) -> None:
    with pytest.raises(ModelError, match=rf"^a\.glb: .*{message}"):
        read(damage(good().glb()))


def test_bytes_after_the_end_are_left_aside() -> None:
    with pytest.warns(FbaWarning, match="3 bytes after the end"):
        read(good().glb() + b"abc")


# --- files --------------------------------------------------------------------------------------------


def external(folder: Path, uri: str) -> Path:
    sheet = good()
    document = sheet.json | {"buffers": [{"byteLength": len(sheet.data), "uri": uri}]}
    (folder / "a.gltf").write_text(json.dumps(document), encoding="utf-8")
    return folder / "a.gltf"


@pytest.mark.parametrize(
    "uri",
    ["../a.bin", "%2e%2e/a.bin", "b/../../a.bin", "/etc/passwd", "file:///etc/passwd", "https://x.org/a.bin",
     "C:\\a.bin", "\\\\host\\a.bin", "link.bin", "link/a.bin", "a\0.bin"],
)  # fmt: skip
def test_files_outside_the_folder_are_refused(tmp_path: Path, uri: str) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    (tmp_path / "a.bin").write_bytes(good().data)
    (folder / "link.bin").symlink_to(tmp_path / "a.bin")
    (folder / "link").symlink_to(tmp_path)
    with pytest.raises(ModelError, match=r"^a\.gltf: buffers\[0\]\.uri: .* is refused: "):
        read_gltf(external(folder, uri))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_missing_files_folders_and_pipes_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "empty").touch()
    (tmp_path / "short").write_bytes(b"1234")
    for uri, message in (
        ("missing", "'missing'.*there is no such file"),
        (".", "is a folder"),
        ("pipe", "is a pipe"),
        ("empty", "is empty"),
        ("x" * 300, "cannot be read"),
    ):
        with pytest.raises(ModelError, match=rf"buffers\[0\]\.uri: .*{message}"):
            read_gltf(external(tmp_path, uri))
    with pytest.raises(ModelError, match=r"buffers\[0\]: should have \d+ bytes, but has only 4"):
        read_gltf(external(tmp_path, "short"))
    for path in (tmp_path, tmp_path / "missing", tmp_path / "empty", tmp_path / "pipe"):
        with pytest.raises(FormatError):
            read_gltf(path)


def test_a_document_from_memory_reads_no_files() -> None:
    sheet = good()
    document = sheet.json | {"buffers": [{"byteLength": 4, "uri": "a.bin"}]}
    with pytest.raises(ModelError, match="comes from memory"):
        read(json.dumps(document).encode())


# --- small files that ask for much --------------------------------------------------------------------


def zeros(sheet: Sheet, count: int, kind: str = "VEC3") -> int:
    """An accessor of zeros that no byte of the file stands for."""
    sheet.json["accessors"].append({"componentType": 5126, "count": count, "type": kind})
    return len(sheet.json["accessors"]) - 1


def bomb_of_morph_targets() -> Sheet:
    sheet = Sheet()
    count = 999_999
    targets = [{"POSITION": zeros(sheet, count)} for _ in range(2000)]
    return sheet.show({"attributes": {"POSITION": zeros(sheet, count)}, "targets": targets})


def bomb_of_aliases() -> Sheet:
    sheet = Sheet()
    corners = sheet.array(np.zeros((30_000, 3)))
    entry = sheet.json["accessors"][corners]
    sheet.json["accessors"] = [entry] * 5000
    sheet.json["meshes"] = [{"primitives": [{"attributes": {"POSITION": n}} for n in range(5000)]}]
    return sheet


def bomb_of_skins() -> Sheet:
    sheet = Sheet()
    sheet.json |= {"nodes": [{} for _ in range(1500)], "skins": [{"joints": list(range(1500))}] * 800}
    return sheet


def bomb_of_channels() -> Sheet:
    sheet = Sheet()
    times, values = sheet.array(np.arange(50_000)), sheet.array(np.zeros((50_000, 3)))
    channel = {"sampler": 0, "target": {"node": 0, "path": "scale"}}
    sheet.json |= {
        "nodes": [{}],
        "animations": [{"samplers": [{"input": times, "output": values}], "channels": [channel] * 5000}],
    }
    return sheet


@pytest.mark.parametrize("bomb", [bomb_of_morph_targets, bomb_of_aliases, bomb_of_channels])
def test_small_files_do_not_ask_for_all_the_memory(bomb: Callable[[], Sheet]) -> None:
    data = bomb().glb()
    tracemalloc.start()
    try:
        with pytest.raises(LimitError, match="what the file unpacks to takes"):
            read(data)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 200e6 + 20 * len(data)


def test_small_files_do_not_ask_for_endless_work() -> None:
    with pytest.raises(LimitError, match="what the file unpacks to takes"):
        read(bomb_of_skins().glb())


def test_too_many_empty_entries_are_refused() -> None:
    with pytest.raises(ModelError, match=r"nodes: 300000 elements, more than the 262144 that can be read"):
        read(json.dumps({"asset": {"version": "2.0"}, "nodes": [{}] * 300_000}).encode())
