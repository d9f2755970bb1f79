"""OBJ, PLY, WFM and Xface meshes with feature points become faces that FAPs move."""

from pathlib import Path

import numpy as np
import pytest

from fba.errors import FbaWarning, ModelError, OptionError
from fba.face.deform._deformer import Deformer
from fba.face.importers import KINDS, import_model
from fba.face.importers.assembly._pieces import guess_kind
from fba.face.importers.assembly.model import metres_per_unit
from fba.face.model import FaceModel
from fba.parameters import fap_numbers, point_rows
from mesh_files import ply, write_obj, write_points
from small_head import small_head


@pytest.fixture(scope="module")
def head() -> FaceModel:
    return small_head(cell=0.008)


def moved(model: FaceModel, fap: str, value: float, point: str) -> np.ndarray:
    """How far a FAP moves a feature point, metres."""
    faps = np.zeros(68)
    deform = Deformer(model)
    at_rest = deform.feature_points(faps)
    faps[fap_numbers()[fap] - 1] = value
    return (deform.feature_points(faps) - at_rest)[point_rows()[point]]


@pytest.fixture(scope="module")
def imported(head: FaceModel, tmp_path_factory: pytest.TempPathFactory) -> FaceModel:
    """The small head as an OBJ in centimetres, inside out, with vertices as feature points."""
    folder = tmp_path_factory.mktemp("obj")
    write_obj(folder / "face.obj", head.parts, scale=100, flip=True)
    write_points(folder / "face.points.csv", head, scale=100)
    return import_model(folder / "face.obj")


def test_parts_get_their_kinds_from_their_names(imported: FaceModel) -> None:
    assert [(part.name, part.kind) for part in imported.parts] == [
        ("skin", "skin"),
        ("left eye", "eye"),
        ("right eye", "eye"),
        ("upper teeth", "teeth"),
        ("lower teeth", "teeth"),
        ("tongue", "tongue"),
    ]


def test_units_origin_and_points_are_those_of_the_head(imported: FaceModel, head: FaceModel) -> None:
    # the small head stands with its origin between the pupils already
    held = head.bound >= 0
    np.testing.assert_allclose(imported.points[held], head.points[held], atol=2e-6)
    skin = head.part("skin")
    used = np.unique(skin.triangles)
    np.testing.assert_allclose(imported.part("skin").vertices, skin.vertices[used], atol=2e-6)
    np.testing.assert_allclose(imported.fapu.MNS, head.fapu.MNS, rtol=1e-3)
    assert imported.notes["unit"].startswith("in centimetres")
    for name in ("2.2", "2.3", "8.3", "9.3"):
        row = point_rows()[name]
        np.testing.assert_allclose(imported.vertices[imported.bound[row]], head.points[row], atol=2e-6)


def test_triangles_are_turned_outwards(imported: FaceModel, head: FaceModel) -> None:
    assert "turned to face outwards" in imported.notes["triangles"]
    skin = imported.part("skin")
    a, b, c = (skin.vertices[skin.triangles[:, k]] for k in range(3))
    # a mask over the face: all of it looks forward or aside, as it did before it was written
    before = head.part("skin")
    p, q, r = (before.vertices[before.triangles[:, k]] for k in range(3))
    np.testing.assert_allclose(
        np.cross(b - a, c - a).sum(axis=0), np.cross(q - p, r - p).sum(axis=0), atol=1e-8
    )
    # the tip of the nose looks forward
    normal = imported.normals[imported.bound[point_rows()["9.3"]]]
    assert normal[2] > 0.5


@pytest.mark.parametrize(
    ("fap", "value", "point", "unit", "way"),
    [
        ("raise_l_m_eyebrow", 100, "4.3", "ENS", (0, 1, 0)),
        ("lower_t_midlip_o", -80, "8.1", "MNS", (0, -1, 0)),
        ("bend_nose", 100, "9.3", "ENS", (-1, 0, 0)),
        ("puff_r_cheek", 60, "5.2", "ES", (-1, 0, 0)),
    ],
)
def test_faps_move_their_points_by_the_standard(
    imported: FaceModel, fap: str, value: float, point: str, unit: str, way: tuple[float, float, float]
) -> None:
    expected = value * imported.fapu[unit] * np.array(way)
    found = moved(imported, fap, value, point)
    np.testing.assert_allclose(found, expected, atol=0.05 * np.linalg.norm(expected))


def test_the_jaw_takes_the_lower_teeth_along(imported: FaceModel) -> None:
    assert moved(imported, "open_jaw", 300, "2.1")[1] == pytest.approx(-300 * imported.fapu.MNS, rel=0.05)
    faps = np.zeros(68)
    faps[fap_numbers()["open_jaw"] - 1] = 300
    deform = Deformer(imported)
    shift = deform(faps) - deform(np.zeros(68))
    for name, least, most in (("lower teeth", 0.001, 0.01), ("upper teeth", 0.0, 1e-6)):
        start = imported.starts[name]
        fall = -shift[start : start + len(imported.part(name).vertices), 1]
        assert least <= fall.mean() <= most


def test_eyes_without_colours_get_an_iris(imported: FaceModel) -> None:
    eye = imported.part("left eye")
    front = int(eye.vertices[:, 2].argmax())
    back = int(eye.vertices[:, 2].argmin())
    assert eye.colours[front, :3].max() < 0.05
    assert eye.colours[back, :3].min() > 0.5


@pytest.mark.parametrize("order", ["ascii", "<"])
def test_ply_of_the_skin_alone_says_what_is_lost(head: FaceModel, tmp_path: Path, order: str) -> None:
    skin = head.part("skin")
    (tmp_path / "face.ply").write_bytes(ply(skin.vertices, skin.triangles.tolist(), order))
    write_points(tmp_path / "points.csv", head, vertices=False)
    model = import_model(tmp_path / "face.ply", points=tmp_path / "points.csv")
    numbers = fap_numbers()
    assert "eyeball" in model.lost[numbers["yaw_l_eyeball"]]
    assert "tongue" in model.lost[numbers["raise_tongue"]]
    expected = -100 * model.fapu.MNS
    assert moved(model, "lower_t_midlip_o", 100, "8.1")[1] == pytest.approx(expected, rel=0.05)


def test_z_up_meshes_are_stood_upright(head: FaceModel, tmp_path: Path) -> None:
    skin = head.part("skin")
    turned = np.stack([skin.vertices[:, 0], -skin.vertices[:, 2], skin.vertices[:, 1]], axis=1)
    (tmp_path / "face.ply").write_bytes(ply(turned, skin.triangles.tolist(), "<"))
    points = head.points[:, [0, 2, 1]] * (1, -1, 1)
    model = import_model(tmp_path / "face.ply", points=points, up="z")
    used = np.unique(skin.triangles)
    np.testing.assert_allclose(model.part("skin").vertices, skin.vertices[used], atol=1e-6)
    with pytest.raises(OptionError, match="up must be one of"):
        import_model(tmp_path / "face.ply", points=points, up="x")


def test_eyes_are_recognised_as_round_pairs(head: FaceModel, tmp_path: Path) -> None:
    parts = [head.part(name) for name in ("skin", "left eye", "right eye")]
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    triangles = np.concatenate([p.triangles + s for p, s in zip(parts, starts[:-1], strict=True)])
    (tmp_path / "face.ply").write_bytes(ply(vertices, triangles.tolist(), "<"))
    model = import_model(tmp_path / "face.ply", points=head.points)
    assert [part.name for part in model.of_kind("eye")] == ["left eye", "right eye"]
    np.testing.assert_allclose(
        model.part("left eye").vertices.mean(axis=0), parts[1].vertices.mean(axis=0), atol=1e-6
    )


def test_missing_and_contradicting_points(head: FaceModel, tmp_path: Path) -> None:
    write_obj(tmp_path / "face.obj", head.parts)
    with pytest.raises(ModelError, match=r"face\.points\.csv"):
        import_model(tmp_path / "face.obj")
    with pytest.raises(ModelError, match="vertex 99999999, but the mesh has"):
        import_model(tmp_path / "face.obj", points={"9.3": 99999999})
    with pytest.raises(ModelError, match=r"face\.obj: the pupils .*3\.5 and 3\.6\) are missing"):
        import_model(tmp_path / "face.obj", points={"9.3": 1, "2.1": 2})
    row = point_rows()
    few = {name: head.points[row[name]].tolist() for name in ("3.5", "3.6", "9.3", "9.15")}
    with pytest.raises(ModelError, match=r"face\.obj: .*IRISD0"):
        import_model(tmp_path / "face.obj", points=few)
    with pytest.raises(ModelError, match="must be positive"):
        import_model(tmp_path / "face.obj", points=head.points, unit=0.0)


def test_kinds_can_be_given(head: FaceModel, tmp_path: Path) -> None:
    write_obj(tmp_path / "face.obj", head.parts)
    kinds = {"tongue": "none", "upper_teeth": "other"}
    model = import_model(tmp_path / "face.obj", points=head.points, kinds=kinds, name="mine")
    assert model.name == "mine"
    assert not model.of_kind("tongue")
    assert model.part("upper_teeth").kind == "other"
    with pytest.raises(OptionError, match="is not one of skin"):
        import_model(tmp_path / "face.obj", points=head.points, kinds={"tongue": "snake"})


@pytest.mark.parametrize(
    ("names", "kind"),
    [
        (("EyeLeft",), "eye"),
        (("Wolf3D_Teeth",), "teeth"),
        (("left_eyelashes",), "lash"),
        (("Eyebrow_R",), "brow"),
        (("EyelidUpper",), "skin"),
        (("EyeOcclusion_L",), "none"),
        (("Cornea",), "none"),
        (("mesh_3", "Tongue_Mat"), "tongue"),
        (("M_GumsTongue",), "mouth"),
        (("gums_and_tongue",), "mouth"),
        (("Gums",), "teeth"),
        (("Earring",), None),
        (("pearl",), None),
        (("left_ear",), "skin"),
        (("Chat",), None),
        (("Hair_01",), "hair"),
        (("HeadMesh",), "skin"),
        (("default",), None),
    ],
)
def test_kinds_by_name(names: tuple[str, ...], kind: str | None) -> None:
    assert guess_kind(*names) == kind


@pytest.mark.parametrize(
    ("apart", "size"), [(0.063, 1.0), (0.63, 0.1), (6.3, 0.01), (63, 0.001), (2.48, 0.0254), (1.0, 0.062)]
)
def test_units_by_the_distance_of_the_pupils(apart: float, size: float) -> None:
    points = np.full((84, 3), np.nan)
    points[point_rows()["3.5"]] = (apart / 2, 0, 0)
    points[point_rows()["3.6"]] = (-apart / 2, 0, 0)
    assert metres_per_unit(points)[0] == pytest.approx(size)
    assert metres_per_unit(points, 0.5)[0] == 0.5


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.txt", b"hello"),
        ("a.fbx", b"Kaydara FBX Binary"),
        ("a.png", b"\x89PNG\r\n\x1a\n"),
        ("a.json", b"{}"),
        ("a.wrl", b"#VRML V2.0 utf8\n"),
    ],
)
def test_unknown_files_are_told_what_is_read(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ModelError, match=r"Files that can be read: MakeHuman.*glTF.*OBJ.*PLY.*Candide.*FDP"):
        import_model(tmp_path / name)


def test_folders_empty_files_and_wrong_options(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"neither MakeHuman.s base\.obj nor a face as OBJ"):
        import_model(tmp_path)
    (tmp_path / "a.obj").write_bytes(b"")
    with pytest.raises(ModelError, match="empty"):
        import_model(tmp_path / "a.obj")
    with pytest.raises(ModelError, match="no such file"):
        import_model(tmp_path / "b.obj")
    with pytest.raises(OptionError, match="kind must be one of"):
        import_model(tmp_path / "a.obj", kind="fbx")


@pytest.mark.parametrize("kind", [*KINDS])
def test_every_reader_refuses_foreign_bytes(tmp_path: Path, kind: str) -> None:
    rng = np.random.default_rng(7)
    for number, start in enumerate(
        (b"", b"glTF\x02\0\0\0", b"ply\nformat ascii 1.0\n", b"v 1 2 3\n", b"3\n", b"<xfdp>")
    ):
        file = tmp_path / f"a{number}"
        file.write_bytes(start + rng.integers(0, 256, 300, dtype=np.uint8).tobytes())
        with pytest.raises(ModelError):
            import_model(file, kind=kind, points=None)


WFM = "# a comment\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n# faces\n1\n0 1 2\n"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("4\n0", "4000000000\n0", ":2: 4000000000 vertices"),
        ("4\n0", "9\n0", ":8: three numbers are expected"),
        ("0 1 2\n", "0 1 4\n", ":9: vertex 4 does not exist; there are 4"),
        ("0 1 2\n", "0 -1 2\n", ":9: vertex"),
        ("0 1 2\n", "", "ends after 0 of 1 faces"),
        ("1 0 0\n", "1 0 inf\n", ":4: a coordinate"),
        ("4\n0", "four\n0", ":2: the number of vertices"),
    ],
)
def test_bad_wire_frames(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in WFM
    (tmp_path / "a.wfm").write_text(WFM.replace(old, new, 1))
    with pytest.raises(ModelError) as caught:
        import_model(tmp_path / "a.wfm", points={"9.3": 0})
    assert words in str(caught.value)


def test_an_fdp_file_without_a_mesh_says_so(tmp_path: Path) -> None:
    (tmp_path / "a.fdp").write_text("1.0 a\n9.3 0 0 0 0.1\n")
    with pytest.raises(ModelError, match=r"put a\.wfm, \.obj or \.ply beside it"):
        import_model(tmp_path / "a.fdp")


def test_candide_with_its_feature_points(shared: Path) -> None:
    with pytest.warns(FbaWarning) as seen:
        model = import_model(
            shared / "data/candide/candide3-ClosedMouth.wfm", points=shared / "data/candide/candide3.fdp"
        )
    assert any("(7.1, 11.1, 11.2, 11.3); the vertices are used" in str(w.message) for w in seen)
    assert len(model.table_of) >= 45
    for fap, words in (("yaw_l_eyeball", "eyeball"), ("raise_tongue", "tongue"), ("pull_l_ear", "10.3")):
        assert words in model.lost[fap_numbers()[fap]]
    # vertices 87 and 40 of the file are the middles of the inner lips
    skin = model.part("skin")
    assert len(skin.triangles) == 202
    assert moved(model, "raise_l_i_eyebrow", 100, "4.1")[1] == pytest.approx(100 * model.fapu.ENS, rel=0.05)
    assert moved(model, "open_jaw", 200, "2.1")[1] == pytest.approx(-200 * model.fapu.MNS, rel=0.05)
    # 0.613 units between the pupils are read as decimetres
    assert model.notes["unit"] == "in decimetres: the pupils are 61.3 mm apart"
