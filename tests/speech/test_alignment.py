"""Words and phones in sound: what flite speaks is found where flite says that it is."""

import importlib.util
import re
import shutil
import sys
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from bench.speech.measures import add_noise, start_errors, telephone, visemes
from bench.speech.spoken import FLITE, KNOWN, VOICES, speak
from fba.animation import Animation
from fba.arrays import Int16
from fba.audio import read_mono
from fba.errors import FormatError, OptionError, UnsupportedError
from fba.parameters import fap_numbers
from fba.speech import RATE, LiveSpeech, Phone, Prosody, find_shapes, find_speech, speak_text, split_text
from fba.speech._pieces import cut_at_pauses, measure_loudness
from fba.speech._text import Pronounced
from sound_clicks import babble

needs_recogniser = pytest.mark.skipif(
    importlib.util.find_spec("pocketsphinx") is None,
    reason="pocketsphinx is not installed; it has no wheels for Python 3.14 and later",
)
needs_flite = pytest.mark.skipif(shutil.which("flite") is None, reason="flite is not installed")


def spoken(voice: str, text: str, folder: Path) -> tuple[Int16, list[Phone]]:
    phones = speak(voice, text, folder / "speech.wav")
    return np.concatenate(list(read_mono(folder / "speech.wav", RATE))), phones


@needs_recogniser
@needs_flite
def test_phones_are_found_where_they_are_spoken(tmp_path: Path) -> None:
    """The first sentences of `bench.speech.spoken`, each of another voice; its table has all of them."""
    starts, with_text, without = [], [], []
    voices = VOICES if shutil.which("espeak-ng") else FLITE
    for voice, text in zip(voices, KNOWN, strict=False):
        sound, truth = spoken(voice, text, tmp_path)
        seconds = len(sound) / RATE
        true = visemes(find_shapes(truth), seconds)
        found = find_speech([sound], split_text(text))
        assert found.found is not None
        assert found.found >= 0.7
        assert [word.text for word in found.words] == [word.text for word in split_text(text)]
        starts.append(start_errors(found, truth))
        with_text.append(visemes(find_shapes(found.phones), seconds) == true)
        without.append(visemes(find_shapes(find_speech([sound]).phones), seconds) == true)
    assert np.mean(np.concatenate(starts) <= 0.03) >= 0.9
    assert np.mean(np.concatenate(with_text)) >= 0.85
    assert np.mean(np.concatenate(without)) >= 0.7


@needs_recogniser
@needs_flite
def test_noise_and_telephones_do_not_stop_it(tmp_path: Path) -> None:
    sound, truth = spoken("slt", KNOWN[1], tmp_path)
    true = visemes(find_shapes(truth), len(sound) / RATE)
    for change, least in ((add_noise, 0.6), (telephone, 0.75)):
        found = find_speech([change(sound)], split_text(KNOWN[1]))
        assert np.mean(visemes(find_shapes(found.phones), len(sound) / RATE) == true) > least


@needs_recogniser
@needs_flite
def test_a_text_that_does_not_fit_is_refused_with_the_words_that_are_missing(tmp_path: Path) -> None:
    sound, _ = spoken("slt", KNOWN[0], tmp_path)
    with pytest.raises(
        FormatError, match=r"does not fit the sound: \d+% of its 8 words.*missing are 'yesterday'"
    ):
        find_speech([sound], split_text(KNOWN[8])[:7] + split_text("indeed"))
    with pytest.raises(FormatError, match=r"0% of its 7 words are heard; missing are '\w+', '"):
        find_speech([np.zeros(RATE, dtype=np.int16)], split_text(KNOWN[8])[:7])
    noisy = find_speech([add_noise(sound)], split_text(KNOWN[0]))
    assert noisy.found is not None
    assert noisy.found > 0.7, "the right text is heard in noise, too"
    assert min(word.start for word in noisy.words) >= 0


@needs_recogniser
@needs_flite
def test_a_text_that_is_longer_or_shorter_than_the_sound_says_where(tmp_path: Path) -> None:
    sound, truth = spoken("rms", KNOWN[0], tmp_path)
    more, _ = spoken("rms", KNOWN[4], tmp_path)
    words = split_text(KNOWN[0])
    longer = find_speech([sound], [*words, *split_text(KNOWN[4])])
    assert longer.found is not None
    assert 0.25 < longer.found < 0.6
    assert [word.text for word in longer.words][-10:] == [word.text for word in split_text(KNOWN[4])]
    assert longer.words[-1].start == longer.seconds
    shorter = find_speech([np.concatenate([sound, more])], words)
    assert shorter.found is not None
    assert shorter.found > 0.7
    ((start, end),) = shorter.extra
    assert truth[-1].end - 0.5 < start < truth[-1].end + 0.3
    assert end == pytest.approx(shorter.seconds, abs=0.3)
    after = [shape.viseme for shape in find_shapes(shorter.phones) if shape.start > start]
    assert 7 in after, "the mouth follows the sound"
    assert not find_speech([sound], words).extra


@needs_recogniser
@pytest.mark.skipif(shutil.which("espeak-ng") is None, reason="eSpeak NG is not installed")
def test_sounds_of_other_languages_are_aligned_by_their_likeness(tmp_path: Path) -> None:
    said = {
        "buenos": "b ˈwe n o s", "días": "d ˈi a s", "el": "e l", "niño": "n ˈi ɲ o", "come": "k ˈo m e",
        "tres": "t ɾ e s", "manzanas": "m a n θ ˈa n a s",
    }  # fmt: skip
    speak_text(" ".join(said), tmp_path / "speech.wav", program="espeak-ng", language="es")
    words = [Pronounced(text, tuple(phones.split())) for text, phones in said.items()]
    found = find_speech(read_mono(tmp_path / "speech.wav", RATE), words, language="es-es")
    assert found.found is not None
    assert found.found > 0.5
    starts = [word.start for word in found.words]
    assert [word.text for word in found.words] == list(said)
    assert np.diff(starts).min() > 0.08
    assert {"ɲ", "θ"} <= {phone.name for phone in found.phones}


@needs_recogniser
@needs_flite
def test_long_sounds_are_aligned_in_pieces(tmp_path: Path) -> None:
    sounds, phones, at = [], [], 0.0
    for text in KNOWN:
        sound, truth = spoken("rms", text, tmp_path)
        sounds.append(sound)
        phones += [Phone(each.name, each.start + at, each.end + at) for each in truth]
        at += len(sound) / RATE
    whole = np.concatenate(sounds)
    assert len(whole) / RATE > 26
    times: list[float] = []
    words = split_text(" ".join(KNOWN))
    found = find_speech(np.array_split(whole, 50), words, progress=times.append)
    assert len(times) > 1
    assert times == sorted(times)
    assert found.found is not None
    assert found.found > 0.8
    assert np.mean(visemes(find_shapes(found.phones), at) == visemes(find_shapes(phones), at)) > 0.8


@needs_recogniser
@pytest.mark.parametrize("seconds", [0.02, 0.5, 3.0])
def test_silence_has_no_sounds(seconds: float) -> None:
    found = find_speech([np.zeros(round(seconds * RATE), dtype=np.int16)])
    assert {shape.viseme for shape in find_shapes(found.phones)} == {0}
    assert found.seconds == pytest.approx(seconds)


@needs_recogniser
def test_an_empty_sound_is_refused() -> None:
    with pytest.raises(FormatError, match="the sound is empty"):
        find_speech([])


@needs_recogniser
def test_words_that_nobody_pronounces_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gruut", None)
    with pytest.raises(UnsupportedError, match="no pronunciation is known of 'blurfnag'"):
        find_speech([np.zeros(RATE, dtype=np.int16)], split_text("the blurfnag"))


def test_without_the_recogniser_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pocketsphinx", None)
    with pytest.raises(UnsupportedError, match=re.escape('pip install "mpeg4-fba[speech]"')):
        find_speech([np.zeros(RATE, dtype=np.int16)])


def _minutes(count: int) -> Iterator[Int16]:
    """Noise with a pause of half a second in every ten seconds."""
    rng = np.random.default_rng(1)
    for _ in range(6 * count):
        loud = rng.normal(0, 3000, round(9.5 * RATE)).astype(np.int16)
        yield np.concatenate([loud, np.zeros(RATE // 2, dtype=np.int16)])


def test_pieces_end_in_pauses_and_make_up_the_sound() -> None:
    pieces = list(cut_at_pauses(_minutes(2)))
    assert [last for *_, last in pieces] == [*[False] * (len(pieces) - 1), True]
    assert sum(len(sound) for _, sound, _ in pieces) == 120 * RATE
    at = 0
    for start, sound, last in pieces:
        assert start == at / RATE
        at += len(sound)
        assert len(sound) <= 26 * RATE
        if not last:
            assert measure_loudness(sound[-1600:]).max() == -96


@pytest.mark.parametrize("hertz", [90, 150, 220, 330])
def test_pitch_is_that_of_a_tone(hertz: int) -> None:
    times = np.arange(RATE) / RATE
    wave = sum(np.sin(2 * np.pi * hertz * part * times) / part for part in (1, 2, 3))
    prosody = Prosody()
    blocks = np.array_split((8000 * wave).astype(np.int16), 7)
    assert sum(map(len, prosody.watch(blocks))) == RATE
    loudness, pitch = prosody.mean(0.2, 0.8)
    assert pitch == pytest.approx(12 * np.log2(hertz / 70), abs=0.5)
    assert -16 < loudness < -10
    assert prosody.clipped == 0


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
