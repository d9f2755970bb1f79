"""Faces within a tolerance: measured on every vertex of the decoded stream, with the deformer alone."""

import warnings
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation, EncoderOptions, FaceTrack
from fba.errors import RangeError
from fba.face import Deformer, FaceModel, resolve
from fba.face._tables import FaceDefMesh, FaceDefTables
from fba.face.deform.displacements import DisplacementMeter
from fba.parameters import faps
from fba.planning import Tolerance, encode_planned, encode_within_tolerance
from fba.planning._mesh_error import ErrorBasis
from small_face import small_face

STEPS = np.array([1, 1, *(one.step for one in faps()[2:])])


def shown_at(decoded: Animation, index: np.ndarray) -> np.ndarray:
    """Return what a player shows at the frames of the source: FAPs (T, 68)."""
    assert decoded.face is not None
    shown = resolve(decoded.face).astype(float)
    sent = decoded.index - decoded.index[0]
    return np.stack([np.interp(index - index[0], sent, one) for one in shown.T], axis=1)


def measure(source: Animation, data: bytes) -> tuple[float, float, float]:
    """Return the largest distance of a vertex, in mm, and of the angles of head and eyes, in degrees."""
    assert source.face is not None
    before, after = resolve(source.face).astype(float), shown_at(fba.decode(data), source.index)
    deformer, largest = Deformer(FaceModel.default()), 0.0
    for start in range(0, len(before), 50):
        rows = slice(start, start + 50)
        moved = deformer.local(before[rows]).astype(float) - deformer.local(after[rows])
        largest = max(largest, float(np.linalg.norm(moved, axis=2).max()) * 1000)
    angles = np.degrees(np.abs(before - after).max(axis=0) * 1e-5)
    return largest, float(angles[47:50].max()), float(angles[22:26].max())


def made_face(seed: int, count: int = 120) -> FaceTrack:
    """Return a face that speaks, blinks and turns: both sides alike but for the eyebrows."""
    rng = np.random.default_rng(seed)
    time = np.arange(count) / 25
    values = np.zeros((count, 68))

    def wave(size: float) -> np.ndarray:
        return size * (
            np.sin(time * rng.uniform(3, 12) + rng.uniform(0, 6)) + np.sin(time * rng.uniform(0.5, 3))
        )

    for columns, size in (
        ((2,), 150), ((3, 50), 60), ((4, 51), 60), ((11, 12, 58, 59), 50), ((30, 31), 60), ((32,), 60),
        ((33,), 60), ((47,), 6000), ((48,), 9000), ((22, 23), 8000),
    ):  # fmt: skip
        values[:, columns] = wave(size)[:, None]
    values[:, 2] = np.abs(values[:, 2])
    values[:, 18:20] = (1000 * np.exp(-(((time - 1.3) / 0.09) ** 2)))[:, None]
    values = np.rint(values / STEPS) * STEPS
    return FaceTrack(values.astype(np.int32), np.tile(values.any(axis=0), (count, 1)))


@pytest.fixture(scope="module")
def talk() -> Animation:
    return Animation(25, np.arange(120), made_face(1))


@pytest.fixture(scope="module")
def coded(talk: Animation) -> dict[float, bytes]:
    return {mm: encode_within_tolerance(talk, Tolerance(face=mm / 1000))[0] for mm in (0.3, 0.5, 1.0)}


@pytest.mark.parametrize("mm", [0.3, 0.5, 1.0])
def test_no_vertex_moves_further(talk: Animation, coded: dict[float, bytes], mm: float) -> None:
    largest, head, gaze = measure(talk, coded[mm])
    assert 0.5 * mm < largest <= mm
    assert head <= 0.1
    assert 0.3 < gaze <= 1


def test_every_frame_may_be_sent(talk: Animation) -> None:
    data, report = encode_within_tolerance(talk, every_frame=True)
    assert report.left_out == 0
    assert measure(talk, data)[0] <= 0.5


def test_streams_are_smaller_the_more_may_be_lost(talk: Animation, coded: dict[float, bytes]) -> None:
    compact = len(encode_planned(talk, preset="compact")[0])
    assert len(coded[1.0]) < len(coded[0.5]) < len(coded[0.3]) < 0.7 * compact


def test_the_report_says_what_was_measured(talk: Animation) -> None:
    data, report = encode_within_tolerance(talk)
    largest, head, gaze = measure(talk, data)
    decoded = fba.decode(data)
    assert report.face.largest * 1000 == pytest.approx(largest, abs=1e-4)
    assert (report.face.head, report.face.gaze) == pytest.approx((head, gaze), abs=1e-6)
    assert 0 < report.face.percentile_99 < report.face.largest
    assert report.left_out == len(talk) - len(decoded) > 0
    assert report.statistics.planes == len(decoded)
    worst = np.stack([resolve(talk.face), shown_at(decoded, talk.index)])[:, report.face.frame]  # type: ignore[arg-type]
    first, second = Deformer(FaceModel.default()).local(worst)
    off = np.linalg.norm(first.astype(float) - second, axis=1)
    assert off[report.face.vertex] == pytest.approx(off.max(), abs=1e-7)


def test_visemes_and_expressions_are_kept_and_no_frame_of_them_left_out() -> None:
    face = made_face(2, 60)
    mask, viseme, expression = face.mask.copy(), face.viseme.copy(), face.expression.copy()
    mask[:, :2] = True
    viseme[:, 0], viseme[:, 2] = np.arange(60) // 10 + 1, 63
    expression[:, 0], expression[:, 1] = 3, 40
    spoken = Animation(25, np.arange(60), FaceTrack(face.values, mask, viseme, expression))
    data, report = encode_within_tolerance(spoken)
    decoded = fba.decode(data).face
    assert not report.compact
    assert np.array_equal(decoded.viseme[:, [0, 1]], viseme[:, [0, 1]])
    assert np.array_equal(decoded.expression[:, 0], expression[:, 0])
    assert measure(spoken, data)[0] <= 0.5


def test_a_fap_sent_as_0_overrides_its_mate_and_a_viseme() -> None:
    values = np.zeros((40, 68), dtype=np.int32)
    values[:, 31 - 1] = np.rint(60 * np.sin(np.arange(40) / 5)) * 2  # raise_l_i_eyebrow
    brows = Animation(
        25, np.arange(40), FaceTrack(values, np.tile(np.isin(np.arange(68), [30, 31]), (40, 1)))
    )
    data, report = encode_within_tolerance(brows)
    assert not report.compact
    assert measure(brows, data)[0] <= 0.5
    mask = np.tile(np.isin(np.arange(68), [0, 2, 30]), (40, 1))
    viseme = np.tile(np.array([10, 0, 63, 0], dtype=np.int16), (40, 1))
    shut = Animation(25, np.arange(40), FaceTrack(values, mask, viseme))
    data, report = encode_within_tolerance(shut)
    decoded = fba.decode(data).face
    assert not report.compact
    assert decoded.mask[:, 2].all()
    assert measure(shut, data)[0] <= 0.5


def test_definitions_of_visemes_are_left_as_they_are() -> None:
    face = made_face(3, 40)
    mask, viseme = face.mask.copy(), face.viseme.copy()
    mask[:, 0] = True
    viseme[:, 0], viseme[:, 2], viseme[5, 3] = 4, 63, 1
    defining = Animation(25, np.arange(40), FaceTrack(face.values, mask, viseme))
    data, report = encode_within_tolerance(defining)
    assert report.compact
    assert data == encode_planned(defining, preset="compact")[0]


def test_frames_that_the_source_skips_are_kept_apart(talk: Animation) -> None:
    index = np.cumsum(np.tile([1, 1, 1, 3], 30)) - 1
    data, _ = encode_within_tolerance(Animation(25, index, talk.face))
    assert measure(Animation(25, index, talk.face), data)[0] <= 0.5


def test_what_is_sent_may_change_and_stop() -> None:
    face = made_face(4)
    mask = face.mask.copy()
    mask[:40, [30, 31, 32, 33]] = False
    mask[80:, [2, 3]] = False
    changing = Animation(25, np.arange(120), FaceTrack(face.values, mask))
    data, report = encode_within_tolerance(changing)
    assert report.statistics.intra_planes >= 2
    assert measure(changing, data)[0] <= 0.5


def test_ramps_that_only_single_steps_carry() -> None:
    """With frames left out, changes would be beyond 1860 steps; an I plane has no room for the value."""
    values = np.zeros((25, 68), dtype=np.int32)
    values[:, 14 - 1] = 1500 * np.minimum(np.arange(25), np.arange(25)[::-1])  # thrust_jaw, in steps of 1
    ramp = Animation(25, np.arange(25), FaceTrack(values, np.tile(np.arange(68) == 13, (25, 1))))
    data, _ = encode_within_tolerance(ramp)
    assert measure(ramp, data)[0] <= 0.5


def test_values_between_steps_and_a_tolerance_too_small_for_them() -> None:
    face = made_face(5, 40)
    uneven = FaceTrack(face.values + np.where(face.mask, 1, 0).astype(np.int32) * (STEPS > 1), face.mask)
    animation = Animation(25, np.arange(40), uneven)
    data, _ = encode_within_tolerance(animation)
    assert measure(animation, data)[0] <= 0.5
    with pytest.raises(RangeError, match=r"no quantiser keeps within 0\.0001 mm, .* allow that much"):
        encode_within_tolerance(animation, Tolerance(face=1e-7))


def test_a_tolerance_that_only_the_exact_values_meet(talk: Animation) -> None:
    data, report = encode_within_tolerance(talk, Tolerance(face=1e-9, head=1e-6, gaze=1e-6))
    assert report.compact
    assert measure(talk, data) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_frames(talk: Animation, count: int) -> None:
    short = talk[25 : 25 + count]
    data, _ = encode_within_tolerance(short)
    assert measure(short, data)[0] <= 0.5
    assert len(data) <= len(encode_planned(short, preset="compact")[0])


def test_still_faces_and_no_face() -> None:
    still = Animation(
        25, np.arange(90), FaceTrack(np.tile(made_face(6).values[30], (90, 1)), np.ones((90, 68), bool))
    )
    data, report = encode_within_tolerance(still)
    assert measure(still, data)[0] <= 0.5
    assert report.left_out == 88  # the first frame and the last tell how long it is
    nothing = Animation(25, np.arange(3), FaceTrack.empty(3))
    assert len(fba.decode(encode_within_tolerance(nothing)[0])) == 3
    with pytest.raises(ValueError, match="no frame to encode"):
        encode_within_tolerance(nothing[:0])


def test_wrong_tolerances() -> None:
    for wrong in ({"face": 0.0}, {"head": -1.0}, {"joint": float("nan")}, {"foot": float("inf")}):
        with pytest.raises(ValueError, match=f"a tolerance is a positive number; {next(iter(wrong))} is"):
            Tolerance(**wrong)


def test_slopes_are_valid_until_a_closed_jaw_would_open() -> None:
    basis = ErrorBasis(DisplacementMeter(FaceModel.default()), Tolerance())
    shown = np.zeros((2, 68))
    shown[:, 2] = -50, 300  # open_jaw: below 0 it moves nothing
    slopes = basis.slopes((2,), shown)
    assert slopes.highest[0] <= 0 <= slopes.lowest[1]
    lengths = np.linalg.norm(slopes.table[slopes.which], axis=2).max(axis=1)
    assert lengths[0] == 0 < lengths[1] == slopes.largest


def test_displacements_are_those_of_the_deformer() -> None:
    rng = np.random.default_rng(0)
    one = rng.normal(0, 150, (40, 68))
    other = one + rng.normal(0, 30, (40, 68)) * (rng.random((40, 68)) < 0.3)
    other[:5] = one[:5]
    model = FaceModel.default()
    off = DisplacementMeter(model).measure(one, other)
    deformer = Deformer(model)
    distances = np.linalg.norm(deformer.local(one).astype(float) - deformer.local(other), axis=2)
    assert off.largest == pytest.approx(distances.max(axis=1), abs=1e-7)
    assert np.take_along_axis(distances, off.worst[:, None], 1)[:, 0] == pytest.approx(off.largest, abs=1e-7)
    movable = (deformer.local(one) != deformer.local(np.zeros(68))).any(axis=(0, 2))
    assert off.percentile(99) == pytest.approx(np.percentile(distances[:, movable], 99), rel=0.02)


def test_vertices_too_far_apart_for_their_squares_are_counted_as_the_furthest() -> None:
    """2e20 m squared is no 32-bit float: the number of the distance was that of no count."""
    head = small_face()
    (table,) = (one for one in head.tables if one.fap == 3)
    (mesh,) = table.meshes
    far = FaceDefMesh(mesh.part, mesh.borders, mesh.vertices, mesh.displacements * 1e20)
    others = tuple(one for one in head.tables if one.fap != 3)
    model = FaceModel(head.parts, head.points, head.bound, (*others, FaceDefTables(3, (far,))), name="far")
    one, other = np.zeros((3, 68)), np.zeros((3, 68))
    other[:, 2] = 0, 1, 500
    off = DisplacementMeter(model).measure(one, other)
    assert off.largest[0] == 0
    assert off.largest[2] > 1e18
    assert off.counts[-1] == 2 * len(mesh.vertices)


def real_faces(shared: Path) -> Iterator[Animation]:
    for path in sorted((shared / "vectors/real").glob("*.fba")):
        with warnings.catch_warnings(action="ignore"):
            animation = fba.decode(path.read_bytes(), bap_steps="visage")
        if animation.face is not None and animation.face.values.any() and len(animation) < 57:
            yield replace(animation, body=None)


def test_short_real_faces(shared: Path) -> None:
    """The shortest; of all 24, 177 s long, the rate is 0.65 kbit/s."""
    bits = seconds = 0.0
    for animation in real_faces(shared):
        data, report = encode_within_tolerance(animation, options=EncoderOptions(mark=False))
        assert measure(animation, data)[0] <= 0.5
        assert report.face is not None
        bits, seconds = bits + 8 * len(data), seconds + len(animation) / float(animation.rate)
    assert bits <= 1300 * seconds


def test_a_captured_face_needs_many_repairs() -> None:
    """With eight, the search came to nothing within the tolerance, and 10 kbit/s were sent."""
    capture = fba.read(Path(str(files("fba") / "samples" / "talk.c3d")), rate=50)
    animation = replace(capture, body=None)
    data, report = encode_within_tolerance(animation, options=EncoderOptions(mark=False))
    assert report.face is not None
    assert 0.4e-3 < report.face.largest <= 0.5e-3
    assert 8 * len(data) < 4200 * float(animation.duration)
