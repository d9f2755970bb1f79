"""Face models written and read again, and what a plain viewer finds in the file.

Faces in fewer bytes.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from fba.errors import FormatError, ModelError
from fba.face._tables import HEAD, FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.deform._deformer import Deformer
from fba.face.feature_points import neutral_points
from fba.face.gltf._storage import load
from fba.face.model import FaceModel, Material, compact
from fba.gltf import Gltf, Surface, read_gltf, surfaces
from fba.parameters import fap_numbers, faps, point_rows
from stored_models import assert_same, ball, face, models, picture


def test_a_face_comes_back_as_it_was(tmp_path: Path) -> None:
    model = face()
    model.save(tmp_path / "a.glb")
    again = FaceModel.load(tmp_path / "a.glb")
    assert_same(model, again)
    again.save(tmp_path / "b.glb")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(models())
def test_any_face_comes_back_as_it_was(tmp_path: Path, model: FaceModel) -> None:
    model.save(tmp_path / "a.glb")
    again = load(tmp_path / "a.glb")
    assert_same(model, again)
    again.save(tmp_path / "b.glb")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


# --- for plain viewers --------------------------------------------------------------------------------


def stored(model: FaceModel, tmp_path: Path) -> tuple[Gltf, dict[str, Surface]]:
    model.save(tmp_path / "a.glb")
    gltf = read_gltf(tmp_path / "a.glb")
    return gltf, {surface.name: surface for surface in surfaces(gltf)}


def test_a_viewer_shows_the_neutral_face(tmp_path: Path) -> None:
    model = face()
    gltf, shown = stored(model, tmp_path)
    assert gltf.nodes[gltf.roots[0]].name == "head"
    assert len(gltf.nodes[gltf.roots[0]].children) == len(model.parts)
    assert list(shown) == ["skin", "left eye", "right eye", "upper teeth"]
    for part in model.parts:
        surface = shown[part.name]
        assert np.array_equal(surface.positions, part.vertices)
        assert np.array_equal(surface.triangles, part.triangles)
        assert surface.normals is not None
        assert surface.normals == pytest.approx(part.normals, abs=1e-6)
        assert surface.material.texture == part.material.texture
    skin, eye = shown["skin"], shown["left eye"]
    assert np.array_equal(skin.colours, model.parts[0].colours)
    # viewers multiply colours of vertices and materials; here the former replace the latter
    assert (skin.material.colour, skin.material.roughness) == ((1, 1, 1, 1), 0.5)
    assert np.array_equal(eye.texcoords, model.parts[1].texcoords)
    assert shown["right eye"].material is eye.material


def typical(name: str) -> float:
    """Metres at weight 1: so many 1024ths of the nose's height over the mouth, or of the eye's opening."""
    steps, upper, lower = {
        "open_jaw": (800, "9.15", "2.2"),
        "close_t_l_eyelid": (1024, "3.1", "3.3"),
        "dilate_l_pupil": (300, "3.1", "3.3"),
    }[name]
    height = neutral_points()[:, 1]
    return float(height[point_rows()[upper]] - height[point_rows()[lower]]) * steps / 1024


def test_faps_are_morph_targets(tmp_path: Path) -> None:
    _, shown = stored(face(), tmp_path)
    skin = shown["skin"].morphs
    assert list(skin) == ["open_jaw", "close_t_l_eyelid", "head_yaw"]
    assert list(shown["left eye"].morphs) == ["yaw_l_eyeball", "dilate_l_pupil", "head_yaw"]
    assert list(shown["right eye"].morphs) == ["head_yaw"]
    # a straight table: displacements 1, 0.5, 0.25 along y times value x MNS
    jaw = typical("open_jaw")
    assert skin["open_jaw"][[3, 4, 9], 1].tolist() == pytest.approx([jaw, jaw / 4, jaw / 2], rel=1e-3)
    assert np.count_nonzero(skin["open_jaw"].any(axis=1)) == 3
    # the worked example of the standard at 1024: 500 x 0.9 + 524 x 1.5 = 1236, 524 x 4 = 2096
    step = typical("close_t_l_eyelid") / 1024
    lid = skin["close_t_l_eyelid"]
    assert lid[50].tolist() == pytest.approx([1236 * step, 0, 2096 * step], rel=1e-3)
    assert lid[51].tolist() == pytest.approx([(350 + 1048) * step, 0, 0], rel=1e-3)


def test_turns_are_drawn_as_straight_lines_to_where_they_lead(tmp_path: Path) -> None:
    model = face()
    _, shown = stored(model, tmp_path)
    centre = np.array([0.031, 0, -0.012])
    eye = model.parts[1].vertices - centre
    moved = shown["left eye"].morphs["yaw_l_eyeball"] + eye
    cos, sin = np.cos(0.3), np.sin(0.3)  # 30000 x 1e-5 rad about y: z turns towards x
    assert moved == pytest.approx(eye @ np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]]), abs=1e-7)
    pupil = shown["left eye"].morphs["dilate_l_pupil"] + eye
    grown = eye + np.eye(6)[1][:, None] * [0.5, 0.5, 0] * typical("dilate_l_pupil")  # the mesh moves first
    factor = 1 + typical("dilate_l_pupil")
    assert pupil == pytest.approx(grown * [factor, factor, 1], abs=1e-7)


def test_every_fap_has_a_value_that_it_can_have(tmp_path: Path) -> None:
    tables = tuple(FaceDefTables(n, (FaceDefMesh("skin", [0, 1], [0], [[(1, 0, 0)]]),)) for n in range(3, 69))
    gltf, shown = stored(face(tables=tables, lost={}), tmp_path)
    assert list(shown["skin"].morphs) == [fap.name for fap in faps()[2:]]
    values = gltf.document.data["extensions"]["FBA_face"]["morphValues"]
    for name, value in values.items():
        fap = faps()[fap_numbers()[name] - 1]
        assert fap.i_limits is not None
        low, high = (limit * fap.step for limit in fap.i_limits)
        assert low <= 0 < value <= high
        if fap.left_right_mate:
            assert values[faps()[fap.left_right_mate - 1].name] == value
        if fap.lip_mate:
            assert values[faps()[fap.lip_mate - 1].name] == value


def test_a_large_face_stays_small(tmp_path: Path) -> None:
    """15,000 vertices, 60 FAPs of 900 vertices in 4 intervals along one axis, a jaw in 6 along all."""
    rng = np.random.default_rng(0)
    sphere = rng.normal(size=(15_000, 3))
    sphere *= 0.1 / np.linalg.norm(sphere, axis=1, keepdims=True)
    base = ball("ball", "skin", np.zeros(3), Material())
    skin = replace(
        base,
        name="skin",
        vertices=sphere,
        triangles=rng.integers(0, 15_000, (30_000, 3)),
        normals=sphere,
        texcoords=rng.uniform(size=(15_000, 2)),
        colours=rng.uniform(size=(15_000, 4)),
    )
    tables = []
    for number in range(3, 69):
        if 48 <= number <= 50:
            tables.append(FaceDefTables(number, (), (FaceDefTransform(HEAD, "rotation", (0, 1, 0)),)))
            continue
        count, intervals = (4000, 6) if number == 3 else (900, 4)
        borders = np.arange(intervals + 1) * 100 - 200
        moves = rng.normal(size=(count, intervals, 3)) * ([1, 1, 1] if number == 3 else [0, 1, 0])
        vertices = np.sort(rng.choice(15_000, count, replace=False))
        tables.append(FaceDefTables(number, (FaceDefMesh("skin", borders, vertices, moves),)))
    model = face(parts=(skin,), bound=np.full(84, -1), tables=tuple(tables), lost={})
    model.save(tmp_path / "a.glb")
    assert (tmp_path / "a.glb").stat().st_size < 4_000_000
    for table, again in zip(model.tables, load(tmp_path / "a.glb").tables, strict=True):
        for mesh, same in zip(table.meshes, again.meshes, strict=True):
            assert np.array_equal(mesh.displacements, same.displacements)


# --- what cannot be written ---------------------------------------------------------------------------

UNFIT: list[tuple[dict[str, Any], str]] = [
    ({"triangles": np.zeros((0, 3), int)}, "part 'left eye' has no triangles"),
    ({"texcoords": None}, "part 'left eye' has a texture, but no texture coordinates"),
    ({"material": Material("m", (2, 0, 0))}, "part 'left eye': colour, roughness and opacity"),
    ({"material": Material("m", texture=b"GIF89a")}, "the picture 'm' is neither PNG, JPEG nor WebP"),
    ({"material": Material("\ud800")}, "half a character"),
]


@pytest.mark.parametrize(("change", "message"), UNFIT)
def test_what_a_file_cannot_hold(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    model = face()
    parts = tuple(replace(p, **change) if p.name == "left eye" else p for p in model.parts)
    (tmp_path / "a.glb").write_bytes(b"old")
    with pytest.raises(ModelError, match=message):
        replace(model, parts=parts).save(tmp_path / "a.glb")
    assert (tmp_path / "a.glb").read_bytes() == b"old"


def test_other_names_and_places(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"a\.gltf: .* name it \.glb"):
        face().save(tmp_path / "a.gltf")
    with pytest.raises(ModelError, match="note 'licence' must be a text"):
        face(notes={"licence": "x" * 70_000}).save(tmp_path / "a.glb")
    with pytest.raises(FormatError, match="is a folder"):
        face().save(tmp_path)
    huge = FaceDefMesh("skin", [0, 1], [0], [[(1e37, 0, 0)]])
    with pytest.raises(ModelError, match="FAP 3"):
        face(tables=(FaceDefTables(3, (huge,)),)).save(tmp_path / "a.glb")
    assert list(tmp_path.iterdir()) == []


def test_normals_are_made_unit() -> None:
    part = ball("ball", "eye", neutral_points()[point_rows()["3.5"]], Material(texture=picture()))
    slack = part.normals * np.float32(1.00001)
    normals = np.array([[0, 0, 2], [0, 0, 0], *slack[2:]], dtype=np.float32)
    found = replace(part, normals=normals).normals
    assert found[:2].tolist() == [[0, 0, 1], [0, 0, 1]]
    assert np.array_equal(found[2:], slack[2:])  # as good as unit: not a bit is changed


def test_a_compact_face_moves_as_before_and_takes_less(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    moves = rng.normal(size=(84, 4, 3)) * [1, 0.1, 0]
    table = FaceDefTables(3, (FaceDefMesh("skin", [-500, -100, 0, 100, 500], np.arange(84), moves),))
    model = face(tables=(table,))
    small = compact(model)
    faps = np.zeros((2, 68))
    faps[:, 2] = -1000, 1000
    # 1000 steps of 20 micrometres, wrong by half of 2**-20 of the largest, which is under 4
    assert np.abs(Deformer(small)(faps) - Deformer(model)(faps)).max() < 1000 * 25e-6 * 2**-21 * 4 + 1e-8
    colours = small.parts[0].colours
    assert colours is not None
    assert np.abs(colours - model.parts[0].colours).max() <= 0.5 / 65535 + 1e-7
    model.save(tmp_path / "a.glb")
    small.save(tmp_path / "b.glb")
    saved = (tmp_path / "a.glb").stat().st_size - (tmp_path / "b.glb").stat().st_size
    assert (
        saved > 84 * 8 + 84 * 4 * 2 * 0.25
    )  # half of the colours, and a byte of four of the moves less some
    again = load(tmp_path / "b.glb")
    assert np.array_equal(again.tables[0].meshes[0].displacements, small.tables[0].meshes[0].displacements)
    assert np.array_equal(again.parts[0].colours, colours)


def test_what_is_compact_stays_as_it_is() -> None:
    once = compact(face())
    twice = compact(once)
    for one, other in zip(once.tables, twice.tables, strict=True):
        for mesh, same in zip(one.meshes, other.meshes, strict=True):
            assert np.array_equal(mesh.displacements, same.displacements)
    # the standard's worked example has few bits: nothing is rounded
    (lid,) = once.tables[1].meshes
    (given,) = face().tables[1].meshes
    assert np.abs(lid.displacements - given.displacements).max() < 4 * 2**-20
    assert np.array_equal(once.parts[0].colours, twice.parts[0].colours)
