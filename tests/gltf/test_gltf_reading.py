"""What a glTF file says, as arrays: numbers follow from the description of the format."""

import base64
import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fba.errors import FbaWarning, ModelError
from fba.gltf import Primitive, read_gltf
from gltf_documents import Sheet

CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def read_primitive(sheet: Sheet, tmp_path: Path) -> Primitive:
    (mesh,) = read_gltf(sheet.save(tmp_path / "a.glb")).meshes
    (primitive,) = mesh.primitives
    return primitive


def test_a_triangle(tmp_path: Path) -> None:
    sheet = Sheet()
    primitive = read_primitive(sheet.show(sheet.triangle()), tmp_path)
    assert primitive.positions.tolist() == CORNERS
    assert (primitive.positions.dtype, primitive.triangles.dtype) == (np.float32, np.int32)
    assert primitive.triangles.tolist() == [[0, 1, 2]]
    assert not primitive.positions.flags.writeable
    assert not primitive.triangles.flags.writeable
    for name in ("normals", "colours", "joints", "material"):
        assert getattr(primitive, name) is None
    assert (primitive.texcoords, primitive.morphs) == ((), ())


def test_attributes_may_be_interleaved(tmp_path: Path) -> None:
    sheet = Sheet()
    rows = np.array([[0, 0, 0, 9, 8, 7], [1, 0, 0, 6, 5, 4], [0, 1, 0, 3, 2, 1]], dtype="<f4")
    view = sheet.bytes(rows.tobytes(), byteStride=24)
    common = {"bufferView": view, "componentType": 5126, "count": 3, "type": "VEC3"}
    sheet.json["accessors"] = [common, common | {"byteOffset": 12}]
    primitive = read_primitive(sheet.show({"attributes": {"POSITION": 0, "NORMAL": 1}}), tmp_path)
    assert primitive.positions.tolist() == CORNERS
    assert primitive.normals.tolist() == [[9, 8, 7], [6, 5, 4], [3, 2, 1]]
    assert primitive.triangles.tolist() == [[0, 1, 2]]  # no indices: as they come


@pytest.mark.parametrize(
    ("kind", "raw", "meant"),
    [
        ("u1", [0, 51, 255, 255], [0, 0.2, 1, 1]),
        ("u2", [0, 13107, 65535, 65535], [0, 0.2, 1, 1]),
        ("i1", [-128, -127, 127, 0], [-1, -1, 1, 0]),
        ("i2", [-32768, -32767, 32767, 0], [-1, -1, 1, 0]),
    ],
)
def test_scaled_integers(tmp_path: Path, kind: str, raw: list[int], meant: list[float]) -> None:
    sheet = Sheet()
    primitive = sheet.triangle()
    primitive["attributes"]["COLOR_0"] = sheet.array([raw] * 3, kind, normalized=True)
    colours = read_primitive(sheet.show(primitive), tmp_path).colours
    assert colours.tolist() == [pytest.approx(meant, abs=1e-7)] * 3


def test_plain_integers_stay_as_large_as_they_are(tmp_path: Path) -> None:
    sheet = Sheet()  # KHR_mesh_quantization: the node's scale makes metres of them
    primitive = {"attributes": {"POSITION": sheet.array([[0, 0, 0], [500, 0, 0], [0, -500, 7]], "i2")}}
    sheet.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    positions = read_primitive(sheet.show(primitive), tmp_path).positions
    assert positions.tolist() == [[0, 0, 0], [500, 0, 0], [0, -500, 7]]


def test_sparse_values_replace_those_below(tmp_path: Path) -> None:
    sheet = Sheet()
    base = sheet.array([[1, 1, 1]] * 4)
    sheet.json["accessors"][base]["sparse"] = {
        "count": 2,
        "indices": {"bufferView": sheet.bytes(b"\1\3"), "componentType": 5121},
        "values": {"bufferView": sheet.bytes(np.array([5, 6, 7, 8, 9, 10], "<f4").tobytes())},
    }
    corners = sheet.array([0, 1, 3], "u1")
    primitive = read_primitive(sheet.show({"attributes": {"POSITION": base}, "indices": corners}), tmp_path)
    assert primitive.positions.tolist() == [[1, 1, 1], [5, 6, 7], [1, 1, 1], [8, 9, 10]]
    assert primitive.triangles.tolist() == [[0, 1, 3]]


@pytest.mark.parametrize(
    ("mode", "triangles"),
    [(4, [[0, 1, 2], [3, 4, 5]]), (5, [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]]),
     (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 5, 0]])],
)  # fmt: skip
def test_lists_strips_and_fans(tmp_path: Path, mode: int, triangles: list[list[int]]) -> None:
    sheet = Sheet()
    primitive = {"attributes": {"POSITION": sheet.array(np.arange(18).reshape(6, 3))}, "mode": mode}
    assert read_primitive(sheet.show(primitive), tmp_path).triangles.tolist() == triangles


def test_points_and_lines_are_left_out(tmp_path: Path) -> None:
    sheet = Sheet()
    sheet.show(sheet.triangle(mode=1))
    with pytest.warns(FbaWarning, match=r"a\.glb: meshes\[0\]\.primitives\[0\]: points or lines"):
        (mesh,) = read_gltf(sheet.save(tmp_path / "a.glb")).meshes
    assert mesh.primitives == ()


def test_morph_targets_have_the_names_of_the_extras(tmp_path: Path) -> None:
    sheet = Sheet()
    sparse = {
        "count": 1,
        "indices": {"bufferView": sheet.bytes(b"\2\0"), "componentType": 5123},
        "values": {"bufferView": sheet.bytes(np.array([0, 0, 4], "<f4").tobytes())},
    }
    accessor = {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse}
    sheet.json["accessors"].append(accessor)
    sheet.show(sheet.triangle(targets=[{"POSITION": 0}, {"NORMAL": 0}]))
    mesh: dict[str, Any] = sheet.json["meshes"][0]
    for holder in (mesh, mesh["primitives"][0]):
        holder["extras"] = {"targetNames": ["jawOpen", "mouthClose"]}
        (found,) = read_gltf(sheet.save(tmp_path / "a.glb")).meshes
        assert found.morph_names == ("jawOpen", "mouthClose")
        del holder["extras"]
    mesh["weights"] = [0.25, 1]
    (found,) = read_gltf(sheet.save(tmp_path / "a.glb")).meshes
    assert (found.morph_names, found.weights) == (("target 0", "target 1"), (0.25, 1.0))
    first, second = found.primitives[0].morphs
    assert first.tolist() == [[0, 0, 0], [0, 0, 0], [0, 0, 4]]
    assert second is None
    mesh["extras"] = {"targetNames": ["one"]}
    with pytest.warns(FbaWarning, match="1 names for 2 morph targets"):
        read_gltf(sheet.save(tmp_path / "a.glb"))


def test_transforms_of_nodes(tmp_path: Path) -> None:
    half = 0.5**0.5
    sheet = Sheet()
    sheet.json["nodes"] = [
        {
            "children": [2],
            "name": "arm",
            "translation": [10, 0, 0],
            "rotation": [0, 0, half, half],
            "scale": [2] * 3,
        },
        {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1]},  # column by column
        {"translation": [1, 0, 0]},
    ]
    gltf = read_gltf(sheet.save(tmp_path / "a.glb"))
    arm, moved, hand = gltf.nodes
    # a quarter turn about z takes x to y; sizes double; then 10 along x
    assert (arm.world @ [1, 0, 0, 1]).tolist() == pytest.approx([10, 2, 0, 1])
    assert (hand.world @ [1, 0, 0, 1]).tolist() == pytest.approx([10, 4, 0, 1])
    assert (moved.world @ [0, 0, 0, 1]).tolist() == [7, 8, 9, 1]
    assert (arm.parent, arm.children, hand.parent, moved.translation) == (None, (2,), 0, None)
    assert (arm.name, moved.name) == ("arm", "node 1")
    assert gltf.roots == (0, 1)  # no scene: all that have no parent
    assert gltf.order.index(0) < gltf.order.index(2)
    sheet.json |= {"scenes": [{"nodes": [1]}, {"nodes": [0]}], "scene": 1}
    gltf = read_gltf(sheet.save(tmp_path / "a.glb"))
    assert (gltf.roots, gltf.shown()) == ((0,), (0, 2))


def test_the_last_row_of_a_matrix_may_be_rounded_but_not_wrong(tmp_path: Path) -> None:
    sheet = Sheet()
    rows = [1, 0, 0, 1e-7, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 0.9999999999999999]
    sheet.json["nodes"] = [{"matrix": rows}]
    gltf = read_gltf(sheet.save(tmp_path / "a.glb"))
    assert gltf.nodes[0].world.tolist() == [[1, 0, 0, 7], [0, 1, 0, 8], [0, 0, 1, 9], [0, 0, 0, 1]]
    sheet.json["nodes"] = [{"matrix": [*rows[:15], 1.00001]}]
    with pytest.raises(ModelError, match="last row"):
        read_gltf(sheet.save(tmp_path / "a.glb"))


def test_skins(tmp_path: Path) -> None:
    sheet = Sheet()
    primitive = sheet.triangle()
    primitive["attributes"] |= {
        "JOINTS_0": sheet.array([[1, 0, 0, 0]] * 3, "u1"),
        "WEIGHTS_0": sheet.array([[255, 0, 0, 0]] * 3, "u1", normalized=True),
    }
    matrix = np.eye(4)
    matrix[:3, 3] = 1, 2, 3
    sheet.show(primitive, skin=0)
    sheet.json["nodes"] += [{}, {}]
    bind = sheet.array([np.eye(4).T.ravel(), matrix.T.ravel()])
    sheet.json["skins"] = [{"joints": [1, 2], "inverseBindMatrices": bind, "name": "rig"}]
    gltf = read_gltf(sheet.save(tmp_path / "a.glb"))
    (skin,) = gltf.skins
    assert (skin.name, skin.joints) == ("rig", (1, 2))
    assert skin.inverse_bind.tolist() == [np.eye(4).tolist(), matrix.tolist()]
    found = gltf.meshes[0].primitives[0]
    assert (found.joints[0].tolist(), found.weights[0].tolist()) == ([1, 0, 0, 0], [1, 0, 0, 0])
    sheet.json["nodes"][0] |= {"skin": 0}
    sheet.json["skins"][0] = {"joints": [1]}
    with pytest.raises(ModelError, match=r"nodes\[0\]: mesh 0 names joint 1, but skin 0 has 1"):
        read_gltf(sheet.save(tmp_path / "a.glb"))


def test_animations(tmp_path: Path) -> None:
    sheet = Sheet()
    sheet.show(sheet.triangle(targets=[{}, {}]))
    times, turns = sheet.array([0, 0.5]), sheet.array([[0, 0, 0, 1], [0, 1, 0, 0]])
    cubic, weights = sheet.array(np.arange(18).reshape(6, 3)), sheet.array([1, 2, 3, 4])
    samplers = [
        {"input": times, "output": turns},
        {"input": times, "output": cubic, "interpolation": "CUBICSPLINE"},
        {"input": times, "output": weights, "interpolation": "STEP"},
    ]
    targets = [("rotation", 0), ("translation", 1), ("weights", 2)]
    sheet.json["animations"] = [
        {
            "name": "wave",
            "samplers": samplers,
            "channels": [
                *({"sampler": n, "target": {"node": 0, "path": path}} for path, n in targets),
                {"sampler": 0, "target": {"path": "rotation"}},
            ],
        }
    ]
    (animation,) = read_gltf(sheet.save(tmp_path / "a.glb")).animations
    turn, shift, morph = animation.channels  # the fourth animates no node
    assert (animation.name, turn.node, turn.path, turn.interpolation) == ("wave", 0, "rotation", "LINEAR")
    assert (turn.times.tolist(), turn.values.tolist()) == ([0, 0.5], [[0, 0, 0, 1], [0, 1, 0, 0]])
    assert shift.values.tolist()[1] == [[9, 10, 11], [12, 13, 14], [15, 16, 17]]
    assert (morph.interpolation, morph.values.tolist()) == ("STEP", [[1, 2], [3, 4]])


def test_materials_and_pictures(tmp_path: Path) -> None:
    png, gif = b"\x89PNG\r\n\x1a\nrest", b"GIF89a"
    sheet = Sheet()
    sheet.show(sheet.triangle(material=1))
    sheet.json["images"] = [{"bufferView": sheet.bytes(png), "mimeType": "image/png"}, {"uri": "b.gif"}]
    (tmp_path / "b.gif").write_bytes(gif)
    sheet.json["textures"] = [{"source": 0}, {"source": 1}, {}]
    texture = {"baseColorTexture": {"index": 0, "texCoord": 1}}
    sheet.json["materials"] = [
        {},
        {
            "name": "skin",
            "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0, 1], "roughnessFactor": 0.25} | texture,
        },
    ]
    plain, skin = read_gltf(sheet.save(tmp_path / "a.glb")).materials
    assert (plain.name, plain.colour, plain.metallic, plain.roughness) == ("material 0", (1, 1, 1, 1), 1, 1)
    assert (skin.name, skin.colour, skin.roughness, skin.texcoord) == ("skin", (1, 0.5, 0, 1), 0.25, 1)
    assert (plain.texture, skin.texture) == (None, png)
    assert (skin.alpha, skin.two_sided) == (None, False)
    for number, text in ((1, "is neither PNG, JPEG nor WebP"), (2, "has no PNG, JPEG or WebP picture")):
        sheet.json["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": number}
        with pytest.warns(FbaWarning, match=text):
            assert read_gltf(sheet.save(tmp_path / "a.glb")).materials[1].texture is None


def test_pictures_in_webp(tmp_path: Path) -> None:
    """The extension's picture counts, not that for readers without it; RIFF files of other kinds do not."""
    sheet = Sheet()
    sheet.show(sheet.triangle(material=0))
    webp, wave = b"RIFF\4\0\0\0WEBP", b"RIFF\4\0\0\0WAVE"
    sheet.json["images"] = [
        {"bufferView": sheet.bytes(data), "mimeType": "image/webp"} for data in (b"\xff\xd8\xff", webp, wave)
    ]
    sheet.json["textures"] = [{"source": 0, "extensions": {"EXT_texture_webp": {"source": 1}}}]
    sheet.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    sheet.json["extensionsRequired"] = ["EXT_texture_webp"]
    assert read_gltf(sheet.save(tmp_path / "a.glb")).materials[0].texture == webp
    sheet.json["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 2
    with pytest.warns(FbaWarning, match="is neither PNG, JPEG nor WebP"):
        read_gltf(sheet.save(tmp_path / "a.glb"))


def test_alpha_of_materials(tmp_path: Path) -> None:
    sheet = Sheet()
    sheet.show(sheet.triangle(material=0))
    sheet.json["materials"] = [
        {"alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": True},
        {"alphaMode": "BLEND"},
        {"alphaMode": "OPAQUE", "doubleSided": False},
    ]
    found = read_gltf(sheet.save(tmp_path / "a.glb")).materials
    assert [(each.alpha, each.cutoff, each.two_sided) for each in found] == [
        ("mask", 0.25, True),
        ("blend", 0.5, False),
        ("opaque", 0.5, False),
    ]
    sheet.json["materials"][1]["alphaMode"] = "GLASS"
    with pytest.raises(ModelError, match=r"materials\[1\]\.alphaMode.*GLASS"):
        read_gltf(sheet.save(tmp_path / "a.glb"))


def test_text_documents_with_buffers_elsewhere(tmp_path: Path) -> None:
    sheet = Sheet()
    sheet.show(sheet.triangle())
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mesh 1.bin").write_bytes(sheet.data + b"more than is needed")
    inline = "data:application/octet-stream;base64," + base64.b64encode(sheet.data).decode()
    for uri in ("parts/mesh%201.bin", "./parts/../parts/mesh 1.bin", inline):
        document = sheet.json | {"buffers": [{"byteLength": len(sheet.data), "uri": uri}]}
        (tmp_path / "a.gltf").write_text(json.dumps(document), encoding="utf-8")
        gltf = read_gltf(tmp_path / "a.gltf")
        assert gltf.meshes[0].primitives[0].positions.tolist() == CORNERS


def test_extensions_that_are_required(tmp_path: Path) -> None:
    sheet = Sheet()
    sheet.show(sheet.triangle())
    sheet.json["extensionsRequired"] = ["KHR_meshopt_compression"]
    with pytest.raises(ModelError, match=r"extensionsRequired\[0\]: .*meshopt.* without compression"):
        read_gltf(sheet.save(tmp_path / "a.glb"))
    sheet.json["extensionsRequired"] = ["ACME_shape"]
    with pytest.raises(ModelError, match="needs the extension ACME_shape"):
        read_gltf(sheet.save(tmp_path / "a.glb"))
    sheet.json["extensionsRequired"] = ["KHR_texture_basisu"]
    with pytest.warns(FbaWarning, match="KHR_texture_basisu cannot be read; left out"):
        read_gltf(sheet.save(tmp_path / "a.glb"))
    sheet.json["extensionsRequired"] = ["KHR_materials_unlit", "KHR_texture_transform"]
    with warnings.catch_warnings(action="error"):
        read_gltf(sheet.save(tmp_path / "a.glb"))
