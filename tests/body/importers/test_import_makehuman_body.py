"""MakeHuman's base mesh with its rig as a body; needs a copy of the files."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fba.body import BapSolver, BodyModel, attach_head
from fba.body.importers import import_makehuman
from fba.errors import FormatError, ModelError
from fba.parameters import baps, joints

FILES = ("base.obj", "default.mhskel", "default_weights.mhw")


@pytest.fixture(scope="module")
def folder(request: pytest.FixtureRequest) -> Path:
    place: Path = request.getfixturevalue("shared") / "models" / "makehuman"
    if not all((place / name).is_file() for name in FILES):
        pytest.skip("no MakeHuman files")
    return place


@pytest.fixture(scope="module")
def body(folder: Path) -> BodyModel:
    return import_makehuman(folder)


def test_a_person_on_the_standards_joints(body: BodyModel) -> None:
    assert set(body.skeleton.names) == {joint.name for joint in joints()}
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    assert low[1] == pytest.approx(0, abs=2e-3)
    assert 1.5 < high[1] < 1.9
    np.testing.assert_allclose(body.weights.sum(axis=1), 1, atol=1e-5)
    assert {part.kind for part in body.parts} == {"skin", "neck", "head"}
    np.testing.assert_allclose(body.skin(body.bind), body.vertices, atol=2e-6)


def test_in_the_default_posture_arms_hang_and_feet_stand(body: BodyModel) -> None:
    pose = BapSolver(body.skeleton).pose(np.zeros(296))
    at = {name: pose[number, :3, 3] for number, name in enumerate(body.skeleton.names)}
    for side in "lr":
        arm = at[f"{side}_wrist"] - at[f"{side}_shoulder"]
        assert -arm[1] / np.linalg.norm(arm) > 0.98
        leg = at[f"{side}_ankle"] - at[f"{side}_hip"]
        assert -leg[1] / np.linalg.norm(leg) > 0.98
        assert at[f"{side}_elbow"][0] * (1 if side == "l" else -1) > 0.1
    moved = body.skin(pose)
    assert np.ptp(moved[:, 0]) < 0.75 < np.ptp(body.vertices[:, 0])
    feet = body.vertices[:, 1] < 0.05
    assert np.abs(moved[feet, 1]).max() < 0.08


def test_a_hand_goes_where_its_wrist_goes(body: BodyModel) -> None:
    palm = [body.skeleton.number(f"l_{n}") for n in ("wrist", "index0", "middle0", "ring0", "pinky0")]
    hand = (body.weights * np.isin(body.joints, palm)).sum(axis=1) > 0.9
    assert hand.sum() > 20
    values = np.zeros(296)
    values[37] = 1.2e5  # l_elbow_flexion
    solver = BapSolver(body.skeleton)
    wrist = body.skeleton.number("l_wrist")
    for angles in (np.zeros(296), values):
        pose = solver.pose(angles)
        middle = body.skin(pose)[hand].mean(axis=0)
        assert np.linalg.norm(middle - pose[wrist, :3, 3]) < 0.08


def test_its_own_head_continues_its_skin(folder: Path, body: BodyModel) -> None:
    """A head made of the same mesh ends where the body begins, and stays there in any pose."""
    from fba.face.importers.makehuman.makehuman import import_makehuman as import_head
    from fba.parameters import point_rows

    model = import_head(folder)
    head = attach_head(body, model.vertices, model.points[[point_rows()["3.5"], point_rows()["3.6"]]])
    assert head.brings_neck
    skin = model.part("skin")
    skin_rows = np.arange(len(skin.vertices))
    assert head.hidden[skin_rows].sum() < 10
    trunk = body.part("skin")
    rim = np.unique(open_edges(trunk.triangles))
    rim = rim[trunk.vertices[rim, 1] > 1.3]
    assert len(rim) == 42  # the ring that MakeHuman's heads are cut along
    turned = {"skullbase_tilt": 30.0, "vc4_torsion": 40.0}
    number = {bap.name: bap.number for bap in baps()}
    values = np.zeros(296)
    for name, angle in turned.items():
        values[number[name] - 1] = np.radians(angle) * 1e5
    for matrices in (body.bind, BapSolver(body.skeleton).pose(values)):
        face = head.skin(model.vertices, matrices)[skin_rows]
        below = body.skin(matrices)[body.starts["skin"] + rim]
        assert cKDTree(face).query(below)[0].max() < 2e-3


def open_edges(triangles: np.ndarray) -> np.ndarray:
    sides = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1
    )
    edges, counts = np.unique(sides, axis=0, return_counts=True)
    return edges[counts == 1]


@pytest.mark.parametrize("missing", FILES)
def test_a_missing_file(folder: Path, tmp_path: Path, missing: str) -> None:
    for name in FILES:
        if name != missing:
            shutil.copy(folder / name, tmp_path / name)
    with pytest.raises(FormatError, match="cannot be read"):
        import_makehuman(tmp_path)


def test_damaged_rigs(folder: Path, tmp_path: Path) -> None:
    for name in FILES:
        shutil.copy(folder / name, tmp_path / name)
    rig = json.loads((folder / "default.mhskel").read_text())
    del rig["joints"]["upperarm01.L____head"]
    (tmp_path / "default.mhskel").write_text(json.dumps(rig))
    with pytest.raises(ModelError, match=r"default\.mhskel: there is no joint 'upperarm01\.L____head'"):
        import_makehuman(tmp_path)
    rig["joints"]["upperarm01.L____head"] = [10**9]
    (tmp_path / "default.mhskel").write_text(json.dumps(rig))
    with pytest.raises(ModelError, match="upperarm01"):
        import_makehuman(tmp_path)
    shutil.copy(folder / "default.mhskel", tmp_path / "default.mhskel")
    for bad in (
        '{"weights": {"nose": []}}',
        '{"weights": {"head": [[1]]}}',
        '{"weights": {"head": [[1, NaN]]}}',
        "[]",
        "{",
    ):
        (tmp_path / "default_weights.mhw").write_text(bad)
        with pytest.raises(ModelError, match="default_weights"):
            import_makehuman(tmp_path)


def test_another_mesh(tmp_path: Path) -> None:
    (tmp_path / "base.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(ModelError, match="not MakeHuman's base mesh hm08: 3 vertices"):
        import_makehuman(tmp_path)
    for text, place in (
        ("v 0 0\n", ":1: "),
        ("v 0 0 nan\n", ":1: "),
        ("v 0 0 0\nf 1 2 3\n", ":2: "),
        ("# nothing\n", "0 vertices"),
        ("", "is empty"),
    ):
        (tmp_path / "base.obj").write_text(text)
        with pytest.raises(ModelError, match=place):
            import_makehuman(tmp_path)
