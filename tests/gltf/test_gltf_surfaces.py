"""Surfaces in the frame of the scene: what a viewer would show."""

from pathlib import Path

import numpy as np
import pytest

from fba.errors import LimitError, ModelError
from fba.gltf import read_gltf, surfaces
from gltf_documents import Sheet


def test_transforms_move_positions_normals_and_morph_targets(tmp_path: Path) -> None:
    sheet = Sheet()
    primitive = sheet.triangle(targets=[{"POSITION": sheet.array([[0, 0, 0], [0, 0, 0], [1, 1, 1]])}])
    primitive["attributes"]["NORMAL"] = sheet.array([[0.6, 0.8, 0]] * 3)
    sheet.show(primitive, translation=[5, 0, 0], scale=[2, 1, 1], name="face")
    sheet.json["meshes"][0]["extras"] = {"targetNames": ["smile"]}
    (surface,) = surfaces(read_gltf(sheet.save(tmp_path / "a.glb")))
    assert (surface.name, surface.positions.tolist()) == ("face", [[5, 0, 0], [7, 0, 0], [5, 1, 0]])
    assert surface.triangles.tolist() == [[0, 1, 2]]
    assert surface.morphs["smile"].tolist() == [[0, 0, 0], [0, 0, 0], [2, 1, 1]]
    # stretched along x the surface leans towards y: (0.6 / 2, 0.8, 0), made unit
    assert surface.normals[0].tolist() == pytest.approx(np.array([0.3, 0.8, 0]) / 0.73**0.5, abs=1e-6)


def test_a_mirror_turns_triangles_round(tmp_path: Path) -> None:
    sheet = Sheet()
    primitive = sheet.triangle()
    primitive["attributes"]["NORMAL"] = sheet.array([[0, 0, 1]] * 3)
    sheet.show(primitive, scale=[-1, 1, 1])
    (surface,) = surfaces(read_gltf(sheet.save(tmp_path / "a.glb")))
    a, b, c = surface.positions[surface.triangles[0]]
    assert np.cross(b - a, c - a).tolist() == [0, 0, 1]
    assert surface.normals.tolist() == [[0, 0, 1]] * 3


def test_a_skin_replaces_the_place_of_its_node(tmp_path: Path) -> None:
    sheet = Sheet()
    primitive = sheet.triangle(targets=[{"POSITION": sheet.array([[0, 0, 1]] * 3)}])
    primitive["attributes"] |= {
        "JOINTS_0": sheet.array([[0, 1, 0, 0]] * 3, "u1"),
        "WEIGHTS_0": sheet.array([[1, 0, 0, 0], [0.25, 0.25, 0, 0], [0, 0, 0, 0]]),
    }
    sheet.show(primitive, skin=0, translation=[0, 0, 50])
    sheet.json["nodes"] += [{"translation": [10, 0, 0]}, {"translation": [0, 20, 0]}]
    sheet.json["skins"] = [{"joints": [1, 2]}]
    (surface,) = surfaces(read_gltf(sheet.save(tmp_path / "a.glb")))
    # all by the first joint; half by each, weights made to sum to 1; by none: as the node says
    assert surface.positions.tolist() == [[10, 0, 0], [6, 10, 0], [0, 1, 50]]
    assert surface.morphs["target 0"].tolist() == [[0, 0, 1]] * 3


def test_names_are_unique_and_what_the_scene_leaves_out_is_left_out(tmp_path: Path) -> None:
    sheet = Sheet()
    sheet.show(sheet.triangle(), name="eye")
    sheet.json["meshes"][0]["name"] = "ball"
    sheet.json["nodes"] += [{"mesh": 0, "name": "eye"}, {"mesh": 0}, {"mesh": 0, "name": "hidden"}]
    sheet.json |= {"scenes": [{"nodes": [0, 1, 2]}]}
    found = surfaces(read_gltf(sheet.save(tmp_path / "a.glb")))
    assert [(surface.name, surface.node) for surface in found] == [("eye", 0), ("eye 2", 1), ("ball", 2)]


def test_texture_coordinates_are_those_that_the_material_uses(tmp_path: Path) -> None:
    sheet = Sheet()
    primitive = sheet.triangle(material=0)
    for number in range(2):
        primitive["attributes"][f"TEXCOORD_{number}"] = sheet.array([[number, 0.5]] * 3)
    png = sheet.bytes(b"\x89PNG\r\n\x1a\n")
    sheet.show(primitive).json |= {
        "images": [{"bufferView": png, "mimeType": "image/png"}],
        "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1}}}],
    }
    (surface,) = surfaces(read_gltf(sheet.save(tmp_path / "a.glb")))
    assert surface.texcoords.tolist() == [[1, 0.5]] * 3


def test_a_mesh_shown_too_often_is_refused(tmp_path: Path) -> None:
    sheet = Sheet()
    corners = np.zeros((20_000, 3))
    sheet.show({"attributes": {"POSITION": sheet.array(corners)}, "indices": sheet.array([0, 1, 2], "u2")})
    sheet.json["nodes"] *= 1000
    gltf = read_gltf(sheet.save(tmp_path / "a.glb"))
    with pytest.raises(LimitError, match="what the file unpacks to takes"):
        surfaces(gltf)


def test_transforms_that_overflow_are_refused(tmp_path: Path) -> None:
    sheet = Sheet()
    sheet.show(sheet.triangle(), scale=[1e90, 1, 1])
    with pytest.raises(ModelError, match=r"nodes\[0\]: positions overflow"):
        surfaces(read_gltf(sheet.save(tmp_path / "a.glb")))
    sheet.json["nodes"] = [{"mesh": 0, "scale": [1e90, 1, 1]}, {"children": [0], "scale": [1e90, 1, 1]}]
    with pytest.raises(ModelError, match=r"nodes\[0\]: the transform to the scene overflows"):
        read_gltf(sheet.save(tmp_path / "a.glb"))
