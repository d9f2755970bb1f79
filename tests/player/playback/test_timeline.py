"""What is shown at a time: kept values, interpolation, gaps, long and hostile animations."""

import tracemalloc
from fractions import Fraction

import numpy as np
import pytest

from fba.animation import Animation, BodyTrack, FaceTrack
from fba_player.playback._timeline import BLOCK_FRAMES, Timeline
from player_tracks import body_track, face_track


def face_animation(
    frames: list[dict[int, int]], index: list[int] | None = None, rate: str = "25"
) -> Animation:
    at = np.arange(len(frames)) if index is None else np.array(index)
    return Animation(Fraction(rate), at, face=face_track(frames))


def test_between_frames_values_are_interpolated() -> None:
    timeline = Timeline(face_animation([{3: 100}, {3: 200}]))
    assert timeline.faps(0.0)[2] == 100
    assert timeline.faps(0.03)[2] == pytest.approx(175)
    assert timeline.faps(0.04)[2] == 200


def test_before_and_after_the_ends_show_rest() -> None:
    timeline = Timeline(face_animation([{3: 100}, {3: 200}]))
    assert (timeline.faps(-5)[2], timeline.faps(99)[2]) == (100, 200)


def test_skipped_frames_take_their_time() -> None:
    timeline = Timeline(face_animation([{3: 0}, {3: 100}, {3: 200}], index=[10, 20, 21], rate="10"))
    assert (timeline.start, timeline.duration, timeline.end) == (1, Fraction(12, 10), Fraction(22, 10))
    assert timeline.faps(1.5)[2] == pytest.approx(50)
    assert timeline.faps(2.05)[2] == pytest.approx(150)
    assert timeline.position(1.99)[:2] == (0, 1)


def test_unsent_values_are_kept_in_any_order_of_asking() -> None:
    frames: list[dict[int, int]] = [{} for _ in range(3 * BLOCK_FRAMES)]
    frames[0], frames[2 * BLOCK_FRAMES + 5] = {3: 300, 4: 7}, {3: 500}
    timeline = Timeline(face_animation(frames))
    late, early = (3 * BLOCK_FRAMES - 1) / 25, (BLOCK_FRAMES + 3) / 25
    for time, expected in ((late, 500), (early, 300), (late, 500), (0.0, 300)):
        assert timeline.faps(time)[2] == expected
        assert timeline.faps(time)[3] == 7


def test_body_values_are_kept_and_interpolated() -> None:
    frames: list[dict[int, int]] = [{} for _ in range(BLOCK_FRAMES + 4)]
    frames[0], frames[BLOCK_FRAMES + 2], frames[BLOCK_FRAMES + 3] = {5: 1000}, {181: 80}, {5: 2000, 181: 80}
    timeline = Timeline(Animation(Fraction(10), np.arange(len(frames)), body=body_track(frames)))
    assert timeline.baps((BLOCK_FRAMES + 1) / 10)[4] == 1000
    assert timeline.baps((BLOCK_FRAMES + 2.5) / 10)[[4, 180]] == pytest.approx([1500, 80])


def test_angles_go_the_shorter_way_round() -> None:
    half = 314159  # half a turn in units of 1e-5 rad
    frames = [{1: half - 1000, 2: 1000, 181: 500_000}, {1: 1000 - half, 2: 3000, 181: -500_000}]
    timeline = Timeline(Animation(Fraction(10), np.arange(2), body=body_track(frames)))
    shown = timeline.baps(0.05)
    assert abs(shown[0]) == pytest.approx(half, abs=1)  # over the back, not through 0
    assert shown[[1, 180]] == pytest.approx([2000, 0])  # small ones and millimetres go straight
    assert timeline.baps(0.1)[0] == 1000 - half
    timeline.interpolate = False
    assert timeline.baps(0.099)[0] == half - 1000


@pytest.mark.parametrize("turns", [(9000, -20000, 5000), (150_000, 60_000, -30_000)])
def test_between_frames_a_joint_turns_about_one_axis_nearly(turns: tuple[int, int, int]) -> None:
    """Half way between two postures, against the half of the rotation that leads from one to the other."""
    from scipy.spatial.transform import Rotation

    from fba.body import BapSolver, Skeleton

    skeleton = Skeleton.default()
    joint = skeleton.names.index("l_shoulder")
    numbers = (32, 34, 36)  # l_shoulder: flexion, abduct, twisting
    frames = [
        dict(zip(numbers, turns, strict=True)),
        {n: v + 20_000 for n, v in zip(numbers, turns, strict=True)},
    ]
    timeline = Timeline(Animation(Fraction(25), np.arange(2), body=body_track(frames)))
    poses = BapSolver(skeleton).pose(np.stack([timeline.baps(t) for t in (0.0, 0.02, 0.04)]))
    first, middle, last = (Rotation.from_matrix(pose[joint, :3, :3]) for pose in poses)
    half = first * Rotation.from_rotvec((first.inv() * last).as_rotvec() / 2)
    assert np.degrees((first.inv() * last).magnitude()) > 10
    assert np.degrees((half.inv() * middle).magnitude()) < 1.5


@pytest.mark.parametrize("interpolate", [True, False])
def test_many_times_at_once_are_the_same_as_one_by_one(interpolate: bool) -> None:
    count = BLOCK_FRAMES + 30
    faces = [{3: t % 70, 5: -t} if t % 3 else {} for t in range(count)]
    bodies = [{5: 50_000 * (t % 13), 181: t} if t % 4 else {} for t in range(count)]
    index = np.cumsum(np.arange(count) % 3 + 1)
    timeline = Timeline(Animation(Fraction(30), index, face_track(faces), body_track(bodies)))
    timeline.interpolate = interpolate
    times = np.random.default_rng(2).uniform(-1, float(timeline.end) + 1, 60)
    times[:3] = [float(timeline.time_of(frame)) for frame in (0, 77, count - 1)]
    shown_faps, shown_baps = timeline.many(times)
    np.testing.assert_allclose(shown_faps, [timeline.faps(time) for time in times], atol=1e-3)
    np.testing.assert_allclose(shown_baps, [timeline.baps(time) for time in times], atol=1e-6)
    with pytest.raises(ValueError, match="finite"):
        timeline.many([0.0, float("nan")])


def test_ntsc_frames_are_at_their_times() -> None:
    timeline = Timeline(face_animation([{3: t} for t in range(2000)], rate="30000/1001"))
    for frame in (0, 1, 777, 1999):
        assert timeline.position(float(timeline.time_of(frame)))[0] == frame
        assert timeline.faps(float(timeline.time_of(frame)))[2] == frame


@pytest.mark.parametrize("time", [float("nan"), float("inf"), -float("inf")])
def test_times_that_are_not_finite_are_refused(time: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        Timeline(face_animation([{3: 1}])).faps(time)


def test_a_duration_of_years_costs_nothing() -> None:
    timeline = Timeline(face_animation([{3: 0}, {3: 100}], index=[0, 25 * 10**9]))
    assert timeline.faps(5e8)[2] == pytest.approx(50)
    assert timeline.duration > 10**9


def test_memory_does_not_grow_with_length() -> None:
    count = 100_000
    values = np.zeros((count, 68), dtype=np.int32)
    values[:, 5] = np.arange(count)
    mask = np.zeros((count, 68), dtype=bool)
    mask[:, 5] = True
    bodies = BodyTrack(np.zeros((count, 296), dtype=np.int32), np.zeros((count, 296), dtype=bool))
    animation = Animation(Fraction(25), np.arange(count), FaceTrack(values, mask), bodies)
    timeline = Timeline(animation)
    tracemalloc.start()
    for time in (count / 25, 0.0, 2000.0, 3333.3):
        assert timeline.faps(time)[5] == pytest.approx(min(time * 25, count - 1))
        timeline.baps(time)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 40e6
