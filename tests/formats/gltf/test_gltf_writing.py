"""glTF written: the official validator's opinion, where every vertex ends up, and reading it back."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

import fba
from fba.animation import Animation, BodyTrack, FaceTrack
from fba.body import BapSolver, BodyModel, GroundedPoser, Skeleton, attach_head
from fba.errors import FormatError, ModelError
from fba.face.deform._deformer import Deformer
from fba.face.model import FaceModel
from fba.gltf import Gltf, read_gltf
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_numbers, baps, fap_numbers, point_rows
from gltf_edits import edit
from gltf_validator import assert_valid

FRAMES = 12
SHOWN = {"open_jaw": 500, "close_t_l_eyelid": 1024, "yaw_l_eyeball": 30000, "raise_l_i_eyebrow": -200}


def body_track(rows: np.ndarray) -> BodyTrack:
    values = np.asarray(rows, dtype=np.int32)
    return BodyTrack(values, np.ones(values.shape, dtype=bool))


def dance(frames: int = FRAMES) -> np.ndarray:
    """(T, 296): all joints swing, up to 0.5 rad."""
    rng = np.random.default_rng(8)
    used = [b.number - 1 for b in baps() if b.joint and b.unit == "1e-5 rad"]
    values = np.zeros((frames, BAP_COUNT))
    time = np.arange(frames)[:, None] / 25
    values[:, used] = rng.uniform(0, 0.5e5, len(used)) * np.sin(3 * time + rng.uniform(0, 6, len(used)))
    values[:, 180:183] = np.rint(time * [100, 200, 1000])
    return np.rint(values)


def speech(frames: int = FRAMES, head: bool = True) -> FaceTrack:
    values = np.zeros((frames, FAP_COUNT), dtype=np.int32)
    grow = np.linspace(0, 1, frames)
    for name, most in (SHOWN | ({"head_yaw": 20000, "head_pitch": -12000} if head else {})).items():
        values[:, fap_numbers()[name] - 1] = np.rint(most * grow)
    mask = np.zeros(values.shape, dtype=bool)
    mask[:, 2:] = True
    return FaceTrack(values, mask)


def person(head: bool = True) -> Animation:
    index = np.array([5, 6, 8, *range(9, 9 + FRAMES - 3)])
    return Animation(Fraction(25), index, speech(head=head), body_track(dance()), "dance")


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("glb") / "person.glb"
    fba.write(path, person())
    return path


def worlds(gltf: Gltf, at: float) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Matrices of all nodes at a time, and weights of the morph targets by node: as a viewer plays them."""
    local = {n: [node.translation, node.rotation] for n, node in enumerate(gltf.nodes)}
    weights = {
        n: np.array(gltf.meshes[node.mesh].weights)
        for n, node in enumerate(gltf.nodes)
        if node.mesh is not None
    }
    for channel in gltf.animations[0].channels:
        assert channel.interpolation == "LINEAR"
        times = channel.times.astype(float)
        if channel.path == "rotation":
            key = min(max(at, times[0]), times[-1])
            turn = Rotation.from_quat(channel.values)
            local[channel.node][1] = (Slerp(times, turn)(key) if len(times) > 1 else turn[0]).as_quat()
        else:
            value = np.array([np.interp(at, times, column) for column in channel.values.T])
            if channel.path == "translation":
                local[channel.node][0] = value
            else:
                weights[channel.node] = value
    world = np.tile(np.eye(4), (len(gltf.nodes), 1, 1))
    for number in gltf.order:
        world[number, :3, :3] = Rotation.from_quat(local[number][1]).as_matrix()
        world[number, :3, 3] = local[number][0]
        parent = gltf.nodes[number].parent
        if parent is not None:
            world[number] = world[parent] @ world[number]
    return world, weights


def vertices(gltf: Gltf, at: float) -> dict[str, np.ndarray]:
    """Where the vertices of each mesh are shown at a time, by the glTF specification."""
    world, weights = worlds(gltf, at)
    found = {}
    for number, node in enumerate(gltf.nodes):
        if node.mesh is None:
            continue
        [primitive] = gltf.meshes[node.mesh].primitives
        places = primitive.positions.astype(float)
        for share, morph in zip(weights[number], primitive.morphs, strict=True):
            places = places + (0 if morph is None else share * morph)
        if node.skin is None:
            found[node.name] = places @ world[number, :3, :3].T + world[number, :3, 3]
            continue
        skin = gltf.skins[node.skin]
        matrices = world[list(skin.joints)] @ skin.inverse_bind
        assert primitive.joints is not None
        carried = np.einsum("vk,vkij->vij", primitive.weights, matrices[primitive.joints])
        found[node.name] = np.einsum("vij,vj->vi", carried[:, :3, :3], places) + carried[:, :3, 3]
    return found


def test_the_validator_finds_no_fault(written: Path, tmp_path: Path) -> None:
    fba.write(tmp_path / "bones.glb", person(), mesh=False)
    fba.write(tmp_path / "face.glb", Animation(Fraction(25), np.arange(FRAMES), speech()))
    fba.write(tmp_path / "one.glb", person()[:1])
    # without a mesh, nothing but the animation uses the skin
    assert_valid(written, *sorted(tmp_path.glob("*.glb")), informs={"UNUSED_OBJECT"})


@pytest.mark.parametrize("mesh", [True, False])
def test_the_same_body_comes_back(tmp_path: Path, written: Path, mesh: bool) -> None:
    animation, path = person(), written
    if not mesh:
        path = tmp_path / "bones.glb"
        fba.write(path, animation, mesh=False)
    back = fba.read(path)
    assert (back.rate, back.index.tolist(), back.name) == (25, animation.index.tolist(), "dance")
    assert back.face == animation.face
    assert np.abs(back.body.values[:, :186] - animation.body.values[:, :186]).max() <= 2
    solver = BapSolver()
    np.testing.assert_allclose(solver.pose(back.body.values), solver.pose(animation.body.values), atol=3e-5)


def test_a_reader_that_knows_nothing_of_this_project_gets_the_motion(tmp_path: Path) -> None:
    """The skeleton by its names and its bind pose alone, as a file of any other program."""
    animation = person()
    fba.write(tmp_path / "a.glb", animation, mesh=False)
    edit(tmp_path / "a.glb", lambda d: d["animations"][0].pop("extras"), tmp_path / "b.glb")
    back = fba.read(tmp_path / "b.glb")
    solver = BapSolver()
    there = solver.pose(animation.body.values)[-1]
    here = solver.pose(back.body.values)[-1]
    assert np.abs(there - here).max() < 1e-3


@pytest.mark.parametrize("frame", [0, FRAMES - 1])
def test_every_vertex_is_where_body_and_face_are(written: Path, frame: int) -> None:
    animation, gltf = person(), read_gltf(written)
    body, face = BodyModel.default(), FaceModel.default()
    faps = animation.face.values[frame].astype(float)
    matrices = GroundedPoser(body.skeleton).pose(animation.body.values[frame])
    move = Deformer(face)
    skull = np.concatenate(
        [np.full(len(p.vertices), p.kind in ("eye", "teeth", "tongue", "brow", "lash")) for p in face.parts]
    )
    head = attach_head(body, face.vertices, face.points[[point_rows()["3.5"], point_rows()["3.6"]]], skull)
    matrices = head.matrices(matrices, move.head_matrices(faps))
    wanted_face = head.skin(move.local(faps), matrices, method="linear")
    wanted_body = body.skin(matrices, method="linear")
    at = float(animation.index[frame] - animation.index[0]) / 25
    shown = vertices(gltf, at)
    assert {"skin", "face_skin", "shoes", "eye_left", "teeth_lower"} <= set(shown)
    compared = 0
    for model, wanted in ((body, wanted_body), (face, wanted_face)):
        for part in model.parts:
            rows = slice(model.starts[part.name], model.starts[part.name] + len(part.vertices))
            for name, places in shown.items():
                if name.removeprefix("face_") == part.name and len(places) == len(part.vertices):
                    # morph targets follow the paths within a tenth of a millimetre each
                    assert np.abs(places - wanted[rows]).max() < 4e-4, name
                    compared += 1
    assert compared == sum(node.mesh is not None for node in gltf.nodes)


def test_a_face_by_itself(tmp_path: Path) -> None:
    animation = Animation(Fraction(25), np.arange(FRAMES), speech())
    fba.write(tmp_path / "face.glb", animation)
    gltf = read_gltf(tmp_path / "face.glb")
    face = FaceModel.default()
    wanted = Deformer(face)(animation.face.values[-1].astype(float))
    shown = vertices(gltf, (FRAMES - 1) / 25)
    for part in face.parts:
        rows = slice(face.starts[part.name], face.starts[part.name] + len(part.vertices))
        assert np.abs(shown[part.name] - wanted[rows]).max() < 4e-4, part.name
    names = {name for mesh in gltf.meshes for name in mesh.morph_names}
    assert {name.split()[0] for name in names} == {"open_jaw", "close_t_l_eyelid", "raise_l_i_eyebrow"}


def test_joints_have_the_standards_names_and_places(written: Path) -> None:
    gltf = read_gltf(written)
    names = [node.name for node in gltf.nodes]
    assert set(Skeleton.default().names) <= set(names)
    animation = person()
    matrices = GroundedPoser(BodyModel.default().skeleton).pose(animation.body.values[3])
    world, _ = worlds(gltf, 4 / 25)  # index 9, four frames after the first
    for joint, name in enumerate(BodyModel.default().skeleton.names):
        np.testing.assert_allclose(world[names.index(name)], matrices[joint], atol=1e-5)


def test_only_what_moves_has_keys(tmp_path: Path) -> None:
    values = np.zeros((4, BAP_COUNT))
    values[:, bap_numbers()["l_elbow_flexion"] - 1] = [0, 10000, 20000, 30000]
    fba.write(tmp_path / "a.glb", Animation(Fraction(30), np.arange(4), None, body_track(values)), mesh=False)
    gltf = read_gltf(tmp_path / "a.glb")
    moved = {(gltf.nodes[c.node].name, c.path) for c in gltf.animations[0].channels}
    assert moved == {("HumanoidRoot", "rotation"), ("HumanoidRoot", "translation"), ("l_elbow", "rotation")}
    assert gltf.animations[0].channels[0].times.tolist() == pytest.approx([0, 1 / 30, 2 / 30, 0.1])


def test_animations_that_cannot_be_written(tmp_path: Path) -> None:
    animation = person()
    with pytest.raises(FormatError, match=r"name it \.glb"):
        fba.write(tmp_path / "a.gltf", animation)
    with pytest.raises(FormatError, match="0 frames; 1 to 100000"):
        fba.write(tmp_path / "a.glb", animation[:0])
    with pytest.raises(FormatError, match="a skeleton alone needs a body"):
        fba.write(tmp_path / "a.glb", Animation(Fraction(25), np.arange(FRAMES), speech()), mesh=False)
    late = Animation(Fraction(120), np.array([0, 2**30, 2**30 + 1]), None, body_track(dance(3)))
    with pytest.raises(FormatError, match="cannot tell its frames apart; write shorter"):
        fba.write(tmp_path / "a.glb", late)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("version", 2, "has version 2, but this fba reads version 1 only"),
        ("rate", "fast", "frame rate"),
        ("rate", 1, "text"),
        ("root", 10**9, "fba.root: 1000000000 is not within"),
        ("root", -1, "fba.root: -1 is not within"),
        ("centre", [0, 1], "3"),
        ("axes", "mine", "iso"),
        ("first", 1e300, "first"),
        ("rate", "1/1000000", "less than a frame apart"),
    ],
)
def test_a_note_that_lies(tmp_path: Path, key: str, value: object, message: str) -> None:
    fba.write(tmp_path / "a.glb", person(), mesh=False)
    edit(tmp_path / "a.glb", lambda d: d["animations"][0]["extras"]["fba"].update({key: value}))
    with pytest.raises((FormatError, ModelError), match=message):
        fba.read(tmp_path / "a.glb")
