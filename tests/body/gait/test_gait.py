"""Walking: what feet do, measured on points of the posed body."""

import csv
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from fba import Animation, BodyTrack
from fba.body import BapSolver, Skeleton, gait
from fba.errors import ModelError
from fba.parameters import bap_numbers

CHARACTERS = ("normal", "bored", "proud", "hurried", "sneaking")
NUMBERS = bap_numbers()
MILLIMETRES_2 = 0.002


def feet(animation: Animation, skeleton: Skeleton | None = None) -> np.ndarray:
    """(2, 3, T, 3): left and right; heel, below the metatarsal joint, tip of the toes; metres.

    The heel is 54 mm behind the ankle on the ground in the default posture and moves with it; the toes reach
    62 mm from the metatarsal joint, whose centre is 9.2 mm above the ground.
    """
    skeleton = skeleton or Skeleton.default()
    scale = skeleton.centres[skeleton.number("l_hip")][1] / 0.9364
    matrices = BapSolver(skeleton).pose(animation.body.values)
    result = np.zeros((2, 3, len(animation), 3))
    for row, side in enumerate("lr"):
        for point, (joint, ahead) in enumerate(
            (("ankle", -0.054), ("metatarsal", 0.0), ("metatarsal", 0.062))
        ):
            number = skeleton.number(f"{side}_{joint}")
            offset = np.array([0.0, -skeleton.centres[number][1], ahead * scale])
            frames = matrices[:, number]
            result[row, point] = frames[:, :3, 3] + frames[:, :3, :3] @ offset
    return result


def on_ground(points: np.ndarray) -> np.ndarray:
    """(2, 3, T)."""
    return points[..., 1] <= MILLIMETRES_2


def degrees(animation: Animation, name: str) -> np.ndarray:
    return np.degrees(animation.body.values[:, NUMBERS[name] - 1] * 1e-5)


def period(animation: Animation, cycles: int) -> int:
    return (len(animation) - 1) // cycles


STRIDES = [(name, None) for name in CHARACTERS] + [
    ("bored", 0.7),
    ("normal", 0.3),
    ("normal", 1.0),
    ("normal", 1.7),
    ("hurried", 1.2),
    ("proud", 1.6),
    ("sneaking", 0.6),
]


@pytest.mark.parametrize(("character", "stride"), STRIDES)
@pytest.mark.parametrize("interpolation", ["smooth", "linear"])
def test_feet_stand_on_the_ground(character: str, stride: float | None, interpolation: str) -> None:
    walk = gait.walk(stride, character, cycles=3, interpolation=interpolation)
    points = feet(walk)
    assert points[..., 1].min() > -MILLIMETRES_2
    down = on_ground(points)
    assert down.any(axis=(0, 1)).all(), "both feet are in the air"
    for side in range(2):
        for point in range(3):
            runs = np.flatnonzero(np.diff(np.concatenate([[0], down[side, point], [0]])))
            assert len(runs), "a point of the sole that never touches"
            for start, stop in runs.reshape(-1, 2):
                path = points[side, point, start:stop][:, [0, 2]]
                assert np.linalg.norm(path - path[0], axis=1).max() < MILLIMETRES_2


@pytest.mark.parametrize(("character", "stride"), STRIDES)
def test_stance_is_sixty_percent(character: str, stride: float | None) -> None:
    walk = gait.walk(stride, character, cycles=3)
    for foot in on_ground(feet(walk))[..., :-1].any(axis=1):
        assert 0.57 <= foot.mean() <= 0.63


@pytest.mark.parametrize(("character", "stride"), STRIDES)
def test_the_cycle_closes_one_stride_on(character: str, stride: float | None) -> None:
    walk = gait.walk(stride, character, cycles=2)
    frames = period(walk, 2)
    forward = NUMBERS["HumanoidRoot_tr_frontal"] - 1
    first, later = walk.body.values[0].copy(), walk.body.values[frames].copy()
    wanted = 1000 * (gait.Character.named(character).stride if stride is None else stride)
    assert later[forward] - first[forward] == round(wanted)
    later[forward] = first[forward]
    np.testing.assert_array_equal(first, later)
    heels = feet(walk)[:, 0]
    for side in range(2):
        gap = heels[side, -1] - heels[side, 0]
        assert gap == pytest.approx((0.0, 0.0, 2e-3 * round(wanted)), abs=1e-6)


@pytest.mark.parametrize("character", CHARACTERS)
def test_halves_are_mirror_images(character: str) -> None:
    """The second half of the cycle is the first with the legs exchanged, the pelvis negated."""
    seconds = Fraction(gait.Character.named(character).seconds)
    walk = gait.walk(character=character, cycles=1, rate=64 / seconds)
    frames = len(walk) - 1
    assert frames == 64
    half = frames // 2
    for joint in ("hip_flexion", "knee_flexion", "ankle_flexion", "metatarsal_flexion", "elbow_flexion"):
        right, left = degrees(walk, f"r_{joint}")[:-1], degrees(walk, f"l_{joint}")[:-1]
        # the root's whole millimetres are not the same in both halves
        assert np.abs(np.roll(left, half) - right).max() < 0.3
    for bap in ("sacroiliac_torsion", "sacroiliac_roll"):
        angle = degrees(walk, bap)[:-1]
        assert np.abs(angle).max() > 1.0
        assert angle == pytest.approx(-np.roll(angle, half), abs=1e-3)


EXTREMA = [
    # row of the table in docs/gait.md; angle, kind and range of frames of the extremum
    ("knee straightest: extended", "knee", "max", 28, 33),
    ("carrying knee bent most: recoil", "knee", "min", 2, 8),
    ("carrying knee straightest: passing", "knee", "max", 6, 16),
    ("carrying ankle stretched most: recoil", "ankle", "min", 0, 8),
    ("carrying ankle bent up most: anticipation", "ankle", "max", 4, 18),
    ("thigh furthest back: extended, rear leg", "hip", "min", 10, 24),
    ("toes bent up most: extended, rear leg", "metatarsal", "max", 10, 24),
    ("ankle stretched most: recoil, swinging leg", "ankle", "min", 17, 24),
    ("knee bent most: passing, swinging leg", "knee", "min", 17, 28),
    ("thigh raised most: anticipation, swinging leg", "hip", "max", 20, 32),
    ("ankle bent up most: anticipation, swinging leg", "ankle", "max", 23, 30),
]
WINTER = Path(__file__).with_name("winter_natural_cadence.csv")
PAGE = Path(__file__).parents[3] / "docs" / "gait.md"


@pytest.fixture(scope="module")
def fine_walk() -> Animation:
    """Two normal cycles of 128 frames each."""
    walk = gait.walk(cycles=2, rate=128 / Fraction(gait.Character.named("normal").seconds))
    assert period(walk, 2) == 128
    return walk


@pytest.mark.parametrize(("row", "joint", "kind", "start", "stop"), EXTREMA)
def test_poses_have_the_extrema_that_the_page_says(
    fine_walk: Animation, row: str, joint: str, kind: str, start: int, stop: int
) -> None:
    """Those of the source's table 5-2, and where they differ, of people."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    line = next(line for line in lines if line.startswith(f"| {row} |"))
    cells = line.replace("*", "").split("|")[2:5]
    table, here, people = (float(cell) if cell.strip() else None for cell in cells)
    sign = 1 if kind == "max" else -1
    curve = sign * degrees(fine_walk, f"r_{joint}_flexion")
    assert (start * 4 + int(np.argmax(curve[start * 4 : stop * 4]))) / 4 == pytest.approx(here, abs=0.5)
    assert table is not None
    assert here is not None
    assert ("**" in line) == (abs(here - table) > 1)
    if people is not None:
        means = [line for line in WINTER.read_text(encoding="utf-8").splitlines() if line[0] != "#"]
        frames = {0.32 * float(one["percent"]): float(one[joint]) for one in csv.DictReader(means)}
        bent = -sign if joint == "knee" else sign  # a bent knee is positive there
        best = max((frame for frame in frames if start <= frame < stop), key=lambda one: bent * frames[one])
        assert best == pytest.approx(people, abs=0.1)


def test_toes_and_pelvis_move_as_in_the_table(fine_walk: Animation) -> None:
    toes = degrees(fine_walk, "r_metatarsal_flexion")
    assert np.abs(toes[: 8 * 4]).max() < 0.1  # flat while the foot is
    assert toes[16 * 4] > 20  # extended: the toes of the rear foot stay flat
    turn, hang = (degrees(fine_walk, f"sacroiliac_{name}")[:129] for name in ("torsion", "roll"))
    assert np.argmax(turn) in (0, 128)  # extended: the right side ahead
    assert turn[8 * 4] == pytest.approx(0.0, abs=1e-3)
    assert np.argmin(hang) == 8 * 4  # passing: the left hip hangs
    assert hang[0] == pytest.approx(0.0, abs=1e-3)


def test_thighs_keep_their_direction_as_the_pelvis_turns() -> None:
    character = gait.Character.named("normal")
    walk = gait.walk(cycles=1)
    matrices = BapSolver().pose(walk.body.values)
    skeleton = Skeleton.default()
    pelvis = matrices[:, skeleton.number("sacroiliac"), :3, :3]
    foot = matrices[:9, skeleton.number("r_metatarsal"), :3, :3]
    turn = np.degrees(np.arctan2(pelvis[:, 0, 2], pelvis[:, 2, 2]))
    assert turn.max() - turn.min() == pytest.approx(2 * character.pelvis.turn, abs=0.1)
    heading = np.degrees(np.arctan2(foot[:, 0, 2], foot[:, 2, 2]))
    assert heading.max() - heading.min() < 2.0


def test_flat_feet_keep_the_coupling() -> None:
    """Hip + knee = ankle while the foot is flat, here under a level pelvis."""
    for name in ("normal", "bored", "proud"):
        character = gait.Character.named(name)
        walk = gait.walk(character=name, cycles=1)
        frames = len(walk) - 1
        passing = round(frames / 4)
        total = sum(degrees(walk, f"r_{joint}_flexion")[passing] for joint in ("hip", "knee", "ankle"))
        assert total == pytest.approx(character.pelvis.tilt, abs=1.5)


def test_palms_reach_their_goals() -> None:
    """In the passing pose of the default stride, in lengths of the arm from the shoulder."""
    skeleton = Skeleton.default()
    walk = gait.walk(cycles=1, rate=300)  # arms come a little after the legs
    matrices = BapSolver().pose(walk.body.values)
    frame = round((0.25 + 0.02) * (len(walk) - 1))
    place = {j: matrices[frame, skeleton.number(f"r_{j}"), :3, 3] for j in ("shoulder", "elbow", "middle0")}
    rest = {j: skeleton.centres[skeleton.number(f"r_{j}")] for j in ("shoulder", "elbow", "middle0")}
    arm = np.linalg.norm(rest["elbow"] - rest["shoulder"]) + np.linalg.norm(rest["middle0"] - rest["elbow"])
    goal = gait.Character.named("normal").poses["passing", "stance"]
    gap = place["middle0"] - place["shoulder"]
    assert -gap[0] == pytest.approx(goal.out * arm, abs=0.02)
    assert -gap[1] == pytest.approx(goal.down * arm, abs=0.02)
    assert gap[2] == pytest.approx(goal.forward * arm, abs=0.02)


def test_stride_sets_the_speed() -> None:
    lengths = [gait.advance(gait.walk(stride, cycles=2)) for stride in (0.7, 1.0, 1.4)]
    assert lengths == pytest.approx([1400, 2000, 2800])
    assert len({len(gait.walk(stride, cycles=2)) for stride in (0.7, 1.0, 1.4)}) == 1


def test_rates_and_lengths() -> None:
    assert (len(gait.walk(cycles=2)), len(gait.walk(seconds=2))) == (65, 60)
    walk = gait.walk(seconds=2, rate=Fraction(25))
    assert (walk.rate, len(walk)) == (25, 50)
    assert period(gait.walk(cycles=1, rate=120), 1) == 128


def test_in_place_stays() -> None:
    walk = gait.walk(cycles=3, in_place=True)
    forward = walk.body.values[:, NUMBERS["HumanoidRoot_tr_frontal"] - 1]
    assert np.abs(forward).max() < 60  # the body sways forward and back within the cycle
    assert forward[0] == forward[-1]


def test_smooth_is_smoother_than_linear() -> None:
    for name in CHARACTERS:
        jerks = {}
        for kind in ("linear", "smooth"):
            walk = gait.walk(character=name, cycles=2, interpolation=kind)
            jerks[kind] = np.abs(np.diff(degrees(walk, "r_knee_flexion"), 2)).max()
        assert jerks["smooth"] < 0.8 * jerks["linear"]


def test_other_bodies_walk() -> None:
    default = Skeleton.default()
    longer = default.centres.copy()
    child = Skeleton(default.names, default.parents, default.centres * 0.6)
    for names in (("knee", "ankle", "subtalar", "midtarsal", "metatarsal"),):
        for side in "lr":
            for joint in names:
                longer[default.number(f"{side}_{joint}"), 1] *= 0.9
    stocky = Skeleton(default.names, default.parents, longer)
    for body in (child, stocky):
        points = feet(gait.walk(character="bored", skeleton=body, cycles=2), body)
        assert points[..., 1].min() > -MILLIMETRES_2
        assert on_ground(points).any(axis=(0, 1)).all()
    stride = gait.advance(gait.walk(cycles=1, skeleton=child))
    assert stride == pytest.approx(1400 * 0.6, abs=1)


def test_editing_an_extremum_changes_that_and_keeps_the_feet() -> None:
    plain = gait.Character.named("normal")
    marching = plain.edited("passing", "swing", thigh=70, knee=95).edited("anticipation", "swing", thigh=60)
    walk = gait.walk(character=marching, cycles=1)
    assert -degrees(walk, "r_knee_flexion").min() == pytest.approx(95, abs=4)
    points = feet(walk)
    assert points[..., 1].min() > -MILLIMETRES_2
    assert on_ground(points).any(axis=(0, 1)).all()
    assert plain.poses["passing", "swing"].knee != 95


@pytest.mark.parametrize("stride", [0.0, -1.0, 0.01, float("nan"), float("inf"), 5.0, 1e300])
def test_impossible_strides(stride: float) -> None:
    with pytest.raises(ModelError, match="stride"):
        gait.walk(stride)


@pytest.mark.parametrize("character", CHARACTERS)
def test_the_longest_strides_are_refused(character: str) -> None:
    with pytest.raises(ModelError, match=rf"too long for '{character}' on legs of 0.86 m"):
        gait.walk(2.2, character)


def test_unknown_characters_are_named_with_what_there_is() -> None:
    with pytest.raises(ModelError, match="did you mean 'bored'"):
        gait.walk(character="bord")
    with pytest.raises(ModelError, match="normal, bored, proud, hurried, sneaking"):
        gait.walk(character="xyz")
    assert gait.characters() == CHARACTERS


@pytest.mark.parametrize(
    "wrong",
    [
        {"cycles": 0}, {"cycles": -1}, {"cycles": float("nan")}, {"cycles": 1e15}, {"seconds": float("inf")},
        {"seconds": 1, "cycles": 1}, {"rate": 0}, {"rate": -30}, {"rate": 1}, {"rate": 10**12},
        {"interpolation": "cubic"}, {"stride": "far"},
    ],
)  # fmt: skip
def test_senseless_arguments(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 - each has its own text
        gait.walk(**wrong)  # type: ignore[arg-type]


def test_characters_are_checked() -> None:
    normal = gait.Character.named("normal")
    with pytest.raises(ModelError, match="passing swing, knee"):
        normal.edited("passing", "swing", knee=float("nan"))
    with pytest.raises(ModelError, match="no pose"):
        normal.edited("jumping", "swing", knee=1)
    with pytest.raises(ModelError, match="no 'toe'"):
        normal.edited("passing", "swing", toe=1)


def test_skeletons_without_feet_do_not_walk() -> None:
    default = Skeleton.default()
    keep = [n for n in default.names if not n.startswith(("l_ankle", "l_sub", "l_mid_t", "l_midt", "l_meta"))]
    parents = {n: default.names[p] if (p := default.parents[default.number(n)]) >= 0 else None for n in keep}
    lame = Skeleton.from_parents(parents, {n: default.centres[default.number(n)] for n in keep})
    with pytest.raises(ModelError, match="l_ankle, l_subtalar, l_metatarsal"):
        gait.walk(skeleton=lame)
    flat = Skeleton(default.names, default.parents, np.zeros((len(default), 3)))
    with pytest.raises(ModelError, match="gait"):
        gait.walk(skeleton=flat)


def test_soles_measures_what_stands_still() -> None:
    still = Animation(30, np.arange(5), None, BodyTrack.empty(5))
    soles = gait.soles(still)
    assert soles.stance == (1.0, 1.0)
    assert soles.carried
    assert soles.slip == pytest.approx(0.0, abs=1e-9)
    sliding = np.zeros((5, 296), dtype=np.int32)
    sliding[:, NUMBERS["HumanoidRoot_tr_frontal"] - 1] = [0, 10, 20, 30, 40]
    sliding[:, NUMBERS["HumanoidRoot_tr_vertical"] - 1] = [0, 0, 0, 0, -7]
    slid = gait.soles(Animation(30, np.arange(5), None, BodyTrack(sliding, sliding != 0)))
    assert slid.slip == pytest.approx(0.040, abs=1e-6)
    assert slid.deepest == pytest.approx(0.007, abs=1e-6)
