"""Does a decoded body move like a person, and would the other table of BAP steps fit it better."""

import json
import warnings
from dataclasses import replace
from fractions import Fraction
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, EncoderOptions
from fba.body import BapSolver, gait, plausibility
from fba.body.plausibility import Doubt, find_doubt
from fba.codec import encode_animation
from fba.parameters import bap_numbers, bap_steps

TABLES = ("iso", "visage")
OTHER = {"iso": "visage", "visage": "iso"}
VERTICAL, LATERAL = (bap_numbers()[f"HumanoidRoot_tr_{way}"] - 1 for way in ("vertical", "lateral"))


@cache
def hello() -> Animation:
    with as_file(files("fba") / "samples" / "hello.bvh") as path:
        return fba.read(path).resample(30)


def doubt_of(animation: Animation, made: str, read: str, quant: int = 1) -> Doubt | None:
    """What is thought of an animation that was encoded with one table and decoded with another."""
    data, _ = encode_animation(
        animation, EncoderOptions(bap_steps=made, bap_quant=quant, clamp=True, mark=False)
    )
    return doubt(fba.decode(data, bap_steps=read), read)


def doubt(decoded: Animation, table: str) -> Doubt | None:
    assert decoded.body is not None
    return find_doubt(decoded.body, decoded.index, decoded.rate, table)


def root_moves(vertical: object, lateral: object = 0, *, rate: int = 30) -> Animation:
    """A body of which only the root moves, in mm."""
    both = np.broadcast_arrays(np.asarray(vertical), np.asarray(lateral))
    values = np.zeros((len(both[0]), 296), dtype=np.int32)
    values[:, VERTICAL], values[:, LATERAL] = both
    mask = np.zeros(values.shape, dtype=bool)
    mask[:, [VERTICAL, LATERAL]] = True
    return Animation(rate, np.arange(len(values)), None, BodyTrack(values, mask))


@pytest.mark.parametrize("quant", [1, 8])
@pytest.mark.parametrize("made", TABLES)
@pytest.mark.parametrize("rate", [10, 30])
@pytest.mark.parametrize("character", gait.characters())
def test_walks(character: str, rate: int, made: str, quant: int) -> None:
    walk = gait.walk(character=character, rate=rate)
    assert doubt_of(walk, made, made, quant) is None
    found = doubt_of(walk, made, OTHER[made], quant)
    assert (found.used, found.likely) == (OTHER[made], made)


@pytest.mark.parametrize("made", TABLES)
def test_a_captured_gesture(made: str) -> None:
    assert doubt_of(hello(), made, made) is None
    found = doubt_of(hello(), made, OTHER[made])
    assert found is not None
    wrong = "the root goes" if made == "visage" else "joints beyond human limits in"
    assert wrong in str(found)
    assert f"with the BAP steps '{OTHER[made]}'" in str(found)
    assert str(found).endswith(f"; made with --bap-steps {made}?")


def test_somebody_who_sits_far_under_the_ground() -> None:
    seat = root_moves(np.full(60, -380))
    assert doubt_of(seat, "visage", "visage") is None
    found = doubt_of(seat, "visage", "iso")
    assert found.findings == ("the body 12 m under the ground",)


def test_walking_on_the_spot_is_no_walk_with_the_other_table() -> None:
    for character in gait.characters():
        walk = gait.walk(character=character, in_place=True)
        assert doubt_of(walk, "visage", "visage") is None
        assert doubt_of(walk, "iso", "iso") is None


def test_nothing_is_said_where_both_tables_look_wrong() -> None:
    times = np.arange(120) / 30
    wild = root_moves(
        64 * np.rint(500 * np.sin(9 * times)).astype(int), 64 * np.rint(300 * times).astype(int)
    )
    assert doubt(wild, "iso") is None
    steps = bap_steps("visage")
    levels = wild.body.values // bap_steps("iso")
    assert doubt(Animation(30, wild.index, None, BodyTrack(levels * steps, wild.body.mask)), "visage") is None


def test_nothing_is_said_where_the_table_has_no_say() -> None:
    small = root_moves(np.full(60, -1800))  # as it is, quantiser 0: the same with both tables
    for table in TABLES:
        assert doubt_of(small, table, OTHER[table], 0) is None
    away = gait.walk()  # values between the steps were not decoded with this table
    assert doubt(away, "iso") is None
    turned = np.zeros((60, 296), dtype=np.int32)
    turned[:, bap_numbers()["l_wrist_twisting"] - 1] = 256 * 300  # the same step in both tables
    assert doubt(Animation(30, np.arange(60), None, BodyTrack(turned, turned != 0)), "visage") is None


def test_a_moment_is_too_short_to_judge() -> None:
    assert doubt_of(root_moves(np.full(30, -380)), "visage", "iso") is None
    assert doubt_of(root_moves(np.full(31, -380)), "visage", "iso") is not None
    assert doubt_of(root_moves(np.full(1, -380)), "visage", "iso") is None


def test_frames_without_a_body_do_not_count_as_jumps() -> None:
    animation = root_moves(np.full(60, 64))
    values, mask = animation.body.values.copy(), animation.body.mask.copy()
    values[20:40], mask[20:40] = 0, False
    assert doubt(Animation(30, animation.index, None, BodyTrack(values, mask)), "iso") is None


CALM = plausibility.Motion(
    beyond=0.0, travel=0.0, along=0.0, carried=0.0, jump=0.0, hops=False, slid=0.0, away=0.0, height=0.0
)


def is_doubted(other: plausibility.Motion = CALM, /, **now: float) -> bool:
    """Whether a motion with these measurements is doubted where the other table reads it as `other`."""
    return bool(plausibility._new_faults(replace(CALM, **now), other))


def test_joints_must_be_beyond_limits_in_three_tenths_of_the_frames_more() -> None:
    assert is_doubted(beyond=0.31)
    assert not is_doubted(beyond=0.29)
    assert not is_doubted(replace(CALM, beyond=0.15), beyond=0.44)
    assert not is_doubted(replace(CALM, beyond=0.35), height=-3.0)  # the other reading is no better


def test_a_joint_counts_twenty_degrees_beyond_its_limits() -> None:
    """An elbow flexes by 142 degrees at most."""
    values = np.zeros((40, 296), dtype=np.int64)
    for degrees, beyond in ((161.0, 0.0), (163.0, 1.0)):
        values[:, bap_numbers()["l_elbow_flexion"] - 1] = round(np.radians(degrees) * 1e5)
        assert plausibility.measure(values, np.arange(40), Fraction(25)).beyond == beyond


@pytest.mark.parametrize(
    ("carried", "fastest"),
    [
        (0.0, 0.16),  # a body sways by 8 cm a second; twice that is allowed
        (1.0, 2.16),  # twice as fast as legs and sway
        (10.0, 8.0),  # nobody is faster
    ],
)
def test_a_root_goes_no_faster_than_the_legs_carry_it(carried: float, fastest: float) -> None:
    assert is_doubted(travel=1.02 * fastest, carried=carried, hops=True)
    assert not is_doubted(travel=0.98 * fastest, carried=carried, hops=True)
    assert is_doubted(travel=1.02 * fastest, carried=carried) == (fastest == 8.0)  # slower: only in jumps


def test_legs_that_walk_carry_the_root() -> None:
    walks = replace(CALM, carried=0.21, along=0.21)
    assert is_doubted(walks, carried=0.21, along=0.14 * 0.21)
    assert not is_doubted(walks, carried=0.21, along=0.16 * 0.21)
    assert not is_doubted(walks, carried=0.19, along=0.0)
    assert not is_doubted(replace(walks, carried=0.19), carried=0.21)
    assert not is_doubted(replace(walks, along=0.1), carried=0.21)  # the other reading stands still, too


def test_bodies_do_not_slide_on_legs_that_rest() -> None:
    """Six centimetres, where the other reading has them sway as people who stand do: by 8 cm a second."""
    assert is_doubted(slid=0.065)
    assert not is_doubted(slid=0.055)
    assert is_doubted(replace(CALM, travel=0.075), slid=0.5)
    assert not is_doubted(replace(CALM, travel=0.085), slid=0.5)
    assert not is_doubted(replace(CALM, slid=0.065), slid=0.5)


def test_a_jump_is_no_travel_of_the_root() -> None:
    """Up to a metre: an athlete's leap, or someone who lies down."""
    times = np.arange(60) / 30
    for height, travels in ((950, False), (1050, True)):
        hop = root_moves(np.rint(height * (1 - (2 * (times % 1) - 1) ** 2)).astype(int))
        found = plausibility.measure(hop.body.values.astype(np.int64), hop.index, hop.rate)
        assert (found.travel > 0.5) == travels


def test_a_body_two_metres_down_is_underground() -> None:
    assert is_doubted(height=-2.1)
    assert not is_doubted(height=-1.9)
    assert not is_doubted(replace(CALM, height=-2.1), height=-60.0)


def test_an_unknown_table_is_refused() -> None:
    with pytest.raises(ValueError, match="bap_steps must be one of iso, visage"):
        doubt(root_moves(np.zeros(60, int)), "other")


def test_of_a_long_motion_a_part_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    walk = fba.decode(fba.encode(gait.walk(cycles=8), EncoderOptions(bap_steps="visage", mark=False)))
    count = 20_000
    rows = np.arange(count) % len(walk)
    body = BodyTrack(walk.body.values[rows], walk.body.mask[rows])
    seen = []
    measure = plausibility.measure

    def counting(values: np.ndarray, index: np.ndarray, rate: Fraction) -> plausibility.Motion:
        seen.append(len(values))
        return measure(values, index, rate)

    monkeypatch.setattr(plausibility, "measure", counting)
    found = find_doubt(body, np.arange(count), Fraction(30), "iso")
    assert found.likely == "visage"
    assert seen == [2048, 2048]


def test_the_feet_are_where_the_solver_has_them() -> None:
    values = np.random.default_rng(5).integers(-150_000, 150_000, (40, 296))
    solver = BapSolver()
    posed = solver.pose(values)[..., :3, 3]
    names = ("l_ankle", "r_ankle", "l_metatarsal", "r_metatarsal")
    numbers = [solver.skeleton.number(name) for name in names]
    wanted = posed[:, numbers] - posed[:, :1]
    np.testing.assert_allclose(plausibility._feet(values), wanted, atol=1e-9)


def test_the_projects_own_vectors() -> None:
    folder = Path(__file__).parents[2] / "conformance" / "fba_conformance" / "vectors"
    for record in json.loads((folder / "index.json").read_text(encoding="utf-8")):
        if "error" in record:
            continue
        with warnings.catch_warnings(action="ignore", category=fba.FbaWarning):
            decoded = fba.decode((folder / record["stream"]).read_bytes(), bap_steps=record["bap_steps"])
        assert decoded.body is None or doubt(decoded, record["bap_steps"]) is None, record["stream"]


def test_foreign_vectors(shared: Path) -> None:
    """None that is read rightly is doubted; of the real ones that are read wrongly, all but one are.

    That one moves no root, and its joints come out at least three eighths as far: calmer, not broken.
    """
    folder, missed, real = shared / "vectors", [], 0
    for record in json.loads((folder / "index.json").read_text(encoding="utf-8")):
        if "decoded_bap" not in record:
            continue
        data, right = (folder / record["stream"]).read_bytes(), record["bap_steps"]
        assert doubt(fba.decode(data, bap_steps=right), right) is None, record["stream"]
        if record["stream"].startswith("real/"):
            real += 1
            if doubt(fba.decode(data, bap_steps=OTHER[right]), OTHER[right]) is None:
                missed.append(record["stream"])
    assert (real, missed) == (24, ["real/perfumist_basicMotion.fba"])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*the header says 908 frames")
def test_captures(shared: Path) -> None:
    for path in sorted((shared / "data").glob("*/*.bvh")):
        animation = fba.read(path)
        for made in TABLES:
            assert doubt_of(animation, made, made) is None, path.name
            assert doubt_of(animation, made, OTHER[made]) is not None, path.name
