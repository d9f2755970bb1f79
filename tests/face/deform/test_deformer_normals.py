"""Normals of the deformed face, output arrays, refusals, and the machine code's absence."""

import os
import subprocess
import sys
import tempfile
import textwrap
import threading
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fba.errors import ModelError, RangeError
from fba.face import neutral_points
from fba.face._tables import HEAD, FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.deform._deformer import Deformer
from fba.face.model import FaceModel, Part

FREE = np.full(84, -1)
CENTRE = np.array([0.01, 0.02, -0.03])
RINGS = 24


def sphere(seam: bool = True) -> Part:
    """A ball of 5 cm about CENTRE; with a seam, its first meridian is there twice, as for a texture."""
    polar = np.linspace(0, np.pi, RINGS + 1)
    turns = np.linspace(0, 2 * np.pi, 2 * RINGS + 1)
    turns[-1] = 0  # exactly where it begins
    a, b = np.meshgrid(polar, turns, indexing="ij")
    unit = np.stack([np.sin(a) * np.sin(b), np.cos(a), np.sin(a) * np.cos(b)], axis=-1)
    number = np.arange(unit[..., 0].size).reshape(unit.shape[:2])
    if not seam:
        number[:, -1] = number[:, 0]
    p, q, r, s = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate(
        [np.stack([p, q, r], -1).reshape(-1, 3), np.stack([p, r, s], -1).reshape(-1, 3)]
    )
    vertices = (CENTRE + 0.05 * unit).reshape(-1, 3)
    return Part("skin", "skin", vertices, triangles)


def stretching(part: Part, factor: np.ndarray) -> FaceDefTables:
    """FAP 31 = 100: every vertex `factor` times as far from the centre, along each axis."""
    step = neutral_step(31)
    moves = (part.vertices - CENTRE) * (factor - 1) / (100 * step)
    count = len(part.vertices)
    return FaceDefTables(31, (FaceDefMesh("skin", [0, 1], np.arange(count), moves[:, None]),))


def neutral_step(fap: int) -> float:
    return {31: 45e-3, 29: 11.7e-3}[fap] / 1024


def model(*parts: Part, tables: tuple[FaceDefTables, ...] = ()) -> FaceModel:
    return FaceModel(parts, neutral_points(), FREE, tables)


def frame(**of: float) -> np.ndarray:
    vector = np.zeros(68)
    for name, value in of.items():
        vector[int(name[1:]) - 1] = value
    return vector


def shaded(deformer: Deformer, faps: np.ndarray, local: bool = False) -> tuple[np.ndarray, np.ndarray]:
    shape = (*faps.shape[:-1], len(deformer.model.vertices), 3)
    out, normals = np.full(shape, np.nan, np.float32), np.full(shape, np.nan, np.float32)
    result = (deformer.local if local else deformer)(faps, out, normals)
    assert result is out
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1, atol=1e-6)
    return out.astype(float), normals.astype(float)


def degrees(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    other = other / np.linalg.norm(other, axis=-1, keepdims=True)
    return np.degrees(np.arccos(np.clip((one * other).sum(axis=-1), -1, 1)))


@pytest.mark.parametrize("factor", [(1, 1, 1), (2, 1, 1), (1, 0.5, 1.5)])
@pytest.mark.parametrize("head", [0, 40_000])
def test_normals_of_an_ellipsoid(factor: tuple[float, ...], head: float) -> None:
    part = sphere()
    turn = FaceDefTables(49, transforms=(FaceDefTransform(HEAD, "rotation", (0, 1, 0), (0, 0, -0.1)),))
    deformer = Deformer(model(part, tables=(stretching(part, np.array(factor)), turn)))
    c, s = np.cos(head * 1e-5), np.sin(head * 1e-5)
    about_y = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    _, normals = shaded(deformer, frame(f31=100, f49=head))
    upright = (part.vertices - CENTRE) / factor  # gradient of the ellipsoid's equation, where they are now
    apart = degrees(normals, upright @ about_y.T)
    assert np.median(apart) < 0.7
    inner = np.abs(part.vertices[:, 1] - CENTRE[1]) < 0.045  # round the poles all triangles are slivers
    assert apart[inner].max() < 4
    _, still = shaded(deformer, frame(f31=100, f49=head), local=True)
    np.testing.assert_allclose(normals, still @ about_y.T, atol=2e-6)


def test_a_seam_does_not_show() -> None:
    part, whole = sphere(), sphere(seam=False)
    factor = np.array([1.3, 1, 0.7])
    _, normals = shaded(Deformer(model(part, tables=(stretching(part, factor),))), frame(f31=100))
    _, seamless = shaded(Deformer(model(whole, tables=(stretching(whole, factor),))), frame(f31=100))
    rings, whole_rings = (n.reshape(RINGS + 1, -1, 3)[1:-1] for n in (normals, seamless))  # without poles
    np.testing.assert_array_equal(rings[:, 0], rings[:, -1])
    np.testing.assert_allclose(rings[:, :-1], whole_rings[:, :-1], atol=1e-4)


def folded(angle: float, second_moves: bool = False) -> tuple[np.ndarray, FaceModel]:
    """Two triangles that meet in an edge whose vertices are there twice."""
    c, s = np.cos(angle), np.sin(angle)
    vertices = [[0, 0, 0], [0, 0.1, 0], [-0.1, 0, 0], [0, 0, 0], [0, 0.1, 0], [0.1 * c, 0, -0.1 * s]]
    part = Part("skin", "skin", vertices, [[0, 1, 2], [3, 5, 4]])
    moves = np.zeros((2, 1, 3))
    if second_moves:
        moves[:, :, 2] = 1
    return np.array(vertices), model(
        part, tables=(FaceDefTables(31, (FaceDefMesh("skin", [0, 1], [3, 4], moves),)),)
    )


def test_an_edge_stays_sharp_and_what_parts_is_no_seam() -> None:
    _, normals = shaded(Deformer(folded(np.radians(30))[1]), np.zeros(68))
    bisector = (np.sin(np.radians(15)), 0, np.cos(np.radians(15)))
    np.testing.assert_allclose(normals[[0, 1, 3, 4]], np.tile(bisector, (4, 1)), atol=1e-6)
    np.testing.assert_allclose(normals[2], (0, 0, 1), atol=1e-6)
    for angle, parting in ((80, False), (30, True)):
        _, normals = shaded(Deformer(folded(np.radians(angle), parting)[1]), np.zeros(68))
        np.testing.assert_allclose(normals[:3], np.tile((0, 0, 1), (3, 1)), atol=1e-6)
        tilted = (np.sin(np.radians(angle)), 0, np.cos(np.radians(angle)))
        np.testing.assert_allclose(normals[3:], np.tile(tilted, (3, 1)), atol=1e-6)


def test_several_surfaces_that_meet_in_one_place() -> None:
    """Four triangles with a corner each in one place: two look forward, nearly, and two to the left."""
    vertices, triangles, faces = [], [], [(0, 0.2, 1), (1, 0, 0), (0, -0.2, 1), (1, 0.1, 0)]
    for number, upright in enumerate(np.array(faces)):
        aside = np.cross(upright, (0.3, 1, 0.2))
        vertices += [np.zeros(3), aside, np.cross(upright, aside) / np.linalg.norm(upright)]
        triangles.append(3 * number + np.arange(3))
    _, normals = shaded(Deformer(model(Part("skin", "skin", vertices, triangles))), np.zeros(68))
    areas = [np.cross(*(np.array(vertices)[3 * n + 1 : 3 * n + 3])) for n in range(4)]
    for number in range(4):
        both = areas[number % 2] + areas[number % 2 + 2]
        np.testing.assert_allclose(normals[3 * number], both / np.linalg.norm(both), atol=1e-6)
        alone = areas[number] / np.linalg.norm(areas[number])
        np.testing.assert_allclose(normals[3 * number + 1], alone, atol=1e-6)


def test_parts_without_vertices() -> None:
    empty = Part("nothing", "other", np.zeros((0, 3)), np.zeros((0, 3), dtype=int))
    skin = sphere()
    deformer = Deformer(model(empty, skin, Part("none", "eye", empty.vertices, empty.triangles)))
    assert deformer.part_matrices(np.zeros(68)).shape == (3, 4, 4)
    np.testing.assert_array_equal(shaded(deformer, np.zeros(68))[0], skin.vertices)
    assert Deformer(model(empty))(np.zeros((2, 68))).shape == (2, 0, 3)
    assert Deformer(model(empty))(np.zeros(68)).shape == (0, 3)


def test_only_what_moves_is_shaded_anew_and_the_rest_stays() -> None:
    """Two balls: one's nose is pulled out, the other is another part and only turns."""
    skin = sphere()
    eye = Part("eye", "eye", skin.vertices + np.float32(0.2), skin.triangles)
    nose = np.flatnonzero(skin.vertices[:, 2] > CENTRE[2] + 0.045)
    pull = FaceDefMesh("skin", [-1, 0, 1], nose, np.tile((0, 0, 1), (len(nose), 2, 1)))
    turn = FaceDefTransform("eye", "rotation", (1, 0, 0), tuple(CENTRE + 0.2))
    tables = (FaceDefTables(31, (pull,)), FaceDefTables(25, transforms=(turn,)))
    deformer = Deformer(model(skin, eye, tables=tables))
    quarter = np.pi / 2 * 1e5
    before = shaded(deformer, np.zeros(68))[1]
    after = shaded(deformer, frame(f31=300, f25=quarter))[1]
    again = shaded(deformer, np.zeros(68))[1]
    np.testing.assert_array_equal(again, before)
    count = len(skin.vertices)
    near = np.isin(skin.triangles, nose).any(axis=1)
    changed = degrees(after[:count], before[:count]) > 0.1
    place = {tuple(v): i for i, v in enumerate(skin.vertices.tolist())}
    same = np.array([place[tuple(v)] for v in skin.vertices.tolist()])  # the seam's two sides
    ring = np.isin(same, same[np.unique(skin.triangles[near])])
    assert changed.any()
    assert not changed[~ring].any()
    x, y, z = before[count:].T
    np.testing.assert_allclose(after[count:], np.stack([x, -z, y], axis=-1), atol=2e-6)


def test_normals_of_a_part_that_is_stretched_by_a_transform() -> None:
    eye = sphere()
    wide = FaceDefTransform("skin", "scale", (1, 0, 0), tuple(CENTRE))
    deformer = Deformer(model(eye, tables=(FaceDefTables(29, transforms=(wide,)),)))
    _, normals = shaded(deformer, frame(f29=1 / neutral_step(29)))
    inner = np.abs(eye.vertices[:, 1] - CENTRE[1]) < 0.045
    assert degrees(normals, (eye.vertices - CENTRE) / (2, 1, 1))[inner].max() < 1.5


def test_triangles_without_area_keep_the_neutral_normal() -> None:
    part = Part("skin", "skin", np.eye(4)[:, :3] * 0.1, [[0, 1, 2]])
    collapse = FaceDefMesh("skin", [0, 1], [0, 1, 2], -part.vertices[:3, None] / neutral_step(31))
    deformer = Deformer(model(part, tables=(FaceDefTables(31, (collapse,)),)))
    vertices, normals = shaded(deformer, frame(f31=1))
    np.testing.assert_allclose(vertices, 0, atol=1e-8)
    np.testing.assert_allclose(normals[:3], np.full((3, 3), np.sqrt(1 / 3)), atol=1e-6)
    np.testing.assert_allclose(normals[3], part.normals[3], atol=1e-6)


# Arrays and refusals


def lively() -> Deformer:
    part = sphere()
    turn = FaceDefTransform(HEAD, "rotation", (0, 1, 0))
    return Deformer(
        model(part, tables=(stretching(part, np.array([2, 1, 1])), FaceDefTables(49, (), (turn,))))
    )


@pytest.mark.parametrize(
    "dtype", [np.int8, np.uint16, np.int32, np.int64, np.float32, np.float64, bool, list]
)
def test_any_kind_of_number(dtype: type) -> None:
    deformer = lively()
    expected = deformer(frame(f31=1, f49=1))
    vector = frame(f31=1, f49=1)
    np.testing.assert_array_equal(
        deformer(vector.tolist() if dtype is list else vector.astype(dtype)), expected
    )


def test_frames_in_a_batch_equal_frames_alone() -> None:
    deformer = lively()
    frames = np.random.default_rng(2).normal(0, 200, (150, 68))  # more than one block
    out, normals = shaded(deformer, frames)
    np.testing.assert_array_equal(deformer(np.asfortranarray(frames)), out)
    for row in (0, 63, 64, 149):
        one, upright = shaded(deformer, frames[row])
        np.testing.assert_array_equal(one, out[row])
        np.testing.assert_array_equal(upright, normals[row])
    assert deformer(frames[:0]).shape == (0, len(deformer.model.vertices), 3)
    assert deformer.feature_points(frames[:0]).shape == (0, 84, 3)
    assert deformer.head_matrices(frames[0]).shape == (4, 4)
    assert deformer.part_matrices(frames[0]).shape == (1, 4, 4)


def test_the_zero_frame_is_the_neutral_face() -> None:
    deformer = lively()
    np.testing.assert_array_equal(deformer(np.zeros(68)), deformer.model.vertices)
    np.testing.assert_array_equal(deformer.head_matrices(np.zeros(68)), np.eye(4))


def methods(deformer: Deformer) -> tuple[Callable[[object], object], ...]:
    """All that take FAPs."""
    return (
        deformer,
        deformer.local,
        deformer.head_matrices,
        deformer.part_matrices,
        deformer.feature_points,
    )


@pytest.mark.parametrize("shape", [(67,), (2, 69), (1, 1, 68), (), (68, 1)])
def test_other_shapes_are_refused(shape: tuple[int, ...]) -> None:
    deformer = lively()
    for method in methods(deformer):
        with pytest.raises(ValueError, match="68"):
            method(np.zeros(shape))


@pytest.mark.parametrize(
    "faps", [np.zeros(68, complex), ["1"] * 68, [None] * 68, np.zeros(68, "datetime64[s]")]
)
def test_faps_that_are_not_numbers_are_refused(faps: object) -> None:
    with pytest.raises(ValueError, match="numbers"):
        lively()(faps)  # type: ignore[arg-type]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 2.0**31, -1e300])
def test_values_that_no_stream_can_carry_are_refused(value: float) -> None:
    frames = np.zeros((3, 68))
    frames[2, 30] = value
    deformer = lively()
    for method in methods(deformer):
        with pytest.raises(RangeError, match=r"frame 2, FAP 31 raise_l_i_eyebrow") as caught:
            method(frames)
        assert caught.value.frame == 2
    with pytest.raises(RangeError, match=r"^FAP 31"):
        deformer(frames[2])


def test_extreme_values_stay_finite() -> None:
    deformer = lively()
    for value in (2**31 - 1, -(2**31)):
        out, normals = shaded(deformer, np.full(68, value))
        assert np.isfinite(out).all()
        assert np.isfinite(normals).all()


def test_targets_that_do_not_fit_are_refused() -> None:
    deformer = lively()
    count = len(deformer.model.vertices)
    good = np.empty((count, 3), np.float32)
    frozen = good.copy()
    frozen.flags.writeable = False
    bad = [
        np.empty((count, 3)), np.empty((count + 1, 3), np.float32), np.empty((1, count, 3), np.float32),
        np.empty((count, 4), np.float32)[:, :3], np.empty((3, count), np.float32).T, frozen, good.tolist(),
    ]  # fmt: skip
    for target in bad:
        with pytest.raises(ValueError, match="out must be"):
            deformer(np.zeros(68), out=target)  # type: ignore[arg-type]
        with pytest.raises(ValueError, match="normals must be"):
            deformer(np.zeros(68), normals=target)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="share memory"):
        deformer(np.zeros(68), out=good, normals=good)


@pytest.mark.parametrize("count", [0, 1, 40, 3000])
def test_a_deformer_of_some_vertices_moves_them_alike(count: int) -> None:
    every = Deformer(FaceModel.default())
    random = np.random.default_rng(count)
    faps, size = random.integers(-400, 400, (3, 68)), len(every.model.vertices)
    rows = random.choice(size, count, replace=False)
    positions, normals = shaded(every, faps)
    out, units = np.full((2, *positions.shape), np.nan, np.float32)
    every.restrict(rows)(faps, out, units)
    np.testing.assert_array_equal(out[:, rows], positions[:, rows])
    np.testing.assert_array_equal(units[:, rows], normals[:, rows])
    assert np.isnan(out).all(axis=2).sum() == 3 * (size - count)
    with pytest.raises(IndexError):
        every.restrict([size])


def test_no_allocation_when_arrays_are_given() -> None:
    deformer = lively()
    count = len(deformer.model.vertices)
    out, normals = (np.empty((count, 3), np.float32) for _ in range(2))
    vector = frame(f31=50, f49=20)
    rounds = []
    for _ in range(400):  # numba and Python fill their free lists
        deformer(vector, out, normals)
    tracemalloc.start()
    try:
        # What replaces objects from before the start counts as new: let all that a call replaces be seen.
        for _ in range(100):
            deformer(vector, out, normals)
        for _ in range(50):
            before = tracemalloc.get_traced_memory()[0]
            tracemalloc.reset_peak()
            for _ in range(20):
                deformer(vector, out, normals)
            after, peak = tracemalloc.get_traced_memory()
            rounds.append((peak - before, after - before))
    finally:
        tracemalloc.stop()
    # What the code allocates or keeps, it does in every round; free lists that turn over show in some.
    most, kept = map(min, zip(*rounds, strict=True))
    assert most < 4096  # a few objects of Python; one array of vertices would be 14,700 bytes
    assert kept < 1024


def test_threads_do_not_disturb_each_other() -> None:
    deformer = lively()
    frames = np.random.default_rng(4).normal(0, 200, (4, 68))
    expected = deformer(frames)
    wrong = np.zeros(4, dtype=int)

    def work(row: int) -> None:
        for _ in range(40):
            wrong[row] += not np.array_equal(deformer(frames[row]), expected[row])

    threads = [threading.Thread(target=work, args=(row,)) for row in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(300)
    assert not any(thread.is_alive() for thread in threads)
    assert not wrong.any()


def test_displacements_that_no_float_holds_are_refused() -> None:
    part = sphere()
    huge = FaceDefMesh("skin", [0, 1], [0], [[[3e38, 0, 0]]])
    with pytest.raises(ModelError, match=r"FAP 31, part 'skin'.*too large"):
        Deformer(model(part, tables=(FaceDefTables(31, (huge,)),)))
    turn = FaceDefTransform("skin", "rotation", (1e300, 0, 0))
    with pytest.raises(ModelError, match=r"FAP 31, rotation of 'skin'.*too large"):
        Deformer(model(part, tables=(FaceDefTables(31, (), (turn,)),)))


def test_same_without_machine_code() -> None:
    """The loops as plain Python give the same vertices and normals."""
    script = textwrap.dedent(
        """
        import sys
        import numpy as np
        from fba.compiled import is_compiled
        from test_deformer_normals import frame, lively, shaded

        frames = np.stack([frame(f31=70, f49=20_000), frame(f31=-40)])
        deformer = lively()
        with open(sys.argv[1], "wb") as file:
            np.savez(file, *shaded(deformer, frames), deformer.feature_points(frames), is_compiled())
        """
    )
    here, results = str(Path(__file__).parent), []
    with tempfile.TemporaryDirectory() as folder:
        for disabled in ("0", "1"):
            environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled, "PYTHONPATH": here}
            path = Path(folder) / f"{disabled}.npz"
            subprocess.run(
                [sys.executable, "-W", "error", "-c", script, str(path)], env=environment, check=True
            )
            with np.load(path) as stored:
                results.append([stored[f"arr_{i}"] for i in range(4)])
    assert not results[1][3]
    for one, other in zip(results[0][:3], results[1][:3], strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)
