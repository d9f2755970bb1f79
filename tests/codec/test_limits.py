"""What the syntax cannot carry: refused with parameter, frame and the way out, or clamped and counted."""

import re
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codec_streams import WIDEST, largest_level, steps
from fba import Animation, BodyTrack, EncoderOptions, FaceTrack, FbaWarning, RangeError, decode, encode
from fba.codec import encode_animation
from fba.parameters import baps, faps


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
