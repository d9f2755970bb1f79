"""Damaged face files: a ModelError that names the place, and nothing half-loaded."""

import json
import random
import warnings
import zlib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fba.errors import FbaWarning, FormatError, LimitError, ModelError
from fba.face.gltf._reading import read_model
from fba.face.gltf._storage import build, load
from fba.face.model import FaceModel
from fba.gltf._document import join_container, parse_document, split_container
from json_places import REMOVED, put, spoil
from stored_models import assert_same, face, face_with_level


@cache
def file() -> bytes:
    return build(face()).glb()


def document() -> tuple[Any, bytes]:
    text, binary = split_container(file(), "head.glb")
    assert binary is not None
    return json.loads(bytes(text)), bytes(binary)


def read(data: bytes) -> FaceModel:
    return read_model(parse_document(data, "head.glb"))


def changed(place: str, value: Any) -> bytes:
    """The good file with one value of its JSON replaced, or removed where `value` is `REMOVED`."""
    root, binary = document()
    put(root, place, value)
    return join_container(json.dumps(root).encode(), binary)


FACE = "extensions/FBA_face"
LID = f"{FACE}/tables/1/meshes/0"
LOOP = {"source": ["raise_nose"], "destination": {"raise_nose": {}}}
CASES: list[tuple[str, Any, str]] = [
    ("extensions", REMOVED, "has no extension FBA_face, .* fba model import"),
    (FACE, [], "extensions.FBA_face: expected an object, found a list"),
    (FACE + "/version", 2, "extensions.FBA_face: has version 2, but this fba reads version 1 only"),
    (FACE + "/version", REMOVED, "extensions.FBA_face: 'version' is missing"),
    (FACE + "/name", 1, "FBA_face.name: expected text"),
    (FACE + "/notes", {"a": []}, "FBA_face.notes.a: expected text, found a list of 0"),
    (FACE + "/notes", {str(n): "" for n in range(1001)}, "FBA_face.notes: more than the 1000"),
    (FACE + "/lost", {"viseme": ""}, "FBA_face.lost.viseme: 'viseme' is not the name of a low-level FAP"),
    (FACE + "/parts", [], "FBA_face.parts: a face needs at least one part"),
    (FACE + "/parts/0/node", 99, r"FBA_face.parts\[0\].node: 99 is not within 0\.\.4"),
    (FACE + "/parts/0/node", 0, r"FBA_face.parts\[0\].node: node 0 must have a mesh"),
    (FACE + "/parts/0/node", 2, r"FBA_face.parts\[1\].node: node 2 is another part already"),
    (FACE + "/parts/0/kind", "nose", r"FBA_face.parts\[0\].kind: 'nose' is not one of skin, eye"),
    (FACE + "/parts/0/colour", [0, 0, 9], r"FBA_face.parts\[0\].colour\[2\]: 9 is not within 0\.\.1"),
    ("nodes/1/translation", [0, 0, 1], r"FBA_face.parts\[0\].node: node 1 must have no transform"),
    ("nodes/2/name", "skin", "FBA_face: two parts are named 'skin'"),
    ("nodes/2/name", "head", r"FBA_face.parts\[1\]: part 'head'"),
    (FACE + "/featurePoints", REMOVED, "FBA_face: 'featurePoints' is missing"),
    (FACE + "/featurePoints", {}, "FBA_face: FAPU: IRISD0 is nan"),
    (FACE + "/featurePoints/12.1", {}, r"FBA_face.featurePoints\['12.1'\]: there is no such"),
    (FACE + "/featurePoints/3.1/position/1", None, r"\['3.1'\].position\[1\]: expected a number"),
    (FACE + "/featurePoints/3.1/position", [0, 0], r"\['3.1'\].position: expected a list of 3 numbers"),
    (FACE + "/featurePoints/3.1/vertex", 84, r"\['3.1'\].vertex: 84 is not within 0\.\.83"),
    (FACE + "/featurePoints/3.1/vertex", 0, r"FBA_face: feature point 3\.1 is .* away from its vertex 0"),
    (FACE + "/featurePoints/3.1/part", 4, r"\['3.1'\].part: 4 is not within 0\.\.3"),
    (FACE + "/featurePoints/3.1/part", REMOVED, r"\['3.1'\]: 'part' is missing"),
    (FACE + "/featurePoints/3.5/position/0", -0.5, "FBA_face: .*3.5"),
    (FACE + "/tables/0/fap", "viseme", r"tables\[0\].fap: 'viseme' is not the name of a low-level FAP"),
    (FACE + "/tables/1/fap", "open_jaw", "FBA_face: FaceDefTables of FAP 3 open_jaw: this FAP has two"),
    (FACE + "/tables/0/meshes", [{}] * 5, r"tables\[0\].meshes: 5 elements, more than the 4"),
    (FACE + "/tables/2/transforms/0/kind", "twist", r"tables\[2\].transforms\[0\].kind: 'twist' is not one"),
    (FACE + "/tables/2/transforms/0/amount", [0, 1], r"transforms\[0\].amount: expected a list of 3"),
    (FACE + "/tables/2/transforms/0/part", 9, r"transforms\[0\].part: 9 is not within"),
    (LID + "/part", 4, r"tables\[1\].meshes\[0\].part: 4 is not within 0\.\.3"),
    (LID + "/part", 1, r"meshes\[0\].vertices: names vertices 50 to 51, but part 'left eye' has 6"),
    (LID + "/count", 3, r"meshes\[0\].vertices: bufferViews\[\d+\] does not unpack to the 3 numbers"),
    (LID + "/count", 1, r"meshes\[0\].vertices: bufferViews\[\d+\] does not unpack to the 1 numbers"),
    (LID + "/count", 85, r"tables\[1\].meshes\[0\].count: 85 is not within 0\.\.84"),
    (LID + "/count", REMOVED, r"tables\[1\].meshes\[0\]: 'count' is missing"),
    (LID + "/borders", [0], r"tables\[1\].meshes\[0\].borders: at least two borders"),
    (LID + "/borders", [1, 2, 3, 4], r"tables\[1\].meshes\[0\]: .* exactly one interval border must be 0"),
    (LID + "/borders", [0, 2, 1, 4], r"tables\[1\].meshes\[0\]: .* rising interval borders"),
    (LID + "/borders", [0, 1], r"displacements: bufferViews\[\d+\] does not unpack to the 6 numbers"),
    (LID + "/borders/0", -(2**31) - 1, r"meshes\[0\].borders\[0\]: -2147483649 is not within"),
    (LID + "/borders", [0] * 5000, r"meshes\[0\].borders: 5000 elements, more than the 4096"),
    (LID + "/vertices", 0, r"meshes\[0\].vertices: the packed numbers in bufferViews\[0\] are damaged"),
    (LID + "/vertices", 999, r"meshes\[0\].vertices: 999 is not within"),
    (LID + "/vertices", REMOVED, r"meshes\[0\]: 'vertices' is missing"),
    (LID + "/displacements", REMOVED, r"meshes\[0\]: 'displacements' is missing"),
    (FACE + "/visemes", [], r"FBA_face.visemes: 0 entries, but 14 are needed"),
    (FACE + "/visemes/0/faps", {"expression": 1}, r"visemes\[0\].faps.expression: .* not the name of"),
    (FACE + "/visemes/0/faps", {"open_jaw": 1e39}, r"visemes\[0\].faps.open_jaw: 1e\+39 is not within"),
    (FACE + "/expressions/5", 3, r"expressions\[5\]: expected an object, found 3"),
    (FACE + "/fit", {"links": 3}, "FBA_face.fit: the links of the FIT must be a list"),
    (FACE + "/fit/links", [LOOP], "FBA_face.fit: the links of the FIT form a circle"),
    (FACE + "/morphValues", {"open_jaw": "wide"}, "FBA_face.morphValues.open_jaw: expected a number"),
    ("meshes/1/primitives/0/attributes/TEXCOORD_0", REMOVED, r"parts\[1\]: its material has a texture, but"),
    ("meshes/0/primitives/0/targets/0/POSITION", 0.5, r"targets\[0\].POSITION: expected a whole number"),
]  # fmt: skip


@pytest.mark.parametrize(("place", "value", "message"), CASES, ids=[f"{p}-{m[-20:]}" for p, _, m in CASES])
def test_the_error_names_the_place(place: str, value: Any, message: str) -> None:
    with pytest.raises(ModelError, match=rf"^head\.glb: (?:.*){message}"):
        read(changed(place, value))


def test_the_good_file_is_good() -> None:
    assert_same(read(file()), face())


LEVELS: list[tuple[str, Any, str]] = [
    ("", {}, "expected a list"),
    ("", [{}] * 17, "17 elements, more than the 16"),
    ("/0/model", REMOVED, r"levels\[0\]: 'model' is missing"),
    ("/0/model", 0, "level 1: is not glTF 2.0"),
    ("/0/model", 10**6, r"levels\[0\].model: 1000000 is not within"),
    ("/0/parents", REMOVED, r"levels\[0\]: 'parents' is missing"),
    ("/0/parents", 0, r"levels\[0\].parents: "),
    ("/0/error", REMOVED, r"levels\[0\]: 'error' is missing"),
    ("/0/error", -1, "level 1: its error -1"),
]


@pytest.mark.parametrize(("place", "value", "message"), LEVELS, ids=[f"{p}-{m}" for p, _, m in LEVELS])
def test_damaged_levels_are_refused(place: str, value: Any, message: str) -> None:
    text, binary = split_container(build(face_with_level()).glb(), "head.glb")
    root = json.loads(bytes(text))
    put(root, f"{FACE}/levels{place}", value)
    assert binary is not None
    with pytest.raises(ModelError, match=rf"^head\.glb: (?:.*){message}"):
        read(join_container(json.dumps(root).encode(), bytes(binary)))


def test_levels_within_levels_are_refused_before_they_are_read() -> None:
    """Otherwise a small file could hold a long chain of models."""
    inner = face_with_level()
    builder = build(face())
    level = {"model": builder.blob(build(inner).glb()), "parents": builder.packed(inner.levels[0].parents)}
    builder.root["extensions"]["FBA_face"]["levels"] = [level]
    with pytest.raises(ModelError, match=r"head\.glb: level 1: .*a level of detail has no levels itself"):
        read(builder.glb())


def test_a_level_is_read_as_it_was_written() -> None:
    again = read(build(face_with_level()).glb())
    assert_same(again, face())
    assert_same(again.levels[0].model, face())
    np.testing.assert_array_equal(again.levels[0].parents, np.arange(len(again.vertices)))


def packed_again(which: str, content: bytes) -> bytes:
    """The good file with another stream for the numbers of its second table."""
    root, binary = document()
    view = root["bufferViews"][root["extensions"]["FBA_face"]["tables"][1]["meshes"][0][which]]
    view |= {"byteOffset": len(binary), "byteLength": len(content)}
    binary += content
    root["buffers"][0]["byteLength"] = len(binary)
    return join_container(json.dumps(root).encode(), binary)


def planes(values: list[float], kind: str) -> bytes:
    """Packed as the schema says: lowest bytes of all numbers first."""
    raw = np.array(values, kind).tobytes()
    return zlib.compress(b"".join(raw[place::4] for place in range(4)))


MOVES = [0.0] * 18
"""2 vertices, 3 intervals, 3 axes."""


@pytest.mark.parametrize(
    ("which", "content", "message"),
    [
        ("vertices", planes([50, 50], "<i4"), "vertex 50 is listed more than once"),
        ("vertices", planes([50, -1], "<i4"), "names vertices -1 to 50"),
        ("vertices", planes([50, 84], "<i4"), "names vertices 50 to 84, but part 'skin' has 84"),
        ("vertices", planes([50], "<i4"), "does not unpack to the 2 numbers"),
        ("vertices", planes([50, 51, 52], "<i4"), "does not unpack to the 2 numbers"),
        ("vertices", planes([50, 51], "<i4")[:-1], "does not unpack to the 2 numbers"),
        ("vertices", b"\x78", "does not unpack to the 2 numbers"),
        ("vertices", b"no stream", "the packed numbers in .* are damaged"),
        ("displacements", planes([*MOVES[1:], np.nan], "<f4"), "displacement of vertex 51 is not finite"),
        ("displacements", planes([*MOVES, 0], "<f4"), "does not unpack to the 18 numbers"),
        ("displacements", zlib.compress(bytes(100_000_000)), "does not unpack to the 18 numbers"),
    ],
)
def test_packed_numbers_are_checked(which: str, content: bytes, message: str) -> None:
    with pytest.raises(ModelError, match=rf"tables\[1\]\.meshes\[0\].*: .*{message}"):
        read(packed_again(which, content))


def test_packed_numbers_are_what_the_schema_says() -> None:
    moves = np.arange(18.0)  # interval by interval, axis by axis, vertex by vertex
    model = read(packed_again("displacements", planes(moves.tolist(), "<f4")))
    (mesh,) = model.tables[1].meshes
    assert mesh.vertices.tolist() == [50, 51]
    assert mesh.displacements[0].tolist() == [[0, 2, 4], [6, 8, 10], [12, 14, 16]]
    assert mesh.displacements[1].tolist() == [[1, 3, 5], [7, 9, 11], [13, 15, 17]]


def test_packed_zeros_cannot_fill_the_memory() -> None:
    root, binary = document()
    count, bomb = 200_000, zlib.compress(bytes(800_000))
    root["accessors"].append({"componentType": 5126, "count": count, "type": "VEC3"})
    root["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(bomb)})
    binary += bomb
    root["buffers"][0]["byteLength"] = len(binary)
    root["meshes"][0]["primitives"][0] = {
        "attributes": {"POSITION": len(root["accessors"]) - 1},
        "indices": root["meshes"][0]["primitives"][0]["indices"],
    }
    del root["meshes"][0]["extras"]
    view = len(root["bufferViews"]) - 1
    root["extensions"]["FBA_face"]["tables"][0]["meshes"] = [
        {"part": 0, "borders": list(range(4096)), "count": count, "vertices": view, "displacements": view}
    ]
    with pytest.raises(LimitError, match=r"tables\[0\].*: what the file unpacks to takes \d+ bytes"):
        read(join_container(json.dumps(root).encode(), binary))


def test_files_without_a_face_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "missing.glb"):
        with pytest.raises(FormatError):
            load(path)
    (tmp_path / "a.glb").write_bytes(b"no face at all")
    with pytest.raises(ModelError, match=r"^a\.glb: is not glTF 2\.0"):
        load(tmp_path / "a.glb")


# --- at random ----------------------------------------------------------------------------------------


def damaged_json(rng: random.Random) -> bytes:
    """The good file with one to three values of its JSON replaced, removed, repeated or moved."""
    root, binary = document()
    for _ in range(rng.choice([1, 1, 2, 3])):
        spoil(root, rng)
    return join_container(json.dumps(root).encode(), binary)


def damaged_bytes(rng: random.Random) -> bytes:
    """The good file with some bytes changed, cut out or put in, or its end cut off."""
    data = bytearray(file())
    for _ in range(rng.choice([1, 1, 4, 20])):
        at = rng.randrange(len(data))
        action = rng.random()
        if action < 0.6:
            data[at] = rng.randrange(256)
        elif action < 0.7:
            del data[at : at + rng.randrange(1, 50)]
        elif action < 0.8:
            data[at:at] = rng.randbytes(8)
        elif action < 0.9:
            data[at : at + 4] = rng.choice([bytes(4), b"\xff" * 4, b"\0\0\xc0\x7f", b"\0\0\x80\x7f"])
        else:
            data = data[: max(at, 1)]
    return bytes(data)


@pytest.mark.parametrize("damage", [damaged_json, damaged_bytes])
@pytest.mark.parametrize("seed", range(3))
def test_damage_is_an_error_or_another_face(damage: Any, seed: int) -> None:
    rng = random.Random(seed)
    loaded, refused = 0, set()
    for _ in range(120):
        with warnings.catch_warnings(action="error"):
            warnings.simplefilter("ignore", FbaWarning)
            try:
                model = read(damage(rng))
            except ModelError as error:
                refused.add(str(error))
                continue
        loaded += 1
        assert_same(read(build(model).glb()), model)
    assert loaded + len(refused) > 50
    assert all(text.startswith("head.glb: ") and len(text) < 1000 for text in refused)
