"""Heads and persons in JavaScript: what they show is what those in Python show."""

import json
import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from fba import rotations
from fba.arrays import Float64
from fba.body import BodyModel, GroundedPoser
from fba.capture.blendshapes import to_blendshapes
from fba.face import FaceModel, Function, InterpolationTable, Link, Term, resolve
from fba.face.shape_names import canonical_names
from fba.formats.gltf.bodies import import_body
from fba.geometry import fit_similarity
from fba.gltf import Surface, read_gltf, surfaces
from fba.tracks import FaceTrack
from fba_player import Timeline
from fba_player._figure.face import FaceFigure, build_figure
from fba_player._figure.model_units import prepare_model, resize
from fba_player._figure.person import Person, build_person
from fba_player.view._geometry import rotation_vector, transform
from fba_player.web._face_packing import factorise
from fba_player.web._packing import Packed, pack_figure
from gltf_edits import edit
from small_people import write_person
from tools.web import make_tables
from zoo_heads import ACTIONS, MAKERS, Maker, original
from zoo_heads import write as write_head

needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="no node here")
pytestmark = pytest.mark.filterwarnings("ignore::fba.FbaWarning")
SAMPLES = Path(fba.__file__).parent / "samples"
VECTORS = Path(__file__).parents[4] / "shared" / "vectors" / "generated"
FOREIGN = VECTORS.parents[1] / "data" / "foreign" / "heads"
STREAMS = 20
TRACKS = 4
MUTANTS = 60
FIELDS = ("values", "mask", "interpolated", "viseme", "expression")
LINKS = (
    Link(("open_jaw",), {"lower_t_midlip": Function((Term(0.5, {"open_jaw": 1}), Term(3.0)))}),
    Link(
        ("lower_t_midlip",), {"raise_b_midlip": Function((Term(-1.0, {"lower_t_midlip": 2}),), (Term(7.0),))}
    ),
    Link(
        ("expression",),
        {
            "stretch_l_cornerlip": Function(
                (Term(2.0, {"expression_intensity1": 1}, ("expression_select1", 3)),)
            )
        },
    ),
    Link(
        ("viseme",),
        {
            "raise_l_i_eyebrow": Function(
                (Term(1.5, {"viseme_blend": 1}),), (Term(1.0, {"viseme_select1": 1}),)
            )
        },
    ),
    Link(("raise_l_i_eyebrow",), {"squeeze_l_eyebrow": Function((Term(1.0, {"raise_l_i_eyebrow": 1}),))}),
)
FRAMES = 3
FAP_ERROR, VERTEX_ERROR, JOINT_ERROR = 1.0, 1e-4, np.radians(0.01)
NORMAL_ERROR = 0.15
"""Radians, in the wildest grimaces."""
LIGHT_ERROR, WILD_LIGHT_ERROR = 0.04, 0.4
"""Of light between 0 and 1, on heads that move as people's, and on those that vectors turn upside down."""
PROGRAM = str(Path(__file__).with_name("show_figure.mjs"))
HEAD_YAW = 48
"""Column of FAP 49."""
UP = np.array([0.0, 1.0, 0.0])


def test_its_tables_are_those_of_the_standard() -> None:
    assert make_tables.FIGURE_TARGET.read_text(encoding="utf-8") == make_tables.make_figure_tables()


def test_motion_is_packed_as_few_shapes() -> None:
    random = np.random.default_rng(1)
    shifts = np.einsum("kr,rnc->knc", random.uniform(-1, 1, (9, 2)), random.uniform(-0.01, 0.01, (2, 500, 3)))
    curves, shapes = factorise(shifts + random.uniform(-5e-6, 5e-6, shifts.shape), 2e-5, 2e-5)
    assert len(shapes) == 2
    assert np.abs(np.tensordot(curves, shapes, axes=(0, 0)) - shifts).max() < 4e-5


@dataclass
class Errors:
    """The largest differences: FAPs, vertices (m), joints (radians, m); of 95 % of normals (radians), of
    99 % of the light on faces."""

    faps: float = 0.0
    vertices: float = 0.0
    turn: float = 0.0
    joints: float = 0.0
    normals: float = 0.0
    light: float = 0.0

    def add(self, name: str, values: Any) -> None:
        if name in ("normals", "light"):
            values = np.quantile(values, 0.95 if name == "normals" else 0.99)
        setattr(self, name, max(getattr(self, name), float(np.max(values, initial=0.0))))


@cache
def _head() -> tuple[FaceFigure, Packed]:
    figure = build_figure(FaceModel.default())
    packed = pack_figure(figure, None)
    assert sorted(packed.face_rows) == list(range(len(figure.model.vertices)))
    return figure, packed


@cache
def _person() -> tuple[Person, Packed]:
    person = build_person(BodyModel.default(), _head()[0])
    return person, pack_figure(person.figure, person)


def _samples() -> list[bytes]:
    return [
        fba.encode(fba.read(file)) for file in sorted(SAMPLES.iterdir()) if file.suffix in (".fap", ".bvh")
    ]


@needs_node
@pytest.mark.parametrize("kind", ["head", "person"])
def test_samples(kind: str, tmp_path: Path) -> None:
    _check(compare(kind, _samples(), tmp_path))


@needs_node
@pytest.mark.skipif(not VECTORS.is_dir(), reason="no shared vectors here")
def test_vectors(tmp_path: Path) -> None:
    streams = [file.read_bytes() for file in sorted(VECTORS.glob("*.fba"))]
    chosen = streams[:: max(len(streams) // STREAMS, 1)][:STREAMS]
    _check(compare("person", chosen, tmp_path), WILD_LIGHT_ERROR)


@needs_node
@pytest.mark.parametrize("file", ["small", "rpm64f1.glb"])
def test_bodies_with_a_head_of_their_own(file: str, tmp_path: Path) -> None:
    """Their faces move as FAPs mix their shapes, their eyes turn."""
    if file == "small":
        morphs = {name: [0.0] for name in ("jawOpen", "eyeBlink_L", "mouthSmileRight", "eyeWideLeft")}
        path = write_person(tmp_path / "person.glb", extension="VRMC_vrm", morphs=morphs)
        edit(path, _left_hand_as_eye)
    elif not (path := FOREIGN / file).is_file():
        pytest.skip("no such file here")
    figure, _ = _head()
    person = build_person(import_body(path), figure)
    assert person.head is None
    assert person.body.own_head is not None
    packed = pack_figure(figure, person)
    talk, walk = (fba.read(SAMPLES / name) for name in ("hello.fap", "hello.bvh"))
    count = min(len(talk), len(walk))
    both = replace(walk[:count], face=talk[:count].face)
    errors = compare("person", [fba.encode(both)], tmp_path, frames=20, packed=packed, figure=person)
    _check(errors)


def _left_hand_as_eye(document: dict[str, Any]) -> None:
    bones = document["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]
    bones["leftEye"] = bones.pop("leftMiddleProximal")


def _as_packed(data: bytes, model: FaceModel) -> Packed:
    """Return a .glb head as if it were packed: all vertices stay, in their order."""
    return Packed(data, np.arange(len(model.vertices)), np.zeros(0, dtype=np.int64))


@needs_node
@pytest.mark.parametrize("factor", [1.0, 37.0])
def test_glb_heads_with_the_extension(factor: float, tmp_path: Path) -> None:
    """All that FaceDefTables say, in metres and in another unit, of which players make a person's size."""
    model = resize(FaceModel.default(), factor)
    model.save(tmp_path / "head.glb")
    figure = build_figure(prepare_model(model))
    packed = _as_packed((tmp_path / "head.glb").read_bytes(), model)
    stream = fba.encode(fba.read(SAMPLES / "hello.fap"))
    _check(compare("head", [stream], tmp_path, 12, packed=packed, figure=figure), WILD_LIGHT_ERROR)


@needs_node
@pytest.mark.parametrize("maker", MAKERS[1:4], ids=lambda maker: maker.name)
def test_glb_heads_with_arkit_shapes(maker: Maker, tmp_path: Path) -> None:
    """Shapes are mixed as `to_blendshapes` says; the head turns."""
    path = write_head(maker, "built-in", tmp_path / "head.glb")
    animation = fba.read(SAMPLES / "hello.fap")[:90]
    assert animation.face is not None
    still = animation.face.values.copy()
    still[:, [*range(22, 26), *range(47, 50)]] = 0  # eyes and head
    turning = still.copy()
    turning[:, HEAD_YAW] = 20_000
    frames, rows = [0, 20, 45, 70], []
    for number, values in enumerate((still, turning)):
        stream, result = tmp_path / f"{number}.fba", tmp_path / f"{number}"
        track = replace(animation.face, values=values, mask=np.ones_like(animation.face.mask))
        stream.write_bytes(fba.encode(replace(animation, face=track)))
        asked = {"stream": str(stream), "frames": frames, "result": str(result)}
        (tmp_path / "request").write_text(json.dumps({"figure": str(path), "streams": [asked]}))
        _run(tmp_path / "request")
        shown = np.fromfile(result).reshape(len(frames), -1)[:, 68:]
        vertices = shown.shape[1] // 13  # positions, as they are shown, normals and light
        rows.append(shown[:, : 3 * vertices].reshape(len(frames), -1, 3))
    shapes = sorted(ACTIONS)
    weights = to_blendshapes(fba.read(tmp_path / "0.fba"), tuple(shapes)).weights[frames]
    assert weights.max() > 0.2
    listed = surfaces(read_gltf(path))
    rest = np.concatenate([surface.positions for surface in listed]).astype(np.float64)
    moved = maker.unit * (rest + np.einsum("tk,kvi->tvi", weights, _morphs(listed, shapes)))
    assert np.abs(moved - moved[0]).max() > 5e-3
    assert np.linalg.norm(rows[0] - moved, axis=2).max() < VERTEX_ERROR
    turned = fit_similarity(rows[0][2], rows[1][2])
    assert turned.error < 1e-6
    np.testing.assert_allclose(turned.rotation, rotations.turn(UP, np.array(0.2)), atol=1e-3)


def _morphs(listed: Sequence[Surface], shapes: Sequence[str]) -> Float64:
    """Return the shifts (K, V, 3) of shapes, by ARKit's names, through surfaces."""
    shifts = [np.zeros((len(shapes), len(surface.positions), 3)) for surface in listed]
    for shift, surface in zip(shifts, listed, strict=True):
        for shape, name in canonical_names(surface.morphs).items():
            shift[shapes.index(shape)] = surface.morphs[name]
    return np.concatenate(shifts, axis=1)


@needs_node
@pytest.mark.parametrize("with_table", [False, True])
def test_what_is_not_sent(with_table: bool, tmp_path: Path) -> None:
    """Visemes, expressions, their definitions, mates and interpolation, as a stream may mix them."""
    fit = InterpolationTable(LINKS) if with_table else None
    model = replace(FaceModel.default(), fit=fit)
    random = np.random.default_rng(27)
    (tmp_path / "figure").write_bytes(pack_figure(build_figure(model), None).data)
    for number in range(TRACKS):
        track = _random_track(random)
        rows = [
            {name: getattr(track, name)[at].astype(int).tolist() for name in FIELDS}
            for at in range(len(track))
        ]
        request = {"figure": str(tmp_path / "figure"), "faces": rows, "result": str(tmp_path / "result")}
        (tmp_path / "request").write_text(json.dumps(request))
        _run(tmp_path / "request")
        found = np.fromfile(tmp_path / "result").reshape(-1, 68)
        np.testing.assert_allclose(found, resolve(track, model), atol=0.01, err_msg=f"track {number}")


def _random_track(random: np.random.Generator) -> FaceTrack:
    count = 40
    mask = random.random((count, 68)) < random.choice([0.02, 0.3], (count, 68))
    mask[:, :2] = random.random((count, 2)) < 0.3
    viseme = np.stack([random.integers(0, top + 1, count) for top in (14, 14, 63, 1)], axis=1)
    expression = np.stack([random.integers(0, top + 1, count) for top in (6, 63, 6, 63, 1, 1)], axis=1)
    values = np.where(mask, random.integers(-300, 300, (count, 68)), 0)
    values[:, :2] = 0
    interpolated = ~mask & (random.random((count, 68)) < 0.1) & (random.random((count, 1)) < 0.5)
    kinds = (values.astype(np.int32), mask, viseme * mask[:, :1], expression * mask[:, 1:2])
    return FaceTrack(kinds[0], kinds[1], kinds[2].astype(np.int16), kinds[3].astype(np.int16), interpolated)


@needs_node
@pytest.mark.parametrize("kind", ["packed", "FBA_face", "ARKit"])
def test_damaged_figures(kind: str, tmp_path: Path) -> None:
    """Files cut off or with other bytes give an FbaError, or a figure: never another exception."""
    data, start, length = _figure_file(kind, tmp_path / "head.glb")
    random = np.random.default_rng(27)
    files = [data[:size] for size in (0, 3, start, 100, length, length + 1000, len(data) - 1)]
    for _ in range(MUTANTS):
        mutant = bytearray(data)
        low, high = (start, length) if random.random() < 0.7 else (0, len(data))
        for at in random.integers(low, high, random.integers(1, 4)):
            mutant[at] = random.choice(list(b'0123456789-[]{},"e.') if start <= at < length else range(256))
        files.append(bytes(mutant))
    refused = _messages(files, tmp_path)
    assert all(message.startswith("the model ") for message in refused if message)
    assert all(refused[:7])
    assert sum(map(bool, refused)) > MUTANTS / 4


def _figure_file(kind: str, path: Path) -> tuple[bytes, int, int]:
    """Return a figure's file, and where its JSON begins and ends."""
    if kind == "packed":
        data = _head()[1].data
        return data, 8, 8 + int.from_bytes(data[4:8], "little")
    if kind == "FBA_face":
        original("grid").save(path)
    else:
        write_head(MAKERS[0], "grid", path)
    data = path.read_bytes()
    return data, 20, 20 + int.from_bytes(data[12:16], "little")


def _messages(files: Sequence[bytes], folder: Path) -> list[str]:
    """Return what is wrong with each figure, "" for those that can be shown."""
    names = []
    for number, content in enumerate(files):
        names.append(str(folder / f"figure{number}"))
        Path(names[-1]).write_bytes(content)
    (folder / "request").write_text(json.dumps({"damaged": names, "result": str(folder / "result")}))
    _run(folder / "request")
    messages: list[str] = json.loads((folder / "result").read_text())
    return messages


@needs_node
def test_glb_heads_that_are_refused(tmp_path: Path) -> None:
    """What needs extensions, moves by nothing that is known, or asks for endless memory or time."""
    path = write_head(MAKERS[0], "grid", tmp_path / "head.glb")

    def changed(change: Callable[[dict[str, Any]], object]) -> bytes:
        data = path.read_bytes()
        stop = 20 + int.from_bytes(data[12:16], "little")
        content = json.loads(data[20:stop])
        change(content)
        text = json.dumps(content).encode()
        text += b" " * (-len(text) % 4)
        body = len(text).to_bytes(4, "little") + b"JSON" + text + data[stop:]
        return b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body

    def nameless(content: dict[str, Any]) -> None:
        for mesh in content["meshes"]:
            mesh.pop("extras", None)

    def huge(content: dict[str, Any], count: int) -> None:
        content["accessors"][0]["count"] = count
        content["accessors"][0].pop("bufferView")

    cases: list[tuple[Callable[[dict[str, Any]], object], str]] = [
        (lambda content: content.update(extensionsRequired=["KHR_draco_mesh_compression"]), "KHR_draco"),
        (nameless, "has neither FBA_face nor morph targets named as ARKit's"),
        (lambda content: huge(content, 10**9), "1000000000 as the count of an accessor"),
        (lambda content: huge(content, 2 * 10**7), "more than 64000000 numbers"),
        (lambda content: huge(content, 10**7), "10000000 vertices, expected 500000 at most"),
        (lambda content: content["nodes"].extend([{"mesh": 0}] * 100_000), "more than 64000000 numbers"),
        (lambda content: content["nodes"][0].update(children=[0]), "its own ancestor"),
        (lambda content: content["meshes"].__setitem__(0, None), "is damaged"),
    ]  # fmt: skip
    messages = _messages([changed(change) for change, _ in cases], tmp_path)
    assert [text for (_, text), message in zip(cases, messages, strict=True) if text not in message] == []
    assert all("fba export" in message for message in messages)


def _run(request: Path) -> None:
    done = subprocess.run(["node", PROGRAM, str(request)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def _check(errors: Errors, light: float = LIGHT_ERROR) -> None:
    assert errors.faps <= FAP_ERROR
    assert errors.vertices <= VERTEX_ERROR
    assert errors.turn <= JOINT_ERROR
    assert errors.joints <= VERTEX_ERROR
    assert errors.normals <= NORMAL_ERROR
    assert errors.light <= light


def compare(
    kind: str,
    streams: Sequence[bytes],
    folder: Path,
    frames: int = FRAMES,
    packed: Packed | None = None,
    figure: FaceFigure | Person | None = None,
) -> Errors:
    """Return how far a head or a person in JavaScript is from the one in Python in frames of streams."""
    shown, usual = _head() if kind == "head" else _person()
    packed, shown = packed or usual, figure or shown
    (folder / "figure").write_bytes(packed.data)
    request: dict[str, Any] = {"figure": str(folder / "figure"), "streams": []}
    animations = [fba.decode(stream) for stream in streams]
    for number, (stream, animation) in enumerate(zip(streams, animations, strict=True)):
        (folder / f"stream{number}").write_bytes(stream)
        chosen = np.unique(np.linspace(0, len(animation) - 1, frames).astype(int)).tolist()
        request["streams"].append(
            {"stream": str(folder / f"stream{number}"), "frames": chosen, "result": str(folder / f"{number}")}
        )
    (folder / "request").write_text(json.dumps(request))
    _run(folder / "request")
    errors = Errors()
    for entry, animation in zip(request["streams"], animations, strict=True):
        values = np.fromfile(entry["result"]).reshape(len(entry["frames"]), -1)
        timeline = Timeline(animation, FaceModel.default())
        for frame, row in zip(entry["frames"], values, strict=True):
            time = float(timeline.time_of(frame))
            faps, baps = timeline.faps(time), timeline.baps(time)
            errors.add("faps", np.abs(row[:68] - faps))
            if isinstance(shown, Person):
                _compare_person(shown, packed, faps, baps, row[68:], errors)
            else:
                _compare_head(shown, packed, faps, row[68:], errors)
    return errors


def _compare_head(figure: FaceFigure, packed: Packed, faps: Any, row: Float64, errors: Errors) -> None:
    count = len(packed.face_rows)
    rigid, placed, normals = row[: 9 * count].reshape(3, -1, 3)
    pose = figure.pose(faps)
    errors.add("vertices", _distances(rigid, transform(pose.positions, pose.turn)[packed.face_rows]))
    light = figure.light.shade(pose.positions, pose.turn[:3, :3], np.eye(3))[packed.face_rows]
    errors.add("light", np.abs(row[9 * count :].reshape(-1, 4) - light))
    axis = rotation_vector(pose.turn[:3, :3])
    for name, shape in figure.shapes.items():
        inside, rows = _inside(packed.face_rows, figure.rows(name))
        sways = shape.sway[rows - figure.rows(name).start]
        bent = _turned(pose.positions[rows] - figure.centre, axis, sways) + figure.centre
        errors.add("vertices", _distances(placed[inside], bent))
        errors.add("normals", _angles(normals[inside], _turned(pose.normals[rows], axis, sways)))


def _compare_person(
    person: Person, packed: Packed, faps: Any, baps: Float64, row: Float64, errors: Errors
) -> None:
    count = 16 * len(person.body.skeleton)
    found = row[:count].reshape(-1, 4, 4).transpose(0, 2, 1)
    joints = person.joints(faps, GroundedPoser(person.body.skeleton).pose(baps))
    between = np.einsum("jki,jkl->jil", found[:, :3, :3], joints[:, :3, :3])
    apart = np.stack(
        [between[:, (k + 1) % 3, (k + 2) % 3] - between[:, (k + 2) % 3, (k + 1) % 3] for k in range(3)]
    )
    errors.add("turn", np.arctan2(np.linalg.norm(apart, axis=0), np.trace(between, axis1=1, axis2=2) - 1))
    errors.add("joints", _distances(found[:, :3, 3], joints[:, :3, 3]))
    vertices = len(packed.body_rows) + len(packed.face_rows)
    positions, normals = row[count : count + 6 * vertices].reshape(2, -1, 3)
    if person.head is None:
        assert person.body.own_head is not None
        moved = person.body.own_head.move(person.body.vertices, faps)
        body, body_normals = np.empty_like(moved), np.empty_like(moved)
        person.body.skinner.skin_vertices(moved, person.body.normals, joints, body, body_normals)
        errors.add("vertices", _distances(positions, body[packed.body_rows]))
        return
    pose = person.figure.pose(faps)
    body, face = np.empty_like(person.body.vertices), np.empty_like(pose.normals)
    body_normals, face_normals = np.empty_like(body), np.empty_like(face)
    turn = person.frame(joints)[:3, :3]
    light = person.figure.light.shade(pose.positions, np.eye(3), turn)[packed.face_rows]
    errors.add("light", np.abs(row[-4 * len(light) :].reshape(-1, 4) - light))
    person.body.skin(joints, body, body_normals)
    person.head.skin(pose.positions, joints, face, local_normals=pose.normals, normals=face_normals)
    expected = np.concatenate([body[packed.body_rows], face[packed.face_rows]])
    errors.add("vertices", _distances(positions, expected))
    expected = np.concatenate([body_normals[packed.body_rows], face_normals[packed.face_rows]])
    errors.add("normals", _angles(normals, expected))


def _inside(rows: Any, part: slice) -> tuple[Any, Any]:
    inside = (rows >= part.start) & (rows < part.stop)
    return inside, rows[inside]


def _distances(one: Any, other: Any) -> Float64:
    return np.asarray(np.linalg.norm(one - other, axis=1))


def _angles(one: Any, other: Any) -> Float64:
    cosines = (one * other).sum(axis=1) / np.linalg.norm(one, axis=1) / np.linalg.norm(other, axis=1)
    return np.asarray(np.arccos(np.clip(cosines, -1, 1)))


def _turned(vectors: Any, axis: Float64, shares: Any) -> Float64:
    """Return vectors (N, 3) turned about an axis by shares (N,) of its length."""
    angle = float(np.linalg.norm(axis))
    if angle == 0:
        return np.asarray(vectors, dtype=np.float64)
    unit, vectors = axis / angle, np.asarray(vectors, dtype=np.float64)
    sine, cosine = np.sin(angle * shares)[:, None], np.cos(angle * shares)[:, None]
    along = (vectors @ unit)[:, None] * unit
    return vectors * cosine + np.cross(unit, vectors) * sine + along * (1 - cosine)
