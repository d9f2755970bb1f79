"""`fba.encode` and `encode_stream`: each choice makes the stream of its function; mistakes are told."""

import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, EncoderOptions, FaceTrack
from fba.codec import encode_animation
from fba.face import FaceModel
from fba.planning import (
    BitRate,
    NearLossless,
    Tolerance,
    encode_planned,
    encode_stream,
    encode_within_tolerance,
)
from fba.planning.rate import ShownErrors, encode_at_rate

VISAGE = EncoderOptions(bap_steps="visage")


def wave(columns: int, moving: list[int], size: float, count: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Return values (T, columns) in which these parameters move, each at its speed, and their mask."""
    values = np.zeros((count, columns), dtype=np.int32)
    for place, number in enumerate(moving):
        values[:, number - 1] = np.rint(size * np.sin(np.arange(count) / (4 + place)))
    return values, np.broadcast_to(values.any(axis=0), values.shape)


FACE = Animation(Fraction(25), np.arange(40), FaceTrack(*wave(68, [3, 4, 6, 7, 19, 20], 200)))
BODY = Animation(Fraction(25), np.arange(40), None, BodyTrack(*wave(296, [28, 38], 40_000)))
BOTH = replace(FACE, body=BODY.body)
HEAD = FaceModel.default()


@pytest.mark.parametrize(
    ("animation", "options", "keywords", "expected"),
    [
        (FACE, None, {}, lambda: encode_animation(FACE)[0]),
        (FACE, None, {"fap_quant": 4}, lambda: encode_animation(FACE, EncoderOptions(fap_quant=4))[0]),
        (BOTH, VISAGE, {}, lambda: encode_animation(BOTH, VISAGE)[0]),
        (BOTH, VISAGE, {"preset": "reference"}, lambda: encode_animation(BOTH, VISAGE)[0]),
        (BOTH, VISAGE, {"preset": "exact"}, lambda: encode_planned(BOTH, VISAGE)[0]),
        (FACE, None, {"preset": "compact"}, lambda: encode_planned(FACE, preset="compact")[0]),
        (FACE, EncoderOptions(preset="compact"), {}, lambda: encode_planned(FACE, preset="compact")[0]),
        (FACE, None, {"tolerance": 0.001}, lambda: encode_within_tolerance(FACE, Tolerance(face=0.001))[0]),
        (FACE, None, {"tolerance": Tolerance()}, lambda: encode_within_tolerance(FACE)[0]),
        (
            BODY, VISAGE, {"tolerance": 0.02},
            lambda: encode_within_tolerance(BODY, Tolerance(joint=0.02, foot=0.01), VISAGE)[0],
        ),
        (FACE, None, {"bit_rate": 1500}, lambda: encode_at_rate(FACE, 1500).data),
        (
            FACE, None, {"bit_rate": 1500, "mark": False},
            lambda: encode_at_rate(FACE, 1500, options=EncoderOptions(mark=False)).data,
        ),
    ],
)  # fmt: skip
def test_every_choice_makes_the_stream_of_its_function(
    animation: Animation,
    options: EncoderOptions | None,
    keywords: dict[str, Any],
    expected: Any,
    tmp_path: Path,
) -> None:
    data = fba.encode(animation, options, **keywords)
    assert data == expected()
    fba.write(tmp_path / "same.fba", animation, options=options, **keywords)
    assert (tmp_path / "same.fba").read_bytes() == data


@pytest.mark.parametrize(
    ("arguments", "keywords", "text"),
    [
        (("hello.fap",), {}, "not the name of a file; read the file first: fba.encode(fba.read('hello."),
        ((Path("hello.fap"),), {}, "read the file first"),
        ((b"\0\0\1",), {}, "an animation is encoded, not bytes; fba.read makes one of a file"),
        ((FACE.face,), {}, "make an animation of it: fba.Animation(25, range(len(face)), face=face)"),
        ((BODY.body,), {}, "fba.Animation(25, range(len(body)), body=body)"),
        ((FACE[0],), {}, "not Frame"),
        ((FACE, VISAGE), {"fap_quant": 4, "mark": False}, "options or fap_quant, mark, not both; to change"),
        ((FACE,), {"fap_qant": 4}, "no option 'fap_qant' of encoding (did you mean 'fap_quant'?); it"),
        ((FACE,), {"tolerence": 1}, "did you mean 'tolerance'?"),
        ((FACE,), {"preset": "small"}, "preset must be one of reference, exact, compact, not 'small'"),
        ((FACE,), {"preset": "exact", "tolerance": 0.001}, "preset and tolerance contradict each other"),
        ((FACE,), {"bit_rate": 1500, "tolerance": 0.001}, "tolerance and bit_rate contradict each other"),
        ((FACE, EncoderOptions(preset="exact")), {"preset": "compact"}, "'exact' in the options and 'comp"),
        ((FACE, EncoderOptions(preset="exact")), {"bit_rate": 1500}, "each decides what is sent; give one"),
        ((FACE,), {"tolerance": "0.5mm"}, "tolerance is a number of metres (0.0005 is half a millimetre)"),
        ((FACE,), {"bit_rate": "2kbit/s"}, "bit_rate is a number of bits a second; not '2kbit/s'"),
        ((FACE,), {"tolerance": 0.001, "fap_quant": 4}, "leave fap_quant as by default: a tolerance decides"),
        ((FACE,), {"bit_rate": 1500, "bap_quant": 2, "intra_period": 2}, "leave bap_quant and intra_period"),
    ],
)  # fmt: skip
def test_errors_say_what_can_be_encoded(
    arguments: tuple[Any, ...], keywords: dict[str, Any], text: str
) -> None:
    with pytest.raises(fba.OptionError, match=re.escape(text)):
        fba.encode(*arguments, **keywords)


@pytest.mark.parametrize(
    ("goal", "keywords", "text"),
    [
        ("small", {}, "goal must be one of reference, exact, compact, fit, a Tolerance or a BitRate"),
        ("fit", {}, "needs the head that all receivers have: give model="),
        ("exact", {"model": HEAD}, "model has no effect on the goal 'exact'"),
        (BitRate(1500), {"model": HEAD}, "model has no effect on the goal BitRate"),
        (Tolerance(), {"keep_masks": ["face"]}, "keep_masks has no effect on the goal Tolerance"),
        ("compact", {"every_frame": True}, "every_frame has no effect on the goal 'compact'"),
    ],
)
def test_what_has_no_effect_on_a_goal_is_an_error(goal: Any, keywords: dict[str, Any], text: str) -> None:
    with pytest.raises(fba.OptionError, match=re.escape(text)):
        encode_stream(FACE, None, goal, **keywords)


def test_a_tolerance_comes_with_its_errors_and_the_frames_left_out() -> None:
    encoded = encode_stream(FACE, None, Tolerance(face=0.001))
    assert isinstance(encoded.errors, NearLossless)
    assert 0 < encoded.errors.face.largest <= 0.001
    assert encoded.left_out == len(FACE) - len(fba.decode(encoded.data)) > 0
    every = encode_stream(FACE, None, Tolerance(face=0.001), every_frame=True)
    assert every.left_out == 0
    assert len(fba.decode(every.data)) == len(FACE)


def test_a_bit_rate_comes_with_its_errors_and_quantisers() -> None:
    encoded = encode_stream(BOTH, VISAGE, BitRate(4000, buffer=2))
    assert isinstance(encoded.errors, ShownErrors)
    assert encoded.errors.face is not None
    assert encoded.errors.body.largest > 0
    (quantisers,) = {
        (one.settings.face.quant, one.settings.body.quant)
        for one in (frame.plane for frame in fba.Decoder().push(encoded.data))
        if one.settings.intra
    }
    assert quantisers == (encoded.options.fap_quant, encoded.options.bap_quant)
    assert encoded.left_out == len(BOTH) - encoded.statistics.planes


def test_values_that_do_not_fit_are_an_error_or_a_warning() -> None:
    values, mask = np.zeros((40, 68), dtype=np.int32), np.zeros((40, 68), dtype=np.bool_)
    values[::2, 2], mask[:, 2] = 5000, True
    animation = Animation(Fraction(25), np.arange(40), FaceTrack(values, mask))
    with pytest.raises(fba.RangeError, match="FAP 3 open_jaw"):
        fba.encode(animation, fap_quant=0)
    with pytest.warns(fba.FbaWarning, match="values limited to what their ranges carry"):
        fba.encode(animation, fap_quant=0, clamp=True)
