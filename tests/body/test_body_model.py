"""Body models: what is checked, files, damaged files, and the built-in person.

And what the official glTF validator says of files.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fba.body import BapSolver, BodyModel, BodyPart, Skeleton
from fba.body._storage import build, read_body
from fba.errors import FormatError, ModelError
from fba.gltf._document import join_container, parse_document, split_container
from fba.gltf._reader import read_document
from fba.gltf._surfaces import surfaces
from fba.parameters import joints
from gltf_validator import assert_valid
from json_places import REMOVED, put
from small_bodies import random_pose, rod


def assert_same(one: BodyModel, other: BodyModel) -> None:
    assert (one.name, one.notes) == (other.name, other.notes)
    assert one.skeleton.names == other.skeleton.names
    np.testing.assert_array_equal(one.skeleton.parents, other.skeleton.parents)
    np.testing.assert_allclose(one.skeleton.centres, other.skeleton.centres, atol=1e-12)
    np.testing.assert_allclose(one.bind, other.bind, atol=1e-12)
    np.testing.assert_array_equal(one.eyes, other.eyes)  # type: ignore[arg-type]
    assert [(p.name, p.kind, p.material) for p in one.parts] == [
        (p.name, p.kind, p.material) for p in other.parts
    ]
    for a, b in zip(one.parts, other.parts, strict=True):
        for key in ("vertices", "triangles", "joints", "normals", "colours", "texcoords"):
            mine, theirs = getattr(a, key), getattr(b, key)
            assert (mine is None) == (theirs is None), key
            if mine is not None:
                np.testing.assert_array_equal(mine, theirs, err_msg=key)
        np.testing.assert_allclose(a.weights, b.weights, atol=1e-7)


# --- the built-in person


def test_the_built_in_person() -> None:
    body = BodyModel.default()
    assert body is BodyModel.default()
    assert set(body.skeleton.names) == {joint.name for joint in joints()}
    worn = [part for part in body.parts if part.kind != "neck"]
    assert 5_000 <= sum(len(part.vertices) for part in worn) <= 20_000
    assert {part.kind for part in worn} == {"skin", "cloth", "shoe"}
    size = (files("fba.body.builtin") / "body.glb").read_bytes()
    assert len(size) < 1_600_000
    assert "Apache" in body.notes["licence"]


def test_it_has_the_size_of_a_person_and_stands_on_the_ground() -> None:
    body = BodyModel.default()
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    posture = body.skin(BapSolver(body.skeleton).pose(np.zeros(296)))
    assert posture[:, 1].min() == pytest.approx(0, abs=1e-3)
    assert body.eyes[:, 1] == pytest.approx(1.65, abs=0.03)
    assert high[1] < body.eyes[0, 1]  # no head
    assert 1.2 < high[0] - low[0] < 1.4  # arms held off the sides


def test_it_is_symmetric() -> None:
    body = BodyModel.default()
    away, mate = cKDTree(body.vertices).query(body.vertices * (-1, 1, 1))
    assert away.max() < 2e-3
    assert np.quantile(away, 0.99) < 1e-4
    other = {"l_": "r_", "r_": "l_"}
    mirrored = [body.skeleton.number(other.get(n[:2], n[:2]) + n[2:]) for n in body.skeleton.names]
    dense = np.zeros((len(body.vertices), len(body.skeleton)))
    for slot in range(4):
        np.add.at(dense, (np.arange(len(dense)), body.joints[:, slot]), body.weights[:, slot])
    unlike = np.abs(dense[mate] - dense[:, mirrored]).max(axis=1)
    assert np.quantile(unlike, 0.99) < 0.02


def test_weights_are_whole_and_smooth() -> None:
    body = BodyModel.default()
    assert (body.weights >= 0).all()
    np.testing.assert_allclose(body.weights.sum(axis=1, dtype=np.float64), 1, atol=1e-6)
    dense = np.zeros((len(body.vertices), len(body.skeleton)))
    for slot in range(4):
        np.add.at(dense, (np.arange(len(dense)), body.joints[:, slot]), body.weights[:, slot])
    corners = body.triangles
    sides = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    step = np.abs(dense[sides[:, 0]] - dense[sides[:, 1]]).sum(axis=1) / 2
    long = np.linalg.norm(body.vertices[sides[:, 0]] - body.vertices[sides[:, 1]], axis=1)
    # from one joint to another in 8 mm at least: as at the joints of thumbs
    assert (step / np.maximum(long, 0.004)).max() < 125


def test_every_part_of_the_body_moves_it() -> None:
    body = BodyModel.default()
    carried = {body.skeleton.names[joint] for joint in np.unique(body.joints[body.weights > 0.05])}
    for name in ("l_elbow", "r_wrist", "l_index2", "r_thumb1", "l_knee", "r_metatarsal", "vl3", "skullbase"):
        assert name in carried


# --- what is checked


def part(**changes: Any) -> BodyPart:
    return replace(rod().parts[1], **changes)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: part(name=""), "needs a name"),
        (lambda: part(kind="nose"), "part 'sleeve': its kind 'nose' is not one of skin, neck, head"),
        (lambda: part(vertices=np.zeros((3, 2))), "part 'sleeve': vertices must have shape"),
        (lambda: part(triangles=[[0, 1, 99]]), "part 'sleeve': triangle 0 names vertex"),
        (
            lambda: part(joints=np.zeros((1, 4), int)),
            r"part 'sleeve': joints must be whole numbers, \(40, 4\)",
        ),
        (lambda: part(joints=np.zeros((40, 4))), "part 'sleeve': joints must be whole numbers"),
        (lambda: part(joints=np.full((40, 4), -1)), "part 'sleeve': joint numbers must not be negative"),
        (lambda: part(weights=np.ones((40, 4))), "part 'sleeve': the weights of vertex 0, .* a sum of 1"),
        (lambda: part(weights=np.full((40, 4), np.nan)), "part 'sleeve': the weights of vertex 0"),
        (lambda: part(weights=np.tile([2.0, -1, 0, 0], (40, 1))), "part 'sleeve': the weights of vertex 0"),
        (lambda: part(weights=np.ones((40, 2))), r"part 'sleeve': weights must have shape \(40, 4\)"),
        (lambda: replace(rod(), parts=()), "at least one part"),
        (lambda: replace(rod(), parts=rod().parts[:1] * 2), "two parts of the body are named 'rod'"),
        (lambda: replace(rod(), bind=np.zeros((3, 4, 4))), "the bind matrix of 'root' must be a rotation"),
        (
            lambda: replace(rod(), bind=np.full((3, 4, 4), np.inf)),
            "the bind matrix of 'root' must be a rotation",
        ),
        (
            lambda: replace(rod(), bind=np.tile(np.diag([-1.0, 1, 1, 1]), (3, 1, 1))),
            "must be a rotation and a position, not ",
        ),
        (lambda: replace(rod(), bind=np.eye(4)), r"must have shape \(3, 4, 4\)"),
        (lambda: replace(rod(), eyes=np.zeros((2, 3))), "the pupils must be two finite positions"),
        (lambda: replace(rod(), eyes=np.full((2, 3), np.nan)), "the pupils must be two finite positions"),
        (
            lambda: replace(rod(), skeleton=Skeleton(("a",), np.array([-1]), np.zeros((1, 3)))),
            "part 'rod': names joint 2, but the skeleton has 1",
        ),
    ],
)
def test_what_is_wrong_is_named(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        make()


def test_arrays_are_copies_and_read_only() -> None:
    body = rod()
    for array in (body.bind, body.vertices, body.weights, body.joints, body.triangles, body.parts[0].weights):
        assert not array.flags.writeable
    with pytest.raises(ModelError, match="no part 'hat'; there are rod, sleeve"):
        body.part("hat")


# --- files


@pytest.mark.parametrize("make", [rod, BodyModel.default], ids=["small", "built-in"])
def test_a_file_gives_the_same_body_again(tmp_path: Path, make: Callable[[], BodyModel]) -> None:
    body = make()
    body.save(tmp_path / "a.glb")
    again = BodyModel.load(tmp_path / "a.glb")
    assert_same(body, again)
    matrices = random_pose(body, 2)
    np.testing.assert_allclose(again.skin(matrices), body.skin(matrices), atol=1e-5)
    again.save(tmp_path / "b.glb")
    assert_same(again, BodyModel.load(tmp_path / "b.glb"))


def test_other_programs_see_the_same() -> None:
    """By the reader of plain glTF: nodes, skin and weights, nothing of the extension."""
    body = rod()
    gltf = read_document(parse_document(build(body).glb(), "rod.glb"))
    skin = gltf.skins[0]
    assert [gltf.nodes[node].name for node in skin.joints] == list(body.skeleton.names)
    for node, matrix in zip(skin.joints, body.bind, strict=True):
        np.testing.assert_allclose(gltf.nodes[node].world, matrix, atol=1e-9)
    shown = surfaces(gltf)
    assert [surface.name for surface in shown] == ["rod", "sleeve"]
    for surface, part_ in zip(shown, body.parts, strict=True):
        np.testing.assert_allclose(surface.positions, part_.vertices, atol=1e-6)


def test_unturned_joints_are_the_default_posture() -> None:
    body = BodyModel.default()
    gltf = read_document(parse_document(build(body).glb(), "body.glb"))
    place: dict[int, np.ndarray] = {}
    for node in gltf.order:
        if node in gltf.skins[0].joints:
            shown = gltf.nodes[node]
            assert shown.translation is not None
            place[node] = shown.translation + (0 if shown.parent is None else place[shown.parent])
    found = np.array([place[node] for node in gltf.skins[0].joints])
    np.testing.assert_allclose(found, body.skeleton.centres, atol=1e-12)


def test_joints_in_another_order() -> None:
    """Files by other hands: the skin may list its joints in any order."""
    text, binary = split_container(build(rod()).glb(), "rod.glb")
    root = json.loads(bytes(text))
    assert binary is not None
    data = bytearray(binary)
    order = [2, 0, 1]
    root["skins"][0]["joints"] = order
    view = root["bufferViews"][root["accessors"][root["skins"][0]["inverseBindMatrices"]]["bufferView"]]
    start = view["byteOffset"]
    matrices = np.frombuffer(bytes(data[start : start + 192]), "<f4").reshape(3, 16)[order]
    data[start : start + 192] = matrices.tobytes()
    for mesh in root["meshes"]:
        accessor = root["accessors"][mesh["primitives"][0]["attributes"]["JOINTS_0"]]
        view = root["bufferViews"][accessor["bufferView"]]
        start = view["byteOffset"] + accessor.get("byteOffset", 0)
        size = accessor["count"] * 4
        joints_ = np.frombuffer(bytes(data[start : start + size]), np.uint8)
        data[start : start + size] = np.array([order.index(n) for n in range(3)], np.uint8)[joints_].tobytes()
    again = read_body(parse_document(join_container(json.dumps(root).encode(), bytes(data)), "rod.glb"))
    matrices = random_pose(rod(), 4)
    np.testing.assert_allclose(again.skin(matrices), rod().skin(matrices), atol=1e-5)


def test_where_files_cannot_be(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"name it \.glb"):
        rod().save(tmp_path / "a.gltf")
    with pytest.raises(FormatError):
        rod().save(tmp_path / "none" / "a.glb")
    with pytest.raises(FormatError):
        BodyModel.load(tmp_path)
    empty = replace(rod().parts[0], triangles=np.zeros((0, 3), dtype=np.int32))
    with pytest.raises(ModelError, match="part 'rod' has no triangles"):
        replace(rod(), parts=(empty,)).save(tmp_path / "a.glb")
    assert not list(tmp_path.iterdir())


# --- damaged files


@cache
def file() -> bytes:
    return build(rod()).glb()


def changed(place: str, value: Any) -> bytes:
    text, binary = split_container(file(), "rod.glb")
    root = json.loads(bytes(text))
    put(root, place, value)
    assert binary is not None
    return join_container(json.dumps(root).encode(), bytes(binary))


BODY = "extensions/FBA_body"


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        ("extensions", REMOVED, "has no extension FBA_body"),
        (f"{BODY}/version", 9, "has version 9, but this fba reads version 1 only"),
        (f"{BODY}/skin", 3, r"FBA_body.skin: 3 is not within"),
        (f"{BODY}/skin", REMOVED, "'skin' is missing"),
        (f"{BODY}/parts", [], "a body needs at least one part"),
        (f"{BODY}/parts/0/node", 0, r"parts\[0\].node: must have a mesh"),
        (f"{BODY}/parts/0/kind", "nose", r"parts\[0\].kind: 'nose' is not one of"),
        (f"{BODY}/parts/1/node", 3, "two parts of the body are named 'rod'"),
        (f"{BODY}/eyes", [[0, 0, 0]], "the pupils must be two finite positions"),
        (f"{BODY}/eyes", [[0, 0, 0], [0, 0, 1e9]], r"eyes\[1\]\[2\]: .* is not within"),
        (f"{BODY}/notes", {"a": 1}, "notes.a: expected text"),
        (f"{BODY}/notes", {str(n): "" for n in range(1001)}, "more than the 1000"),
        ("nodes/1/scale", [1, 2, 1], "joint 'middle' .* has a matrix or a scale"),
        ("nodes/1/matrix", np.eye(4).ravel().tolist(), "joint 'middle' .* has a matrix or a scale"),
        ("nodes/1/translation", [0, 0.5, 0], "inverse bind matrix of joint 'middle' contradicts"),
        ("nodes/1/translation", [0, 1e30, 0], "a joint is more than"),
        ("nodes/1/name", "root", "two joints are called 'root'"),
        ("skins/0/joints", [0, 2], "names joint 2, but skin 0 has 2"),
        ("nodes/0/children", [], "the first joint|must be the root|no child|parent"),
        ("nodes/3/skin", REMOVED, r"parts\[0\].node: must use skin 0"),
        ("meshes/0/primitives/0/attributes/WEIGHTS_0", REMOVED, "sets of JOINTS"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(place: str, value: Any, message: str) -> None:
    with pytest.raises(ModelError, match=message) as caught:
        read_body(parse_document(changed(place, value), "rod.glb"))
    assert str(caught.value).startswith("rod.glb: ")


def test_vertices_without_joints() -> None:
    text, binary = split_container(file(), "rod.glb")
    root = json.loads(bytes(text))
    for key in ("JOINTS_0", "WEIGHTS_0"):
        del root["meshes"][0]["primitives"][0]["attributes"][key]
    assert binary is not None
    with pytest.raises(ModelError, match=r"parts\[0\]: its vertices have no joints"):
        read_body(parse_document(join_container(json.dumps(root).encode(), bytes(binary)), "rod.glb"))


@pytest.mark.parametrize("which", ["small", "built-in"])
def test_the_validator_finds_no_fault(tmp_path: Path, which: str) -> None:
    (rod() if which == "small" else BodyModel.default()).save(tmp_path / "a.glb")
    assert_valid(tmp_path / "a.glb", informs={"UNSUPPORTED_EXTENSION", "UNUSED_OBJECT"})
