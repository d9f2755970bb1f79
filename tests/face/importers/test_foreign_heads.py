"""Heads of other makers: margins of the eyes, symmetry, rows of teeth, and tables that break the rules."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from fba.errors import ModelError
from fba.face._tables import FaceDefMesh, FaceDefTables
from fba.face.authoring._shapes.morphs import add_shapes
from fba.face.authoring.regions._lids import _bulge
from fba.face.authoring.surface.surface import weld_parts
from fba.face.checks import check_faps
from fba.face.deform._deformer import Deformer
from fba.face.eyeball import eyeballs
from fba.face.feature_points import MIRRORED
from fba.face.importers import import_model
from fba.face.importers._gltf import gltf_pieces
from fba.face.importers.assembly._joining import join_pieces
from fba.face.importers.assembly._outlines import find_eye_loop, lid_points_of_loop
from fba.face.importers.assembly._pieces import assemble
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.importers.assembly._repair import _stopped, repair_tables
from fba.face.importers.assembly._symmetry import (
    asymmetry,
    mirror_faulty_lids,
    mirror_points,
    mirror_tables,
    stand_upright,
    stand_upright_by_points,
)
from fba.face.importers.assembly.model import turn_outward
from fba.face.model import FaceModel, Part
from fba.gltf import read_gltf, surfaces
from fba.parameters import point_rows
from gltf_documents import Sheet
from mesh_files import write_glb
from small_head import ball, small_head


def one(fap: int, value: float) -> np.ndarray:
    values = np.zeros(68)
    values[fap - 1] = value
    return values


def shift(model: FaceModel, fap: int, value: float) -> np.ndarray:
    deform = Deformer(model)
    return np.asarray(deform(one(fap, value)) - deform(np.zeros(68)))


def pieces_of(model: FaceModel) -> list[Piece]:
    return [Piece(part, "") for part in model.parts]


def centres(model: FaceModel) -> tuple[np.ndarray, np.ndarray]:
    eyes = eyeballs(model)
    return eyes["left"].centre, eyes["right"].centre


def test_the_margins_of_the_built_in_heads_eyes() -> None:
    head = FaceModel.default()
    surface = weld_parts(head.parts, ("skin", "mouth"))
    for side, names in (("left", ("3.1", "3.3", "3.7", "3.11")), ("right", ("3.2", "3.4", "3.8", "3.12"))):
        eye = eyeballs(head)[side]
        loop = find_eye_loop(surface, eye.centre, eye.radius)
        found = lid_points_of_loop(surface.vertices, loop, eye.centre[0])
        for vertex, name in zip(found, names, strict=True):
            away = np.linalg.norm(surface.vertices[vertex] - head.points[point_rows()[name]])
            # the inner corner has a caruncle, which a loop may go around on either side
            assert away < (0.0045 if name in ("3.8", "3.11") else 0.0015), (name, away)


def test_skin_without_an_opening_has_no_margin() -> None:
    x, y = np.meshgrid(np.linspace(-0.04, 0.04, 15), np.linspace(-0.04, 0.04, 15))
    sheet = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.02)], axis=1).astype(np.float32)
    corners = np.arange(225).reshape(15, 15)[:-1, :-1].ravel()
    triangles = np.stack([corners, corners + 1, corners + 15], axis=1).astype(np.int32)
    surface = weld_parts([Part("skin", "skin", sheet, triangles)], ("skin",))
    loop = find_eye_loop(surface, np.array([1.0, 0.0, 0.0]), 0.012)
    assert len(loop) == 0


@pytest.mark.parametrize("degrees", [2.0, -7.0])
def test_a_tilted_head_stands_upright(degrees: float) -> None:
    base = FaceModel.default()
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    tilted = [
        replace(piece, part=replace(piece.part, vertices=(piece.part.vertices @ turn.T).astype(np.float32)))
        for piece in pieces_of(base)
    ]
    left, right = (turn @ centre for centre in centres(base))
    upright, turned = stand_upright(tilted, left, right, tilted)
    assert np.degrees(turned) == pytest.approx(abs(degrees), abs=0.05)
    before, after = base.part("skin").vertices, upright[0].part.vertices
    np.testing.assert_allclose(after - after.mean(axis=0), before - before.mean(axis=0), atol=1e-4)


def test_a_lopsided_head_is_left_as_it_is() -> None:
    base = FaceModel.default()
    left, right = centres(base)
    assert asymmetry(pieces_of(base), left, right) < 0.003
    bent = []
    for piece in pieces_of(base):
        vertices = piece.part.vertices.copy()
        vertices[vertices[:, 0] > 0.01, 1] += 0.006
        bent.append(replace(piece, part=replace(piece.part, vertices=vertices)))
    assert asymmetry(bent, left, right) > 0.02
    assert stand_upright(bent, left + np.array([0, 0.006, 0]), right, bent)[1] == 0.0


def test_points_of_the_right_side_mirror_those_of_the_left() -> None:
    points = {
        "2.4": np.array([3.0, 1, 2]), "2.5": np.array([-9.0, 9, 9]),
        "9.3": np.array([1.5, 0, 4]), "8.4": np.array([-1.0, 5, 5]),
    }  # fmt: skip
    mirrored = mirror_points(points, 1.0)
    assert (mirrored["2.5"].tolist(), mirrored["9.3"].tolist()) == ([-1, 1, 2], [1, 0, 4])
    assert mirrored["8.3"].tolist() == [3, 5, 5]


def test_faps_of_both_sides_are_mirror_images() -> None:
    head = FaceModel.default()
    base = head.with_tables(tuple(head.table_of[fap] for fap in (5, 31, 32)), {})
    weak = base.table_of[32]
    halved = FaceDefTables(
        32,
        tuple(FaceDefMesh(m.part, m.borders, m.vertices, m.displacements * 0.5) for m in weak.meshes),
        (),
    )
    uneven = base.with_tables(tuple(halved if t.fap == 32 else t for t in base.tables), base.lost)
    even = mirror_tables(uneven)
    skin = base.part("skin").vertices
    twin = cKDTree(skin).query(skin * (-1, 1, 1))[1]
    count = len(skin)
    right, left = shift(even, 32, 100)[:count], shift(even, 31, 100)[:count]
    np.testing.assert_allclose(right, left[twin] * (-1, 1, 1), atol=1e-6)
    np.testing.assert_allclose(shift(even, 31, 100), shift(base, 31, 100), atol=1e-6)
    middle = shift(even, 5, -100)[:count]
    np.testing.assert_allclose(middle, middle[twin] * (-1, 1, 1), atol=1e-6)


def test_a_lid_moves_as_its_sculptor_closed_it(base: FaceModel) -> None:
    """One who turned its crease further about the eyeball."""
    centre = centres(base)[0]
    rest = Deformer(base)(np.zeros(68)).astype(float) - centre

    def turn(way: np.ndarray) -> np.ndarray:
        moved = rest + way
        return np.asarray(np.arctan2(rest[:, 1], rest[:, 2]) - np.arctan2(moved[:, 1], moved[:, 2]))

    closed = shift(base, 19, 1024)
    angle = np.where(rest[:, 2] > 0, turn(closed), 0.0)
    at_margin = angle[int(base.bound[point_rows()["3.1"]])]
    crease = (angle > 0.1 * at_margin) & (angle < 0.5 * at_margin)
    assert crease.sum() > 3
    sculpted = closed.copy()
    further = Rotation.from_rotvec(1.6 * angle[crease, None] * (1, 0, 0))
    sculpted[crease] = further.apply(rest[crease]) - rest[crease]
    start = base.starts["skin"]
    skin = sculpted[start : start + len(base.part("skin").vertices)].astype(np.float32)
    shaped = add_shapes(base, {"eyeBlink_L": {"skin": skin}})
    way = shift(shaped, 19, 1024)
    margin = int(base.bound[point_rows()["3.1"]])
    most = 0.03 * np.linalg.norm(closed, axis=1).max()
    np.testing.assert_allclose(way[margin, :2], closed[margin, :2], atol=most)
    assert 1.35 < float(np.median(turn(way)[crease] / angle[crease])) < 1.85
    np.testing.assert_allclose(shift(shaped, 20, 1024), shift(base, 20, 1024), atol=1e-6)


def test_a_lid_bulges_no_more_than_its_sculptor_wants() -> None:
    """As of drawn eyes: arcs about the ball pushed the skin over the brow."""
    values = np.array([-400.0, 0.0, 512.0, 1024.0])
    arcs = (values / 1024)[:, None, None] * np.array([(0, -9, 5), (0, -9, 1.9), (0, -9, 1), (0, -9, -4)])
    sculpted = np.array([(3, -9, -2), (3, -9, 1), (3, -9, 0), (3, -9, -2)])
    further = _bulge(arcs, sculpted, values, 1.0)
    np.testing.assert_allclose(further[:3], [[0] * 4, [0] * 4, further[3] / 2])
    np.testing.assert_allclose(further[3], [7, 0, 0, 0])


def test_tables_that_break_the_rules_are_replaced(base: FaceModel) -> None:
    table = base.table_of[33]
    sideways = FaceDefTables(
        33,
        tuple(
            FaceDefMesh(m.part, m.borders, m.vertices, m.displacements[..., [1, 0, 2]]) for m in table.meshes
        ),
        (),
    )
    wrong = base.with_tables((sideways,), {})
    assert any(f.severity == "error" for f in check_faps(wrong, [33]))
    repaired = repair_tables(wrong, base)
    assert repaired.table_of[33] is base.table_of[33]
    assert "raise_l_m_eyebrow" in repaired.notes["mesh"]


def test_a_motion_that_folds_at_its_end_stops_earlier(base: FaceModel) -> None:
    table = base.table_of[33]
    meshes = []
    for mesh in table.meshes:
        moves = mesh.displacements.copy()
        row = int(np.linalg.norm(moves, axis=2).max(axis=1).argmin())
        moves[row, -2:] = (0, 0.5, 0.5)  # one vertex shoots away beyond the last border
        meshes.append(FaceDefMesh(mesh.part, mesh.borders, mesh.vertices, moves))
    wrong = base.with_tables((FaceDefTables(33, tuple(meshes), ()),), {})
    assert any("limits" in f.rule for f in check_faps(wrong, [33]))
    lost = base.with_tables((), {33: "no brow"})
    repaired = repair_tables(wrong, lost)
    assert not any(f.severity == "error" for f in check_faps(repaired, [33]))
    np.testing.assert_allclose(shift(repaired, 33, 40), shift(base, 33, 40), atol=1e-6)


def test_hands_of_an_avatar_do_not_turn_its_head_inside_out() -> None:
    head = FaceModel.default().part("skin")
    hand = Part(
        "hands",
        "skin",
        np.array([(-0.6, -0.8, 0), (0.6, -0.8, 0), (0, -0.8, 0.9)], dtype=np.float32),
        np.array([(0, 2, 1)], dtype=np.int32),
    )
    skin = join_pieces([Piece(head), Piece(hand)], "skin", "skin")
    centre = np.array([0.0, 0.0, -0.09])
    assert turn_outward([skin], centre)[1] > 0
    assert turn_outward([skin], centre, 0.155)[1] == 0
    inside_out = replace(skin, part=replace(skin.part, triangles=skin.part.triangles[:, ::-1]))
    assert turn_outward([inside_out], centre, 0.155)[1] == len(skin.part.triangles)


def test_teeth_of_one_jaw_are_the_upper_row() -> None:
    def tooth(x: float, y: float, z: float) -> tuple[np.ndarray, np.ndarray]:
        cube = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=np.float32)
        triangles = np.array(
            [(0, 1, 2), (1, 3, 2), (4, 6, 5), (5, 6, 7), (0, 2, 4), (2, 6, 4)], dtype=np.int32
        )
        return cube * (0.004, 0.009, 0.003) + (x, y, z), triangles

    def row(heights: list[float]) -> Piece:
        vertices, triangles = [], []
        for height in heights:
            for k in range(-4, 4):
                corners, faces = tooth(0.005 * k, height - 0.001 * abs(k), -0.002 * abs(k))
                triangles.append(faces + 8 * len(vertices))
                vertices.append(corners)
        part = Part("teeth", "teeth", np.concatenate(vertices).astype(np.float32), np.concatenate(triangles))
        return Piece(part, "")

    def names(piece: Piece) -> list[str]:
        return [each.part.name for each in assemble([piece])]

    assert names(row([0.0])) == ["upper teeth"]
    assert names(row([0.0, -0.01])) == ["upper teeth", "lower teeth"]


def test_unnamed_surfaces_have_the_name_above(tmp_path: Path) -> None:
    sheet = Sheet()
    sheet.show(sheet.triangle())
    sheet.json["nodes"] = [
        {"name": "head", "children": [1]},
        {"name": "teeth", "children": [2, 3]},
        {"mesh": 0},
        {"mesh": 0, "name": "Object_7"},
        {"mesh": 0, "name": "hat"},
    ]
    found = [surface.name for surface in surfaces(read_gltf(sheet.save(tmp_path / "a.glb")))]
    assert found[0] == "hat" or "hat" in found
    assert sum(name.startswith("teeth") for name in found) == 2


def test_a_head_without_shapes_is_refused_with_what_it_lacks(base: FaceModel, tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb", base.parts, {})
    with pytest.raises(ModelError, match=r"jawOpen.*missing.*points"):
        import_model(tmp_path / "a.glb")


VRM_0 = {
    "VRM": {
        "blendShapeMaster": {
            "blendShapeGroups": [
                {"presetName": "blink_l", "binds": [{"mesh": 0, "index": 0, "weight": 100}]},
                {"presetName": "a", "binds": [{"mesh": 0, "index": 1, "weight": 100}]},
                {"presetName": "joy", "binds": [{"mesh": 0, "index": 2, "weight": 100}]},
            ]
        }
    }
}
VRM_1 = {
    "VRMC_vrm": {
        "expressions": {
            "preset": {
                "blinkLeft": {"morphTargetBinds": [{"node": 0, "index": 0, "weight": 1}]},
                "aa": {"morphTargetBinds": [{"node": 0, "index": 1, "weight": 1}]},
            }
        }
    }
}


@pytest.mark.parametrize(
    ("extension", "way", "moods"), [(VRM_0, -1.0, ["viseme aa", "mood joy"]), (VRM_1, 1.0, ["viseme aa"])]
)
def test_expressions_of_vrm_name_the_shapes(
    extension: dict[str, object], way: float, moods: list[str], tmp_path: Path
) -> None:
    sheet = Sheet()
    targets = [{"POSITION": sheet.array([(0, 0, 1 + k)] * 3)} for k in range(3)]
    sheet.show(sheet.triangle(targets=targets))
    sheet.json["extensions"] = extension
    (piece,), own = gltf_pieces(sheet.save(tmp_path / "a.vrm"))
    assert not own
    assert list(piece.morphs) == ["eyeBlinkLeft", "jawOpen", "target 2", *moods]
    assert piece.morphs["jawOpen"][0].tolist() == [0, 0, 2 * way]
    # avatars of VRM 0 look to -z: turned half around, they look to +z
    assert piece.part.vertices[1].tolist() == [way, 0, 0]


def test_an_expression_of_several_targets_is_their_sum(tmp_path: Path) -> None:
    sheet = Sheet()
    targets = [{"POSITION": sheet.array([(0, 0, 1 + k)] * 3)} for k in range(3)]
    sheet.show(sheet.triangle(targets=targets))
    binds = [{"mesh": 0, "index": 1, "weight": 100}, {"mesh": 0, "index": 2, "weight": 50}]
    groups = [{"presetName": "a", "binds": binds}]
    sheet.json["extensions"] = {"VRM": {"blendShapeMaster": {"blendShapeGroups": groups}}}
    (piece,), _ = gltf_pieces(sheet.save(tmp_path / "a.vrm"))
    assert list(piece.morphs) == ["target 0", "target 1", "target 2", "jawOpen", "viseme aa"]
    assert piece.morphs["jawOpen"][0].tolist() == [0, 0, -(2 + 3 / 2)]


def turned_points(base: FaceModel, axis: int, degrees: float, noise: float = 0.0) -> np.ndarray:
    """The feature points of a head that is turned about an axis, given by a hand that trembles."""
    turn = Rotation.from_euler("xyz"[axis], degrees, degrees=True).as_matrix()
    trembling = np.random.default_rng(7).normal(0, noise, base.points.shape)
    return np.asarray(base.points @ turn.T + trembling)


@pytest.mark.parametrize(("axis", "degrees"), [(1, 12.0), (2, -9.0), (2, 25.0)])
def test_heads_with_given_points_are_stood_upright(base: FaceModel, axis: int, degrees: float) -> None:
    _, points, angle = stand_upright_by_points([], turned_points(base, axis, degrees, 0.0005))
    assert np.degrees(angle) == pytest.approx(abs(degrees), abs=0.4)
    for left in ("3.7", "2.4", "4.5"):
        way = points[point_rows()[left]] - points[point_rows()[MIRRORED[left]]]
        assert np.degrees(np.arccos(way[0] / np.linalg.norm(way))) < 2.0


def test_points_that_tremble_turn_nothing(base: FaceModel) -> None:
    given = turned_points(base, 2, 0.5, 0.002)
    assert stand_upright_by_points([], given)[2] == 0.0
    # the points of one side, or of a face seen from behind, do not say how it is turned
    one_side = given.copy()
    one_side[[point_rows()[name] for name in MIRRORED]] = np.nan
    assert stand_upright_by_points([], one_side)[2] == 0.0
    assert stand_upright_by_points([], given * (-1, 1, -1))[2] == 0.0


def test_pieces_are_turned_with_their_points(base: FaceModel) -> None:
    turn = Rotation.from_euler("z", 10, degrees=True).as_matrix()
    skin = base.part("skin")
    shape = np.zeros_like(skin.vertices)
    shape[:, 1] = 0.01
    tilted = replace(skin, vertices=(skin.vertices @ turn.T).astype(np.float32), normals=None)
    pieces, points, _ = stand_upright_by_points(
        [Piece(tilted, morphs={"jawOpen": (shape @ turn.T).astype(np.float32)})], base.points @ turn.T
    )
    bound = base.bound[point_rows()["9.3"]]
    np.testing.assert_allclose(pieces[0].part.vertices[bound], points[point_rows()["9.3"]], atol=1e-6)
    np.testing.assert_allclose(pieces[0].morphs["jawOpen"], shape, atol=1e-5)


def test_lids_that_break_rules_are_those_of_the_other_eye() -> None:
    """The lower lid of one eye stopped half-way, where it has a few vertices more in its corner."""
    base = FaceModel.default()
    stopped = tuple(
        FaceDefTables(22, tuple(_stopped(mesh, 0.3, (1,)) for mesh in table.meshes))
        if table.fap == 22
        else table
        for table in base.tables
    )
    broken = base.with_tables(stopped, base.lost)
    before = check_faps(broken, [20, 22])
    assert any("lids meet" in finding.rule for finding in before)
    mended = mirror_faulty_lids(broken)
    assert not any("lids meet" in finding.rule for finding in check_faps(mended, [20, 22]))
    assert mended.table_of[19] is broken.table_of[19]
    assert mirror_faulty_lids(base) is base


def test_buns_of_hair_are_not_eyes() -> None:
    """Two round shells on top of a head without names are as much a pair as its eyes."""
    head = small_head(cell=0.006)
    eyes = [part for part in head.parts if part.kind == "eye"]
    buns = []
    for side in (-1, 1):
        vertices, triangles = ball(np.array([0.05 * side, 0.085, -0.03]), 0.014)
        buns.append(Part(f"shell {side}", "other", vertices, triangles))
    unnamed = [
        Piece(replace(part, name=f"mesh {number}", kind="other"))
        for number, part in enumerate([head.part("skin"), *eyes, *buns])
    ]
    found = {piece.part.name: piece.part.vertices for piece in assemble(unnamed) if piece.part.kind == "eye"}
    assert set(found) == {"left eye", "right eye"}
    for name, vertices in found.items():
        np.testing.assert_allclose(vertices.mean(axis=0), head.part(name).vertices.mean(axis=0), atol=1e-6)
