"""The deformer against the standard's worked example, geometry, and a plain evaluation in NumPy."""

import gc
import weakref
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fba.face import FeaturePointFace, feature_point_names, neutral_points
from fba.face._tables import HEAD, FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.deform._deformer import Deformer
from fba.face.model import FaceModel, Part
from fba.face.points import shift_table
from fba.mesh._meshes import vertex_normals
from fba.parameters import faps

ROW = {name: row for row, name in enumerate(feature_point_names())}
FREE = np.full(84, -1)
UNIT = {"IRISD": 11.7e-3, "ES": 62e-3, "ENS": 45e-3, "MNS": 21.5e-3, "MW": 52e-3}
"""FAPU of the neutral feature points, before the division by 1024."""


def unit(fap: int) -> float:
    name = faps()[fap - 1].unit
    return 1e-5 if name == "AU" else UNIT[name] / 1024


def values(**of: float) -> np.ndarray:
    """FAPs given as f3=100."""
    vector = np.zeros(68)
    for name, value in of.items():
        vector[int(name[1:]) - 1] = value
    return vector


def bumpy(size: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A square of size x size vertices, not quite flat, facing +z."""
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(-0.1, 0.1, size), np.linspace(-0.1, 0.1, size))
    vertices = np.stack([x, y, 0.02 * random.random((size, size))], axis=-1).reshape(-1, 3)
    number = np.arange(size * size).reshape(size, size)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    triangles = np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )
    return vertices, triangles


def face(*parts: Part, tables: tuple[FaceDefTables, ...] = (), bound: np.ndarray = FREE) -> FaceModel:
    return FaceModel(parts, neutral_points(), bound, tables)


def sheet(name: str = "skin", size: int = 8, seed: int = 1, kind: str = "skin") -> Part:
    return Part(name, kind, *bumpy(size, seed))


def turning(
    fap: int, part: str, kind: str, amount: tuple[float, ...], centre: object = (0, 0, 0)
) -> FaceDefTables:
    transform = FaceDefTransform(part, kind, amount, tuple(np.asarray(centre, dtype=float)))  # type: ignore[arg-type]
    return FaceDefTables(fap, transforms=(transform,))


# The worked example of the standard


EXAMPLE = FaceDefMesh(
    "skin", [-1000, 0, 500, 1000], [50, 51],
    [[[1, 0, 0], [0.9, 0, 0], [1.5, 0, 4]], [[0.8, 0, 0], [0.7, 0, 0], [2, 0, 0]]],
)  # fmt: skip


@pytest.mark.parametrize(
    ("value", "first", "second"),
    [
        (600, (600, 0, 400), (550, 0, 0)),
        (500, (450, 0, 0), (350, 0, 0)),
        (250, (225, 0, 0), (175, 0, 0)),
        (1000, (1200, 0, 2000), (1350, 0, 0)),
        (1500, (1950, 0, 4000), (2350, 0, 0)),  # the outermost interval goes on
        (-200, (-200, 0, 0), (-160, 0, 0)),
        (-3000, (-3000, 0, 0), (-2400, 0, 0)),
    ],
)
def test_worked_example(value: float, first: tuple[float, ...], second: tuple[float, ...]) -> None:
    part = sheet()
    moved = Deformer(face(part, tables=(FaceDefTables(3, (EXAMPLE,)),)))(values(f3=value))
    shift = (moved.astype(float) - part.vertices) / unit(3)
    assert shift[50] == pytest.approx(first, abs=1e-2)
    assert shift[51] == pytest.approx(second, abs=1e-2)
    assert not np.delete(shift, [50, 51], axis=0).any()


def test_what_several_faps_do_to_a_vertex_adds_up() -> None:
    part = sheet()
    raised = FaceDefMesh("skin", [-1, 0, 1], [51], [[[0, 1, 0], [0, 2, 0]]])
    tables = (FaceDefTables(3, (EXAMPLE,)), FaceDefTables(31, (raised,)), FaceDefTables(68))
    moved = Deformer(face(part, tables=tables))(values(f3=600, f31=-100, f68=999, f40=50))
    shift = moved.astype(float) - part.vertices
    assert shift[51] == pytest.approx((550 * unit(3), -100 * unit(31), 0), abs=1e-7)
    assert shift[50] == pytest.approx((600 * unit(3), 0, 400 * unit(3)), abs=1e-7)


# Against a plain evaluation


@st.composite
def models(draw: st.DrawFn) -> FaceModel:
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    parts = [sheet(f"part{i}", draw(st.integers(1, 6)), i) for i in range(draw(st.integers(1, 3)))]
    tables = []
    for fap in draw(st.sets(st.integers(3, 68), max_size=8)):
        meshes, transforms = [], []
        for part in parts:
            if draw(st.booleans()):
                lower = draw(st.sets(st.integers(-900, -1), max_size=3))
                upper = draw(st.sets(st.integers(1, 900), min_size=0 if lower else 1, max_size=3))
                borders = sorted({0, *lower, *upper})
                count = draw(st.integers(0, len(part.vertices)))
                chosen = random.permutation(len(part.vertices))[:count]
                moves = random.normal(0, 1, (count, len(borders) - 1, 3))
                moves[random.random(moves.shape[:2]) < 0.3] = 0
                meshes.append(FaceDefMesh(part.name, borders, chosen, moves))
        for name in [*(part.name for part in parts), HEAD]:
            for _ in range(draw(st.sampled_from((0, 0, 1, 2)))):
                kind = draw(st.sampled_from(("rotation", "scale", "translation")))
                amount, centre = random.normal(0, 0.3, 3) * 1e-3 / unit(fap), random.normal(0, 0.05, 3)
                transforms.append(FaceDefTransform(name, kind, tuple(amount), tuple(centre)))
        tables.append(FaceDefTables(fap, tuple(meshes), tuple(transforms)))
    return face(*parts, tables=tuple(tables))


def pose(model: FaceModel, name: str, vector: np.ndarray, size: Callable[[int], float] = unit) -> np.ndarray:
    """(4, 4): translations . rotations . scales, a lower FAP further out, but 48 within 49 and 50."""
    whole = np.eye(4)
    for kind in ("translation", "rotation", "scale"):
        for fap in (*range(3, 48), 49, 50, 48, *range(51, 69)):
            for transform in model.table_of[fap].transforms if fap in model.table_of else ():
                if (transform.part, transform.kind) != (name, kind):
                    continue
                amount = np.array(transform.amount) * vector[fap - 1] * size(fap)
                one, away = np.eye(4), np.eye(4)
                if kind == "translation":
                    one[:3, 3] = amount
                elif kind == "rotation":
                    one[:3, :3] = Rotation.from_rotvec(amount).as_matrix()
                else:
                    one[:3, :3] = np.diag(1 + amount)
                away[:3, 3] = transform.centre
                whole = whole @ (one if kind == "translation" else away @ one @ np.linalg.inv(away))
    return whole


def plainly(model: FaceModel, vector: np.ndarray, size: Callable[[int], float] = unit) -> np.ndarray:
    parts = []
    for part in model.parts:
        moved = part.vertices.astype(np.float64)
        for table in model.tables:
            for mesh in table.meshes:
                if mesh.part == part.name:
                    moved[mesh.vertices] += mesh.shift(float(vector[table.fap - 1])) * size(table.fap)
        whole = pose(model, HEAD, vector, size) @ pose(model, part.name, vector, size)
        parts.append(moved @ whole[:3, :3].T + whole[:3, 3])
    return np.concatenate(parts)


@given(model=models(), seed=st.integers(0, 2**32 - 1), flat=st.booleans())
@settings(max_examples=60)
def test_equals_a_plain_evaluation(model: FaceModel, seed: int, flat: bool) -> None:
    frames = np.random.default_rng(seed).integers(-1200, 1200, (3, 68))
    frames[1] *= np.random.default_rng(seed).random(68) < 0.2
    deformer = Deformer(model)
    result = deformer(frames)
    assert result.dtype == np.float32
    for vector, moved in zip(frames, result, strict=True):
        np.testing.assert_allclose(moved, plainly(model, vector), atol=2e-6, rtol=1e-5)
        np.testing.assert_array_equal(deformer(vector), moved)
    matrices = deformer.head_matrices(frames)
    turned = deformer.local(frames) @ matrices[:, :3, :3].swapaxes(1, 2) + matrices[:, None, :3, 3]
    np.testing.assert_allclose(result, turned, atol=2e-6, rtol=1e-5)
    for place, part in enumerate(model.parts):
        for vector, ours in zip(frames, deformer.part_matrices(frames)[:, place], strict=True):
            np.testing.assert_allclose(ours, pose(model, part.name, vector), atol=1e-9)
    for vector, ours in zip(frames, matrices, strict=True):
        np.testing.assert_allclose(ours, pose(model, HEAD, vector), atol=1e-9)


def test_the_built_in_head_equals_a_plain_evaluation() -> None:
    model = FaceModel.default()
    deformer = Deformer(model)
    limits = np.array([np.array(fap.i_limits) * (fap.step if fap.unit == "AU" else 1) for fap in faps()[2:]])
    frames = np.zeros((3, 68))
    frames[:, 2:] = np.random.default_rng(8).uniform(*limits.T, (3, 66)) * ((1,), (0.3,), (0.02,))
    moved, normals = deformer(frames), np.empty((3, len(model.vertices), 3), np.float32)
    np.testing.assert_array_equal(deformer(frames, normals=normals), moved)
    for vector, vertices, upright in zip(frames, moved, normals, strict=True):
        expected = plainly(model, vector, lambda fap: model.fapu[faps()[fap - 1].unit])
        np.testing.assert_allclose(vertices, expected, atol=1e-6)
        _, place, times = np.unique(model.vertices, axis=0, return_inverse=True, return_counts=True)
        alone = (times[place.ravel()] == 1) & (sizes(model, expected) > 1e-8)
        assert np.mean(alone) > 0.7
        np.testing.assert_allclose(
            upright[alone], vertex_normals(expected, model.triangles)[alone], atol=2e-3
        )
    bound = model.bound >= 0
    np.testing.assert_allclose(
        deformer.feature_points(frames)[:, bound], moved[:, model.bound[bound]], atol=2e-6
    )


def sizes(model: FaceModel, vertices: np.ndarray) -> np.ndarray:
    """(V,) length of the sum of the triangles at each vertex, as vectors of twice their area."""
    corners = vertices[model.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    summed = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(summed, model.triangles[:, corner], across)
    return np.linalg.norm(summed, axis=1)


# Turns, as the feature points do them


def points_as_a_face() -> FaceModel:
    """The neutral feature points as the vertices of a face; eyes turn, and shifts are those of the points."""
    points = FeaturePointFace()
    pupils = [ROW["3.5"], ROW["3.6"]]
    others = np.delete(np.arange(84), pupils)
    none = np.zeros((0, 3), dtype=np.int32)
    parts = [Part("skin", "skin", points.points[others], none)]
    parts += [
        Part(f"eye{side}", "eye", points.points[[pupil]], none)
        for side, pupil in zip("lr", pupils, strict=True)
    ]
    bound = np.empty(84, dtype=np.int32)
    bound[others], bound[pupils] = np.arange(82), [82, 83]
    tables = [turning(fap, HEAD, "rotation", axis, points.head_centre) for fap, axis in
              ((48, (1, 0, 0)), (49, (0, 1, 0)), (50, (0, 0, 1)))]  # fmt: skip
    for eye, centre in enumerate(points.eyeball_centres):
        name = f"eye{'lr'[eye]}"
        tables.append(turning(23 + eye, name, "rotation", (0, 1, 0), centre))
        tables.append(turning(25 + eye, name, "rotation", (1, 0, 0), centre))
        tables.append(turning(27 + eye, name, "translation", (0, 0, 1)))
    done = {table.fap for table in tables}
    for fap, shift in enumerate(shift_table(points.fapu), start=1):
        if fap not in done and shift.any():
            moves = shift[others][:, None] / points.fapu[faps()[fap - 1].unit]
            tables.append(FaceDefTables(fap, (FaceDefMesh("skin", [0, 1], np.arange(82), moves),)))
    return face(*parts, tables=tuple(tables), bound=bound)


def test_eyes_and_head_turn_as_the_feature_points_do() -> None:
    model, reference = points_as_a_face(), FeaturePointFace()
    frames = np.random.default_rng(5).integers(-900, 900, (6, 68)).astype(float)
    frames[:, [2, 46]] = 0  # jaw and tongue swing on arcs there
    frames[:, 22:26] *= 40
    frames[:, 47:50] *= 60
    frames[:, [28, 29]] = 0
    deformer = Deformer(model)
    moved = deformer(frames)
    order = np.argsort(model.bound)
    np.testing.assert_allclose(moved, reference(frames)[:, order], atol=3e-7)
    np.testing.assert_allclose(deformer.local(frames), reference.local(frames)[:, order], atol=3e-7)
    np.testing.assert_allclose(deformer.feature_points(frames), reference(frames), atol=3e-7)
    np.testing.assert_allclose(
        deformer.feature_points(frames, local=True), reference.local(frames), atol=3e-7
    )
    turn = deformer.head_matrices(frames)
    np.testing.assert_allclose(turn[:, :3, :3], reference.head_rotation(frames), atol=1e-12)
    centre = np.append(reference.head_centre, 1)
    np.testing.assert_allclose(turn @ centre, np.tile(centre, (6, 1)), atol=1e-12)
    gaze = deformer.part_matrices(frames)[:, 1:, :3, 2]
    np.testing.assert_allclose(gaze, reference.eyeballs(frames).gaze, atol=1e-12)


def test_a_quarter_turn_of_yaw_then_pitch() -> None:
    """Yaw is outside: the pitch turns about the eye's own left-right axis, wherever it looks."""
    eye = Part("eye", "eye", [[0, 0, 0.01], [0.01, 0, 0]], np.zeros((0, 3), dtype=int))
    tables = (turning(25, "eye", "rotation", (1, 0, 0)), turning(23, "eye", "rotation", (0, 1, 0)))
    quarter = np.pi / 2 * 1e5
    moved = Deformer(face(eye, tables=tables))(values(f23=quarter, f25=quarter / 2))
    half = 0.01 * np.sqrt(0.5)
    np.testing.assert_allclose(moved, [[half, -half, 0], [0, 0, -0.01]], atol=1e-8)


def test_translations_stand_outside_rotations_and_scales_inside() -> None:
    eye = Part("eye", "eye", [[0.02, 0, 0]], np.zeros((0, 3), dtype=int))
    tables = (
        turning(23, "eye", "rotation", (0, 0, 1), (0.01, 0, 0)),
        turning(27, "eye", "translation", (1, 0, 0)),
        turning(29, "eye", "scale", (1, 0, 0), (0.01, 0, 0)),
    )
    vector = values(f23=np.pi / 2 * 1e5, f27=0.005 / unit(27), f29=1 / unit(29))
    # twice as far from the centre: (0.03, 0, 0); a quarter turn about it: (0.01, 0.02, 0); and shifted
    np.testing.assert_allclose(Deformer(face(eye, tables=tables))(vector), [[0.015, 0.02, 0]], atol=1e-8)


def test_of_one_fap_the_transform_listed_first_is_further_out() -> None:
    part = Part("tongue", "tongue", [[0, 0, 1]], np.zeros((0, 3), dtype=int))
    quarter = 1.0 / unit(47)
    about_y = FaceDefTransform("tongue", "rotation", (0, np.pi / 2, 0))
    about_x = FaceDefTransform("tongue", "rotation", (np.pi / 2, 0, 0))
    for transforms, expected in (((about_y, about_x), (0, -1, 0)), ((about_x, about_y), (1, 0, 0))):
        model = face(part, tables=(FaceDefTables(47, transforms=transforms),))
        np.testing.assert_allclose(Deformer(model)(values(f47=quarter))[0], expected, atol=1e-6)


def test_free_feature_points_move_with_what_they_belong_to() -> None:
    points = neutral_points()
    none = np.zeros((0, 3), dtype=int)
    parts = (
        sheet(),
        Part("eye l", "eye", points[[ROW["3.5"]]] - (0, 0, 0.012), none),
        Part("eye r", "eye", points[[ROW["3.6"]]] - (0, 0, 0.012), none),
        Part("upper", "teeth", points[[ROW["9.10"]]] + (0, 0.004, 0), none),
        Part("lower", "teeth", points[[ROW["9.11"]]] - (0, 0.004, 0), none),
        Part("tongue", "tongue", points[[ROW["6.2"]]], none),
    )
    tables = (
        turning(27, "eye l", "translation", (0, 0, 1)),
        turning(3, "lower", "translation", (0, -1, 0)),
        turning(46, "tongue", "translation", (0, 1, 0)),
        turning(49, HEAD, "rotation", (0, 1, 0), points[ROW["7.1"]]),
    )
    deformer = Deformer(face(*parts, tables=tables))
    vector = values(f27=100, f3=200, f46=300)
    shift = deformer.feature_points(vector) - points
    expected = np.zeros((84, 3))
    expected[ROW["3.5"], 2] = 100 * unit(27)
    expected[[ROW["9.9"], ROW["9.11"]], 1] = -200 * unit(3)
    expected[[ROW[f"6.{i}"] for i in (1, 2, 3, 4)], 1] = 300 * unit(46)
    np.testing.assert_allclose(shift, expected, atol=1e-12)
    np.testing.assert_array_equal(deformer.feature_points(np.zeros((2, 68))), np.stack([points, points]))
    turned = deformer.feature_points(values(f49=np.pi / 2 * 1e5))
    centre = points[ROW["7.1"]]
    arm = points[ROW["9.3"]] - centre
    np.testing.assert_allclose(turned[ROW["9.3"]], centre + np.array([arm[2], arm[1], -arm[0]]), atol=1e-12)


def test_points_that_the_face_lacks_stay_unknown() -> None:
    points = neutral_points().copy()
    points[ROW["6.1"]] = np.nan
    model = FaceModel((sheet(),), points, FREE)
    moved = Deformer(model).feature_points(np.zeros(68))
    assert np.flatnonzero(np.isnan(moved).any(axis=1)).tolist() == [ROW["6.1"]]


def test_deformers_of_one_model_share_its_tables_but_write_to_arrays_of_their_own() -> None:
    model = face(sheet(), tables=(FaceDefTables(3, (EXAMPLE,)),))
    one, other = (Deformer(model)._tables for _ in range(2))
    assert one.mesh.shifts.slopes is other.mesh.shifts.slopes
    assert one.mesh.surface.corners is other.mesh.surface.corners
    assert not np.shares_memory(one.mesh.shifts.amount, other.mesh.shifts.amount)
    assert not np.shares_memory(one.point_shifts.amount, other.point_shifts.amount)
    assert not np.shares_memory(one.mesh.surface.sums, other.mesh.surface.sums)
    assert not np.shares_memory(one.mesh.surface.units, other.mesh.surface.units)
    seen = weakref.ref(model)
    del model
    gc.collect()
    assert seen() is None  # the tables go with their model
