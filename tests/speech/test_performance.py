"""Speech in streams: lips close, sounds keep their places, both codings keep their bit rates, faces live."""

from fractions import Fraction

import numpy as np
import pytest

import fba
from fba.arrays import Float32
from fba.errors import OptionError
from fba.face import Deformer, FaceModel, resolve
from fba.face.feature_points import names
from fba.parameters import fap_numbers
from fba.planning import encode
from fba.speech import Coding, Phone, Speech, encoder_options, find_shapes, perform, read_shapes
from fba_conformance.trace import decode_values

INNER_LIPS = [
    fap_numbers()[name] - 1
    for name in ("lower_t_midlip", "raise_b_midlip", "lower_t_lip_lm", "raise_b_lip_lm", "open_jaw")
]
PHONES = [
    "SIL", "B", "AA", "B", "P", "UH", "T", "F", "AY", "V", "TH", "IH", "N", "M", "AE", "P", "S", "B", "AY",
    "DH", "AH", "M", "UW", "N", "SIL",
]  # fmt: skip
CODINGS: tuple[Coding, ...] = ("visemes", "faps")


def speech(repeated: int = 1, length: float = 0.09) -> Speech:
    """The phones one after another, of lengths that differ."""
    rng = np.random.default_rng(3)
    phones, at = [], 0.0
    for name in PHONES * repeated:
        end = at + (0.3 if name == "SIL" else length * float(rng.uniform(0.6, 1.6)))
        phones.append(Phone(name, at, end))
        at = end
    return Speech(tuple(phones), (), at)


def shown(animation: fba.Animation, times: list[float]) -> Float32:
    """The FAPs that a player shows at times, linear between frames."""
    assert animation.face is not None
    faps = resolve(animation.face)
    frames = animation.index / float(animation.rate)
    columns = [np.interp(times, frames, column) for column in faps.T]
    return np.stack(columns, axis=1).astype(np.float32)


@pytest.mark.parametrize("coding", CODINGS)
@pytest.mark.parametrize("style", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("rate", ["25", "30000/1001", "60"])
def test_lips_are_shut_in_every_bilabial_closure(coding: Coding, style: float, rate: str) -> None:
    said = speech(3)
    made = perform(said, coding=coding, style=style, rate=Fraction(rate))
    decoded = fba.decode(encode(made, encoder_options(coding)))
    for shape in find_shapes(said.phones):
        if shape.viseme != 1:
            continue
        around = np.linspace(shape.centre - 0.04, shape.centre + 0.04, 33).tolist()
        faps = shown(decoded, around)[:, INNER_LIPS]
        gap = -faps[:, 0] - faps[:, 1]  # inner lips apart, in MNS / 1024
        assert gap.min() <= 40, f"the lips stay {gap.min():.0f} apart at {shape.centre:.2f} s"


@pytest.mark.parametrize("coding", CODINGS)
def test_lips_open_between_closures(coding: Coding) -> None:
    said = speech()
    decoded = fba.decode(encode(perform(said, coding=coding), encoder_options(coding)))
    for phone in said.phones:
        if phone.name in ("AA", "AE", "AY"):
            around = np.linspace(phone.start, phone.end, 20).tolist()
            assert shown(decoded, around)[:, INNER_LIPS[4]].max() > 100


@pytest.mark.parametrize("coding", CODINGS)
@pytest.mark.parametrize("start", [0.2, 0.21, 0.232, 0.235])
def test_a_short_vowel_between_two_closures_opens_the_mouth(coding: Coding, start: float) -> None:
    """As in "maps", quickly said."""
    ends = start + np.cumsum([0.06, 0.08, 0.10])
    phones = [Phone("M", start, ends[0]), Phone("AE", ends[0], ends[1]), Phone("P", ends[1], ends[2])]
    made = perform(Speech((Phone("SIL", 0, start), *phones), (), 0.8), coding=coding, life=0)
    jaw = shown(made, np.linspace(ends[0], ends[1], 9).tolist())[:, INNER_LIPS[4]]
    assert jaw.max() > 60


def test_rounded_vowels_push_the_lips_and_spread_ones_do_not() -> None:
    phones = (Phone("SIL", 0, 0.2), Phone("IY", 0.2, 0.4), Phone("T", 0.4, 0.5), Phone("UW", 0.5, 0.7))
    for coding in CODINGS:
        faps = shown(perform(Speech(phones, (), 0.8), coding=coding, life=0), [0.3, 0.6])
        push = faps[:, fap_numbers()["push_b_lip"] - 1]
        stretch = faps[:, fap_numbers()["stretch_l_cornerlip"] - 1]
        assert push[1] > push[0] + 100
        assert stretch[0] > 50 > -50 > stretch[1]


@pytest.mark.parametrize(("coding", "goal"), [("visemes", 200), ("faps", 500)])
@pytest.mark.parametrize(("repeated", "length"), [(1, 0.1), (2, 0.08), (24, 0.08)])
def test_streams_keep_their_bit_rates(coding: Coding, goal: int, repeated: int, length: float) -> None:
    said = speech(repeated, length)  # of 3 s to a minute, 10 to 12 sounds in a second
    data = encode(perform(said, coding=coding, life=0), encoder_options(coding))
    assert 8 * len(data) / said.seconds <= goal


@pytest.mark.parametrize("coding", CODINGS)
def test_a_word_loses_no_closure_and_not_most_of_its_sounds(coding: Coding) -> None:
    """The beginning of a stream alone takes more than the goal."""
    phones = tuple(Phone(name, at / 10, (at + 1) / 10) for at, name in enumerate(["M", "AE", "S", "IH", "P"]))
    said = Speech(phones, (), 0.5)
    full, short = (perform(said, coding=coding, life=0, keep_goal=keep) for keep in (False, True))
    assert len(full) > len(short) >= 0.6 * len(full)
    assert {round(phones[at].start * 25 + 1.25) for at in (0, 4)} <= set(short.index.tolist())


def test_a_stream_of_visemes_has_no_range_lists() -> None:
    """Without a low-level FAP they would be 72 marker bits."""
    data = encode(perform(speech(), coding="visemes", life=0), encoder_options("visemes"))
    faces = [frame.plane.settings.face for frame in fba.Decoder().push(data)]
    assert faces
    assert not any(face.ranges for face in faces if face is not None)
    assert len(decode_values(data)) == len(faces)  # the textbook decoder


def test_visemes_of_a_stream_are_those_that_were_spoken() -> None:
    said = speech(4)
    shapes = read_shapes(fba.decode(encode(perform(said, coding="visemes"), encoder_options("visemes"))))
    times = np.arange(0, said.seconds, 0.01)
    spoken, read = (
        [next((each.viseme for each in found if each.start <= time < each.end), 0) for time in times]
        for found in (find_shapes(said.phones), shapes)
    )
    assert np.mean(np.array(spoken) == np.array(read)) > 0.7


def test_a_mumbled_mouth_moves_less() -> None:
    said = speech()
    moved = [np.abs(shown(perform(said, style=style, life=0), [0.5])).sum() for style in (0.0, 0.5, 1.0)]
    assert moved[0] < moved[1] < moved[2]


@pytest.mark.parametrize("coding", CODINGS)
def test_life_moves_more_than_the_mouth(coding: Coding) -> None:
    said = speech(6)
    still, alive = (perform(said, coding=coding, life=life) for life in (0.0, 1.0))
    numbers = fap_numbers()
    assert still.face is not None
    for name in ("head_pitch", "raise_l_i_eyebrow", "close_t_l_eyelid", "head_yaw"):
        column = numbers[name] - 1
        assert not still.face.values[:, column].any()
        assert alive.face.values[:, column].any()
    assert alive.face.values[:, numbers["close_t_l_eyelid"] - 1].max() == 700


def test_eyes_blink_every_few_seconds_without_a_pause() -> None:
    said = Speech(tuple(Phone("AA", at / 10, (at + 1) / 10) for at in range(300)), (), 30.0)
    face = perform(said, life=1).face
    lids = face.values[:, fap_numbers()["close_t_l_eyelid"] - 1] == 700
    assert 4 <= np.count_nonzero(lids[1:] & ~lids[:-1]) <= 12


class Mouth:
    """The built-in head's lips, teeth and tongue; metres, y up, z forward."""

    def __init__(self) -> None:
        self._model = FaceModel.default()
        self._deform = Deformer(self._model)
        self._lips = [int(self._model.bound[names().index(point)]) for point in ("2.2", "2.3")]

    def _part(self, name: str) -> slice:
        first = self._model.starts[name]
        return slice(first, first + len(self._model.part(name).vertices))

    def measure(self, faps: Float32) -> dict[str, float]:
        """How far lips are apart, the lower lip is below the edge of the upper incisors, and before them, and
        the tongue stands out before them, over those of the lower jaw, and under the upper ones."""
        at = self._deform(faps)
        upper, lower, tongue = (at[self._part(name)] for name in ("teeth_upper", "teeth_lower", "tongue"))
        upper, lower = upper[np.abs(upper[:, 0]) < 0.006], lower[np.abs(lower[:, 0]) < 0.006]
        top, bottom = at[self._lips]
        tip = tongue[tongue[:, 2].argmax()]
        return {
            "gap": float(top[1] - bottom[1]),
            "lip below": float(upper[:, 1].min() - bottom[1]),
            "lip before": float(bottom[2] - upper[:, 2].max()),
            "tongue out": float(tip[2] - upper[:, 2].max()),
            "tongue over": float(tip[1] - lower[:, 1].max()),
            "tongue under": float(upper[:, 1].min() - tip[1]),
        }


SENTENCE = (
    "pau:0.174 m:0.271 ay:0.432 m:0.509 ah:0.661 dh:0.730 er:0.867 th:1.009 ih:1.090 ng:1.171 k:1.246 "
    "s:1.368 w:1.436 iy:1.516 sh:1.666 uh:1.811 d:1.855 m:1.926 uw:2.039 v:2.086 dh:2.128 ax:2.164 b:2.233 "
    "l:2.379 uw:2.474 b:2.545 ow:2.649 t:2.717 ow:2.813 v:2.876 er:2.939 f:3.020 aa:3.076 r:3.200 pau:3.431"
)
"""Ends of phones as flite speaks "My mother thinks we should move the blue boat over far"."""


@pytest.mark.parametrize("coding", CODINGS)
def test_lips_teeth_and_tongue_meet_where_they_must(coding: Coding) -> None:
    ends = [(name, float(end)) for name, end in (each.split(":") for each in SENTENCE.split())]
    starts = [0.0, *(end for _, end in ends)]
    phones = tuple(Phone(name, start, end) for (name, end), start in zip(ends, starts, strict=False))
    decoded = fba.decode(
        encode(perform(Speech(phones, (), ends[-1][1]), coding=coding, life=0), encoder_options(coding))
    )
    mouth, met = Mouth(), {1: 0, 2: 0, 3: 0}
    for shape in find_shapes(phones):
        if shape.viseme not in met:
            continue
        around = np.linspace(shape.centre - 0.04, shape.centre + 0.04, 17).tolist()
        moments = [mouth.measure(faps) for faps in shown(decoded, around)]
        if shape.viseme == 1:
            met[1] += min(each["gap"] for each in moments) < 0.0008
        elif shape.viseme == 2:
            met[2] += any(abs(each["lip below"]) < 0.002 and each["lip before"] < 0.0025 for each in moments)
        else:
            met[3] += any(
                each["tongue out"] > 0.003 and min(each["tongue over"], each["tongue under"]) > 0
                for each in moments
            )
    assert met == {1: 5, 2: 3, 3: 2}  # of three, but the time of "move the" is too short for both


def test_silence_is_a_face_at_rest() -> None:
    for coding in CODINGS:
        made = perform(Speech((Phone("SIL", 0.0, 2.0),), (), 2.0), coding=coding, life=0)
        assert not shown(made, [0.0, 1.0, 2.0]).any()


def test_times_far_into_a_recording_are_kept() -> None:
    """Coarticulation goes by pieces of two minutes: the same sounds look the same in each."""
    said = speech()
    later = tuple(Phone(each.name, each.start + 119.52, each.end + 119.52) for each in said.phones)
    moments = [0.32, 0.48, 0.64, 1.2]
    first = shown(perform(said, life=0, keep_goal=False), moments)
    much = Speech((Phone("SIL", 0, 119.52), *later), (), said.seconds + 119.52)
    second = shown(
        perform(much, life=0, keep_goal=False),
        [moment + 119.52 for moment in moments],
    )
    assert np.abs(first - second).max() <= np.abs(first).max() / 63  # a step of viseme_blend


@pytest.mark.parametrize("wrong", [{"style": -0.1}, {"style": 1.1}, {"life": 2.0}, {"life": float("nan")}])
def test_numbers_outside_of_their_range_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(OptionError, match="must be from 0 to 1"):
        perform(speech(), **wrong)  # type: ignore[arg-type]
