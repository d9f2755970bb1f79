"""What the syntax cannot carry, and angles past half a turn: refused, clamped, or coded otherwise."""

import re
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fba
from codec_streams import WIDEST, largest_level, steps
from fba import Animation, BodyTrack, EncoderOptions, FaceTrack, FbaWarning, RangeError, decode, encode
from fba.codec import EncoderStatistics, encode_animation
from fba.codec._ranges import _extremes
from fba.parameters import bap_numbers, bap_steps, baps, faps


def one_value(part: str, number: int, values: list[int]) -> Animation:
    columns = 68 if part == "face" else 296
    array = np.zeros((len(values), columns), dtype=np.int32)
    mask = np.zeros((len(values), columns), dtype=bool)
    array[:, number - 1] = values
    mask[:, number - 1] = True
    index = np.arange(len(values))
    if part == "face":
        return Animation(Fraction(25), index, FaceTrack(array, mask))
    return Animation(Fraction(25), index, None, BodyTrack(array, mask))


def options(part: str, quant: int, **more: object) -> EncoderOptions:
    return EncoderOptions(**{"fap_quant" if part == "face" else "bap_quant": quant}, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("table", ["iso", "visage"])
@pytest.mark.parametrize(("part", "numbers"), [("face", (3, 48, 68)), ("body", (1, 123, 181, 296))])
@pytest.mark.parametrize("quant", [0, 1, 2, 7, 30, 31])
def test_the_largest_value(table: str, part: str, numbers: tuple[int, ...], quant: int) -> None:
    """The end of the widest range, and what still rounds to it; the next value up is refused."""
    for number in numbers:
        step = int(steps(part, quant, table)[number - 1])
        whole = largest_level(part, quant) * step
        largest = whole + (step - 1) // 2  # half a step more rounds up, beyond the range
        for sign in (1, -1):
            chosen = options(part, quant, bap_steps=table)
            got = decode(encode(one_value(part, number, [0, sign * largest]), chosen), bap_steps=table)
            track = got.face if part == "face" else got.body
            assert int(track.values[1, number - 1]) == sign * whole
            with pytest.raises(RangeError, match=rf"the largest is {largest};") as caught:
                encode(one_value(part, number, [0, 0, sign * (largest + 1)]), chosen)
            label = (faps() if part == "face" else baps())[number - 1].label
            assert caught.value.parameter == label
            assert caught.value.frame == 2
            assert caught.value.value == sign * (largest + 1)
            assert caught.value.limits == (-largest, largest)


@given(
    st.sampled_from([("face", 3), ("face", 5), ("face", 48), ("body", 1), ("body", 124), ("body", 182)]),
    st.integers(0, 31),
    st.integers(1, 700_000),
    st.sampled_from(["iso", "visage"]),
)
@settings(max_examples=120)
def test_the_recommended_quantiser_suffices(
    parameter: tuple[str, int], quant: int, value: int, table: str
) -> None:
    """... and every smaller one would not; where none is named, none would."""
    part, number = parameter
    animation = one_value(part, number, [0, value])

    def carried(quant: int, table: str = table) -> bool:
        try:
            encode(animation, options(part, quant, bap_steps=table))
        except RangeError:
            return False
        return True

    if carried(quant):
        return
    with pytest.raises(RangeError) as caught:
        encode(animation, options(part, quant, bap_steps=table))
    said = str(caught.value)
    name = "fap_quant" if part == "face" else "bap_quant"
    found = re.search(rf"smallest quantiser that would do is {name} (\d+)", said)
    smallest = int(found[1]) if found else 32
    assert found or f"no {name} would do" in said
    assert not any(carried(smaller) for smaller in range(smallest))
    assert not found or carried(smallest)
    other = re.search(rf"bap_steps (\w+) with {name} (\d+) would", said)
    assert not other or carried(int(other[2]), other[1])


def test_clamped_values_are_counted_and_the_nearest_possible() -> None:
    """FAP 48 at fap_quant 1: 1860 steps of 170 in an I plane; the P planes after it catch up."""
    largest = WIDEST * 170
    animation = one_value("face", 48, [400_000, 400_000, 400_000, 0, -400_000, -400_000])
    with pytest.raises(RangeError, match="400000 cannot be carried"):
        encode(animation)
    coded, statistics = encode_animation(animation, EncoderOptions(clamp=True))
    values = decode(coded).face.values[:, 47].tolist()
    nearest = [400_010, -400_010]  # multiples of 170 next to +-400000 ...
    assert nearest[0] == 2353 * 170
    assert values[0] == largest
    assert abs(values[2] - 400_000) <= 85
    assert values[3] == 0
    assert statistics.clamped >= 1
    assert statistics.planes == 6
    inside = one_value("face", 48, [largest, -largest, 0])
    _, statistics = encode_animation(inside, EncoderOptions(clamp=True))
    assert statistics.clamped == 0


def test_clamping_leaves_other_parameters_alone() -> None:
    values = np.zeros((4, 68), dtype=np.int32)
    mask = np.zeros((4, 68), dtype=bool)
    mask[:, [2, 47]] = True
    values[:, 2] = [4, 8, -12, 400]
    values[:, 47] = [1_000_000, 170, -1_000_000, 340]
    coded, statistics = encode_animation(
        Animation(Fraction(25), np.arange(4), FaceTrack(values, mask)), EncoderOptions(clamp=True)
    )
    got = decode(coded).face
    assert got.values[:, 2].tolist() == [4, 8, -12, 400]
    assert got.values[[1, 3], 47].tolist() == [170, 340]
    assert statistics.clamped >= 2


@pytest.mark.parametrize(("field", "column"), [("viseme", 2), ("expression", 1), ("expression", 3)])
@pytest.mark.parametrize("value", [-1, 76, 1000])
def test_amounts_out_of_range(field: str, column: int, value: int) -> None:
    """63 is the largest blend and intensity; up to 75 a decoder makes of it by rounding at fap_quant 25."""
    fields = {"viseme": np.zeros((3, 4), dtype=np.int16), "expression": np.zeros((3, 6), dtype=np.int16)}
    mask = np.zeros((3, 68), dtype=bool)
    mask[:, :2] = True

    def animation() -> Animation:
        copies = {name: array.copy() for name, array in fields.items()}
        return Animation(
            Fraction(25), np.arange(3), FaceTrack(np.zeros((3, 68), dtype=np.int32), mask, **copies)
        )

    for rounded in (63, 75):
        fields[field][1, column] = rounded
        track = decode(encode(animation())).face
        assert track is not None
        assert getattr(track, field)[1, column] == 63
    fields[field][1, column] = value
    with pytest.raises(
        RangeError, match=rf"value {value} cannot be carried: it lies outside 0..63"
    ) as caught:
        encode(animation())
    assert (caught.value.frame, caught.value.limits) == (1, (0, 63))
    coded, statistics = encode_animation(animation(), EncoderOptions(clamp=True))
    track = decode(coded).face
    assert track is not None
    assert statistics.clamped == 1
    assert getattr(track, field)[1, column] == (0 if value < 0 else 63)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"fap_quant": 32}, r"fap_quant must be an integer in 0\.\.31, not 32"),
        ({"bap_quant": -1}, r"bap_quant must be an integer in 0\.\.31, not -1"),
        ({"fap_quant": 1.5}, r"fap_quant must be an integer"),
        ({"intra_period": 0}, "intra_period must be a positive number of seconds, not 0"),
        ({"intra_period": float("nan")}, "intra_period must be a positive"),
        ({"intra_period": float("inf")}, "intra_period must be a positive"),
        ({"bap_steps": "ISO"}, "bap_steps must be one of iso, visage, not 'ISO'"),
        ({"preset": "best"}, "preset must be one of"),
        ({"unsent": "drop"}, "unsent must be one of keep, interpolate, not 'drop'"),
        ({"gender": 2}, "gender must be one of 0, 1, not 2"),
    ],
)
def test_wrong_options(wrong: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        EncoderOptions(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("sign", [1, -1])
def test_a_value_at_the_end_of_int32_is_rounded_inwards(sign: int) -> None:
    """The nearest multiple of the step lies outside, and no decoder takes it."""
    ramp = np.clip(sign * 900_000 * np.arange(2400, dtype=np.int64), -(2**31), 2**31 - 1)
    wide = next(bap.number for bap in baps() if bap.step_iso == 512)
    decoded = decode(encode(one_value("body", wide, ramp.tolist())))
    error = np.abs(decoded.body.values[:, wide - 1] - ramp)
    assert error[:2386].max() <= 256
    assert error.max() < 512


def test_a_warning_names_clamped_parameters() -> None:
    with pytest.warns(FbaWarning, match=r"FAP 3 open_jaw \(3; frame 0: 90000 sent as 7440\)"):
        encode(one_value("face", 3, [90_000] * 3), EncoderOptions(clamp=True))


TURN, FORWARD, SIDEWAYS = (
    bap_numbers()[f"HumanoidRoot_{name}"] for name in ("rt_body_turn", "tr_frontal", "tr_lateral")
)
ELBOW, TWIST = (bap_numbers()[f"l_elbow_{name}"] for name in ("flexion", "twisting"))
SCALES = {0: 1, 1: 1, 5: 7, 31: 127}
"""bap_pred_scale of ISO/IEC 14496-2, for some bap_quant."""


def motion(columns: dict[int, list[int] | np.ndarray]) -> Animation:
    """An animation that sends these BAPs."""
    count = len(next(iter(columns.values())))
    values, mask = np.zeros((count, 296), dtype=np.int32), np.zeros((count, 296), dtype=bool)
    for number, column in columns.items():
        values[:, number - 1] = column
        mask[:, number - 1] = True
    return Animation(Fraction(30), np.arange(count), body=BodyTrack(values, mask))


def coded(animation: Animation, **options: object) -> tuple[np.ndarray, EncoderStatistics]:
    """The BAPs that a decoder returns, as int64, and what the encoder counted."""
    chosen = EncoderOptions(**options)  # type: ignore[arg-type]
    data, statistics = encode_animation(animation, chosen)
    return fba.decode(data, bap_steps=chosen.bap_steps).body.values.astype(np.int64), statistics


def angle_between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Angles in 1e-5 rad between directions, which full turns do not change."""
    return np.abs(np.angle(np.exp(1e-5j * (one - other)))) * 1e5


@pytest.mark.parametrize("far", [4539, 0])
@pytest.mark.parametrize("clamp", [True, False])
def test_a_turn_past_half_a_turn_keeps_its_direction(clamp: bool, far: int) -> None:
    """Frames 57 to 61 of a capture that came out turned round: no I plane carries a root 4.5 m away."""
    turn = [312233, 313766, -313255, -312200, -311524]
    walk = [0, 0, 3000, *[far] * 5]
    animation = motion({TURN: [0, 150_000, 300_000, *turn], FORWARD: walk})
    if far and not clamp:
        with pytest.raises(fba.RangeError, match="HumanoidRoot_tr_frontal"):
            coded(animation, bap_steps="visage")
        return
    got, statistics = coded(animation, bap_steps="visage", clamp=clamp)
    assert angle_between(got[3:, TURN - 1], np.array(turn)).max() <= 85 + 1  # half a step, and a rounded turn
    assert np.abs(got[:, FORWARD - 1] - walk).max() <= 1
    assert statistics.clamped == 0
    assert statistics.intra_planes == (1 if clamp else 2)


def test_a_first_angle_beyond_half_a_turn_is_moved_within() -> None:
    """No I plane carries 7 rad; 7 - 2 pi is the same direction."""
    got, statistics = coded(motion({TURN: [700_000, 710_000]}), bap_steps="visage", clamp=True)
    assert angle_between(got[:, TURN - 1], np.array([700_000, 710_000])).max() <= 86
    assert abs(got[0, TURN - 1]) < 314_159
    assert statistics.clamped == 0


def test_i_planes_that_are_due_are_written_where_a_person_turns_round_and_round() -> None:
    turn = np.arange(0, 3_000_000, 10_000)
    got, statistics = coded(motion({TURN: turn}), bap_steps="visage", clamp=True, intra_period=1)
    assert angle_between(got[:, TURN - 1], turn).max() <= 90  # half a step, and half a unit for each turn
    assert (statistics.intra_planes, statistics.clamped) == (10, 0)


def test_the_plane_with_the_smaller_error_is_chosen() -> None:
    """A root that is 4 mm, or 2 m, beyond what I planes carry, and that jumps sideways by 5 m."""
    near = motion({FORWARD: [3000, 3724, 3724], SIDEWAYS: [-2000, 3000, 3000]})
    got, statistics = coded(near, bap_steps="visage", clamp=True)
    assert got[:, FORWARD - 1].tolist() == [3000, 3720, 3724]
    assert got[:, SIDEWAYS - 1].tolist() == [-2000, 3000, 3000]
    assert list(statistics.clamped_parameters) == [f"BAP {FORWARD} HumanoidRoot_tr_frontal"]
    far = motion({FORWARD: [3000, 6000, 6000], SIDEWAYS: [-2000, 3000, 3000]})
    got, statistics = coded(far, bap_steps="visage", clamp=True)
    assert got[:, FORWARD - 1].tolist() == [3000, 6000, 6000]
    assert got[:, SIDEWAYS - 1].tolist() == [-2000, -2000 + 3720, 3000]
    (named,) = statistics.clamped_parameters.values()
    assert (named.count, named.first, named.frame, named.value, named.sent) == (1, 1, 1, 3000, 1720)
    assert named.off == 1280


def test_a_value_out_of_reach_is_reported_with_its_worst_frame() -> None:
    got, statistics = coded(motion({FORWARD: [5000, 6000, 6000, 6000]}), bap_steps="visage", clamp=True)
    assert got[:, FORWARD - 1].tolist() == [3720, 6000, 6000, 6000]
    named = statistics.clamped_parameters[f"BAP {FORWARD} HumanoidRoot_tr_frontal"]
    assert (named.count, named.first, named.frame, named.value, named.sent) == (1, 0, 0, 5000, 3720)


@pytest.mark.parametrize("table", ["iso", "visage"])
@pytest.mark.parametrize("quant", SCALES)
@pytest.mark.parametrize("period", [None, 0.5])
def test_every_value_is_sent_or_reported(table: str, quant: int, period: float | None) -> None:
    """Angles that wander through many turns, written within +-pi, and a root that wanders off."""
    random = np.random.default_rng(3)
    angles = np.cumsum(random.normal(0, 20_000, (150, 3)), axis=0) + random.normal(0, 200_000, (1, 3))
    angles = (np.angle(np.exp(1e-5j * angles)) * 1e5).astype(np.int32)
    root = np.cumsum(random.normal(20, 20, 150)).astype(np.int32)
    columns = {TURN: angles[:, 0], ELBOW: angles[:, 1], TWIST: angles[:, 2], FORWARD: root}
    got, statistics = coded(
        motion(columns), bap_steps=table, bap_quant=quant, clamp=True, intra_period=period
    )
    for number, column in columns.items():
        step = bap_steps(table)[number - 1] * SCALES[quant] if quant else 1
        sent = got[:, number - 1]
        off = np.abs(sent - column) if number == FORWARD else angle_between(sent, column)
        missed = np.flatnonzero(off > step / 2 + 10)  # a full turn is rounded by half a unit
        name = next((one for one in statistics.clamped_parameters if one.startswith(f"BAP {number} ")), None)
        assert len(missed) == (statistics.clamped_parameters[name].count if name else 0)
        if name:
            named = statistics.clamped_parameters[name]
            assert named.first == missed[0]
            assert named.frame == int(off.argmax())
    if quant in (1, 5) and table == "visage":
        assert statistics.clamped == 0


def test_without_clamp_values_do_not_change() -> None:
    """Only the pose must be kept with clamp; without, a decoder returns the very numbers."""
    turn = [0, 170_000, 312_800, -312_800, -170_000]
    got, statistics = coded(motion({TURN: turn}), bap_steps="visage")
    assert got[:, TURN - 1].tolist() == turn
    assert statistics.intra_planes == 2


def test_ranges_of_angles_fit_the_shorter_turns() -> None:
    """From 310,000 to -308,318 it is 10,000, as before: 618,318 would cost bits in every frame."""
    values = np.array([[300_000], [310_000], [-308_318]], dtype=np.int32)
    extremes = np.zeros((4, 1), dtype=np.int64)
    one, last, sent = np.ones(1, dtype=np.int64), np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.bool_)
    _extremes(values, np.ones((3, 1), dtype=np.bool_), one, one * 628_318, extremes, last, sent)
    assert extremes[2:, 0].tolist() == [10_000, 0]


@pytest.mark.parametrize("before", [[], [300_000]])
def test_angles_are_not_turned_unless_asked(before: list[int]) -> None:
    with pytest.raises(fba.RangeError, match="rt_body_turn: the value 4000000"):
        coded(motion({TURN: [*before, 4_000_000]}), bap_steps="visage", intra_period=1)
