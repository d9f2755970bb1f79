"""Speech while it is spoken: frames depend on no more than 0.3 s behind them, whatever the pieces are."""

import importlib.util
import re
import shutil
import sys
from fractions import Fraction

import numpy as np
import pytest

from bench.speech.measures import visemes
from bench.speech.spoken import KNOWN, speak
from fba.animation import Animation
from fba.arrays import Int16
from fba.audio import read_mono
from fba.errors import OptionError, UnsupportedError
from fba.parameters import fap_numbers
from fba.speech import RATE, LiveSpeech, find_shapes
from sound_clicks import babble

DELAY = 0.26
"""Seconds, the piece of 0.02 s that the sound is heard in among them."""
SOURCES = [
    pytest.param(
        True,
        marks=pytest.mark.skipif(
            importlib.util.find_spec("pocketsphinx") is None, reason="pocketsphinx is not installed"
        ),
        id="recogniser",
    ),
    pytest.param(False, id="spectrum"),
]
JAW, LIPS = (
    fap_numbers()["open_jaw"] - 1,
    [fap_numbers()[f"{name}_midlip"] - 1 for name in ("lower_t", "raise_b")],
)


def said(live: LiveSpeech, sound: Int16, piece: int) -> list[Animation]:
    return [frame for at in range(0, len(sound), piece) for frame in live.push(sound[at : at + piece])]


def values(frames: list[Animation]) -> Int16:
    faces = [frame.face for frame in frames]
    return np.concatenate([face.values for face in faces if face is not None])


@pytest.mark.parametrize("recogniser", SOURCES)
def test_frames_depend_only_on_what_was_heard_shortly_after_them(recogniser: bool) -> None:
    sound = babble()
    whole = values(said(LiveSpeech(recogniser=recogniser), sound, 700))
    for seconds in (0.5, 1.13, 2.0):
        live = LiveSpeech(recogniser=recogniser)
        part = values(said(live, sound[: round(seconds * RATE)], 701))
        assert len(part) > (seconds - DELAY) * 25
        assert np.array_equal(part, whole[: len(part)])


@pytest.mark.parametrize("recogniser", SOURCES)
@pytest.mark.parametrize("rate", ["10", "25", "30000/1001", "60"])
def test_frames_come_no_later_than_promised(recogniser: bool, rate: str) -> None:
    """A frame must be there, with the one after it, once the sound is 0.26 s ahead."""
    live, frames = LiveSpeech(recogniser=recogniser, rate=Fraction(rate)), 0
    sound = babble(1.5)
    for at in range(0, len(sound), 160):
        frames += len(list(live.push(sound[at : at + 160])))
        assert (frames - 1) / Fraction(rate) > live.seconds - DELAY - 1 / Fraction(rate)
    frames += len(list(live.finish()))
    assert frames == np.ceil(1.5 * Fraction(rate))


@pytest.mark.parametrize("recogniser", SOURCES)
@pytest.mark.parametrize("pieces", [1, 7, 40])
def test_pieces_do_not_matter(recogniser: bool, pieces: int) -> None:
    sound = babble(1.2)
    expected, given = (LiveSpeech(recogniser=recogniser) for _ in range(2))
    one = [*expected.push(sound), *expected.finish()]
    other = [frame for part in np.array_split(sound, pieces) for frame in given.push(part)]
    assert np.array_equal(values(one), values([*other, *given.finish()]))


@pytest.mark.parametrize("recogniser", SOURCES)
def test_silence_is_a_face_at_rest(recogniser: bool) -> None:
    live = LiveSpeech(recogniser=recogniser, life=0)
    frames = [*live.push(np.zeros(RATE, dtype=np.int16)), *live.finish()]
    assert len(frames) == 25
    assert not values(frames).any()


@pytest.mark.parametrize("samples", [0, 1, 100])
def test_a_moment_of_sound_is_a_frame(samples: int) -> None:
    live = LiveSpeech(recogniser=False)
    assert list(live.push(np.zeros(samples, dtype=np.int16))) == []
    assert len(list(live.finish())) == 1


@pytest.mark.skipif(shutil.which("flite") is None, reason="flite is not installed")
@pytest.mark.parametrize(("recogniser", "right"), [(SOURCES[0].values[0], 0.6), (False, 0.42)])
def test_the_mouth_makes_what_is_said(recogniser: bool, right: float, tmp_path) -> None:  # type: ignore[no-untyped-def]
    if recogniser:
        pytest.importorskip("pocketsphinx")
    live = LiveSpeech(recogniser=recogniser, life=0)
    shares = []
    for text in KNOWN[:4]:
        truth = speak("rms", text, tmp_path / "speech.wav")
        sound = np.concatenate(list(read_mono(tmp_path / "speech.wav", RATE)))
        true, begun, frames = visemes(find_shapes(truth), len(sound) / RATE), live.seconds, []
        for at in range(0, len(sound), 320):
            for frame in live.push(sound[at : at + 320]):
                frames.append(frame)
                now = float(frame.index[0] / frame.rate)
                heard = find_shapes(live._source.phones(now - 0.1))
                shown = next((each.viseme for each in heard if each.start <= now < each.end), 0)
                shares += [true[round(100 * (now - begun))] == shown] if now >= begun else []
        moved = values(frames)
        assert np.abs(moved[:, JAW]).max() > 100
        assert (moved[:, LIPS].sum(axis=1) >= 0).any(), "lips never meet"
    assert np.mean(shares) > right


@pytest.mark.slow
@pytest.mark.parametrize("recogniser", SOURCES)
def test_minutes_need_no_more_memory(recogniser: bool) -> None:
    live, sizes = LiveSpeech(recogniser=recogniser), []
    for _ in range(8):
        sizes += [len(live._source.phones(0.0)) for _ in live.push(babble(15.0))]
    assert len(sizes) == pytest.approx(8 * 15 * 25, abs=10)
    assert max(sizes[-1000:]) < 200


@pytest.mark.parametrize(
    ("wrong", "said"),
    [({"style": 1.5}, "style must"), ({"life": -1}, "life must"), ({"rate": Fraction(5)}, "10 frames")],
)
def test_numbers_out_of_range_are_refused(wrong: dict[str, float], said: str) -> None:
    with pytest.raises(OptionError, match=said):
        LiveSpeech(**wrong)  # type: ignore[arg-type]


def test_a_recogniser_that_is_not_installed_is_replaced_unless_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "pocketsphinx", None)
    assert not LiveSpeech().recognises
    with pytest.raises(UnsupportedError, match=re.escape('pip install "mpeg4-fba[speech]"')):
        LiveSpeech(recogniser=True)
