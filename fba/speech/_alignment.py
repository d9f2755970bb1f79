"""When each word and phone is spoken: forced alignment and phone recognition by pocketsphinx.

Its acoustic model is of US English. Words of other languages are aligned by the sounds of English that are
most like theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from fba.arrays import Float64, Int16
from fba.errors import FormatError, UnsupportedError
from fba.speech._pieces import RATE, cut_at_pauses, measure_loudness
from fba.speech._sounds import SILENCE, STRESS_MARKS, UNSTRESSED, Phone, Speech, Word, find_sound
from fba.speech._text import ENGLISH, Pronounced

FRAME = 0.01
"""Seconds of the recogniser's frames."""
PADDING = 0.2
"""Seconds of silence put before and behind the sound: the recogniser needs some to start and end with."""
LEAD = 0.0078
"""Seconds by which a frame begins later than its number says: its window of 25.6 ms is centred on it."""
FLOOR = 45.0
"""dB below the sound of the noise that is added for the recogniser. Digital silence, as of synthetic voices,
has a spectrum like no sound, which spoils the mean by which it knows a voice."""
VOWELS = frozenset(["AA", "AE", "AH", "AO", "AW", "AY", "EH", "ER", "EY", "IH", "IY", "OW", "OY", "UH", "UW"])
PLOSIVES = frozenset(["P", "B", "T", "D", "K", "G", "CH", "JH"])
LONGEST_PLOSIVE = 0.15
"""Seconds: what is longer at the begin of a word is a pause before, as silent as the closed mouth."""
MOST_WORDS = 7.0
"""Words in a second, at most."""
HEARD, FOREIGN_HEARD = 38.0, 60.0
"""By how much frames of a word that is heard may be less likely, on average, than the likeliest sounds, in
pocketsphinx' scores: in English, and in other languages, whose sounds the recogniser does not know."""
FITS = 0.25
"""Share of words that must be heard for a text to be the one that is spoken."""
GAP = 0.6
"""Least length of a gap in a text, seconds, in which more may be spoken than it says."""
SILENT = -60.0
"""dB below full scale under which nothing is spoken."""
BEAM, PATIENT_BEAM, WIDE_BEAM = (1e-80, 1e-60), (1e-200, 1e-150), (1e-300, 1e-300)
"""How unlikely a path, and a word, may be against the best: of English sounds, of a second try, of others."""
DICTATION_BEAM = (1e-48, 7e-29)
"""The same where any English words may be spoken: pocketsphinx' own."""
MISSED_NAMED = 5

Costly = tuple[Word, float]
"""A word, and by how much its frames are less likely, on average, than the likeliest sounds."""


def find_speech(
    blocks: Iterable[Int16],
    words: Sequence[Pronounced] | None = None,
    *,
    language: str = ENGLISH,
    progress: Callable[[float], None] = lambda _: None,
) -> Speech:
    """Return when the words and phones of a text are spoken in a sound; without words, its phones.

    blocks: int16 (N,), 16 kHz, of any length, read once. words: of `split_text`. progress: called with the
    seconds that are done. Long sounds are cut at pauses; memory does not grow with them but for the result.

    Raises UnsupportedError without pocketsphinx, FormatError for an empty sound, and for a text of which less
    than a quarter of the words is heard.
    """
    listener = _Listener(words, language)
    most = HEARD if listener.english else FOREIGN_HEARD
    phones: list[Phone] = []
    heard: list[Word] = []
    missed: list[Word] = []
    extra: list[tuple[float, float]] = []
    end = 0.0
    aligned_once = False
    for start, sound, last in cut_at_pauses(blocks):
        if not len(sound):
            continue
        end = start + len(sound) / RATE
        if words is None:
            phones += _later(listener.listen(sound), start)
        else:
            free = listener.recognise(sound)
            aligned, spoken = listener.align(sound, last)
            aligned_once |= bool(aligned)
            filled, gaps = _fill(aligned or [Phone(SILENCE, 0.0, end - start)], free)
            phones += _later(filled if aligned else free, start)
            extra += [(max(begin, 0.0) + start, min(stop + start, end)) for begin, stop in gaps]
            for word, cost in _smooth(spoken):
                (heard if cost <= most else missed).append(
                    Word(word.text, max(word.start, 0.0) + start, word.end + start)
                )
        progress(end)
    if not end:
        raise FormatError("the sound is empty: it has no samples")
    if words is None:
        return Speech(tuple(_within(phones, end)), (), end)
    missed += [Word(word.text, end, end) for word in listener.left]
    share = len(heard) / len(words)
    spoken_words = tuple(sorted([*heard, *missed], key=lambda word: word.start))
    if not aligned_once or share < FITS:
        raise FormatError(_unfit(share, len(words), missed))
    return Speech(
        tuple(_within(phones, end)), spoken_words, end, share, tuple(missed[:MISSED_NAMED]), tuple(extra)
    )


def _unfit(share: float, count: int, missed: Sequence[Word]) -> str:
    where = ", ".join(
        f"{word.text!r} at {word.start:.1f} s" if word.end > word.start else repr(word.text)  # no place found
        for word in missed[:MISSED_NAMED]
    )
    return (
        f"the text does not fit the sound: {share:.0%} of its {count} words are heard; missing are "
        f"{where}{' and more' * (len(missed) > MISSED_NAMED)}; give the words that are spoken, or no text"
    )


def _fill(aligned: Sequence[Phone], free: Sequence[Phone]) -> tuple[list[Phone], list[tuple[float, float]]]:
    """Return phones of a text, with those that are heard without it where it leaves a long gap, and the gaps.

    A gap without a sound stays as it is.
    """
    filled: list[Phone] = []
    gaps: list[tuple[float, float]] = []
    for phone in aligned:
        within = [
            Phone(each.name, max(each.start, phone.start), min(each.end, phone.end))
            for each in free
            if each.start < phone.end and each.end > phone.start
        ]
        voiced = sum(each.end - each.start for each in within if find_sound(each.name) != find_sound(SILENCE))
        length = phone.end - phone.start
        if find_sound(phone.name) == find_sound(SILENCE) and length >= GAP and voiced > length / 2:
            filled += within
            gaps.append((phone.start, phone.end))
        else:
            filled.append(phone)
    return filled, gaps


class _Listener:
    """Recognisers that take a sound piece by piece, and a text as far as they have come in it."""

    def __init__(self, words: Sequence[Pronounced] | None, language: str) -> None:
        self.left = list(words or ())
        self.english = language.startswith("en")
        self._free = recogniser_of_phones()
        self._forced: Any = _decoder(BEAM if self.english else WIDE_BEAM, lm=None, bestpath=False)
        self._patient: Any = None
        self._added: dict[str, str] = {}  # phones in ARPAbet of words that the model lacks, as it spells them
        self._dictation: Any = None
        if words is None and self.english:
            self._dictation = _decoder(DICTATION_BEAM, fwdflat=False, bestpath=False)
        self._names: dict[str, list[str]] = {}  # of the phones in IPA, by words that the model lacks
        self._stresses: dict[str, tuple[float, ...]] = {}  # of vowels, by words
        for word in dict.fromkeys(self.left):
            self._learn(word)

    def _learn(self, word: Pronounced) -> None:
        pairs = word.arpabet
        self._stresses[word.text] = tuple(
            max((STRESS_MARKS.get(mark, 0.0) for mark in phone), default=0.0)
            for name, phone in pairs
            if name in VOWELS
        )
        known = self.english and self._forced.lookup_word(word.text) is not None
        if known or word.text in self._names:
            return
        if not pairs:
            raise UnsupportedError(
                f"no pronunciation is known of {word.text!r}; the package gruut finds one: "
                'pip install "mpeg4-fba[speech]"'
            )
        self._names[word.text] = [phone for _, phone in pairs]
        spelled = _spelled(word.text, self.english)
        self._added[spelled] = " ".join(name for name, _ in pairs)
        self._forced.add_word(spelled, self._added[spelled], True)

    def listen(self, sound: Int16) -> list[Phone]:
        """Return the phones of a sound without a text: of the likeliest English words, if it has any.

        Wrong words that sound alike still show the right visemes, more of them than single phones do.
        """
        words: list[str] = []
        if self._dictation is not None:
            _run(self._dictation, sound)
            found = self._dictation.hyp()
            words = [] if found is None else found.hypstr.split()
        phones, _ = self._force(sound, [Pronounced(word) for word in words]) if words else ([], [])
        return _silenced(phones, sound) if phones else self.recognise(sound)

    def recognise(self, sound: Int16) -> list[Phone]:
        """Return the phones of a sound, each found by itself."""
        _run(self._free, sound)
        found = (
            Phone(each.word, _seconds(each.start_frame), _seconds(each.end_frame + 1))
            for each in self._free.seg() or ()
        )
        return _silenced(found, sound)

    def align(self, sound: Int16, last: bool) -> tuple[list[Phone], list[Costly]]:
        """Return the phones and words of the next part of the text in a sound, as far as it is spoken there.

        last: whether it is the last of the sound's pieces, in which all that is left should be spoken.
        """
        most = int(len(sound) / RATE * MOST_WORDS) + 4
        if last and 0 < len(self.left) <= most:
            phones, words = self._force(sound, self.left)
            if phones:
                self.left = []
                return phones, words
        take = self._count_spoken(sound, self.left[:most])
        spoken, self.left = self.left[:take], self.left[take:]
        return self._force(sound, spoken) if spoken else ([], [])

    def _count_spoken(self, sound: Int16, words: Sequence[Pronounced]) -> int:
        """Return how many of the words are spoken, from the first on, by a grammar of all beginnings."""
        if not words:
            return 0
        names = [_spelled(word.text, self.english) for word in words]
        end = len(names) + 1
        steps: list[tuple[Any, ...]] = [(at, at + 1, 0.9, name) for at, name in enumerate(names)]
        steps += [(at, end, 0.1) for at in range(len(names) + 1)]
        self._forced.add_fsg("beginnings", self._forced.create_fsg("beginnings", 0, end, steps))
        self._forced.activate_search("beginnings")
        try:
            _run(self._forced, sound)
            found = self._forced.hyp()
        except RuntimeError:
            return 0
        return 0 if found is None else len(found.hypstr.split())

    def _force(self, sound: Int16, spoken: Sequence[Pronounced]) -> tuple[list[Phone], list[Costly]]:
        """Return the phones and words of a text in a sound; no phones where nothing is like the words."""
        phones, words = self._align_by(self._forced, sound, spoken)
        if len(words) < len(spoken):  # it lost its way: again, more patiently
            if self._patient is None:
                self._patient = _decoder(PATIENT_BEAM, lm=None, bestpath=False)
                for spelled, names in self._added.items():
                    self._patient.add_word(spelled, names, True)
            phones, words = self._align_by(self._patient, sound, spoken)
        if len(words) < len(spoken):
            return [], [(Word(word.text, 0.0, len(sound) / RATE), np.inf) for word in spoken]
        return phones, words

    def _align_by(
        self, decoder: Any, sound: Int16, spoken: Sequence[Pronounced]
    ) -> tuple[list[Phone], list[Costly]]:
        decoder.set_align_text(" ".join(_spelled(word.text, self.english) for word in spoken))
        try:
            _run(decoder, sound)
            decoder.set_alignment()
            _run(decoder, sound)
            alignment = decoder.get_alignment()
        except RuntimeError:
            alignment = None
        return ([], []) if alignment is None else self._collect(alignment, spoken)

    def _collect(self, alignment: Any, spoken: Sequence[Pronounced]) -> tuple[list[Phone], list[Costly]]:
        phones: list[Phone] = []
        words: list[Costly] = []
        for item in alignment:
            cost = -item.score / item.duration
            parts = [(p.name, _seconds(p.start), p.duration * FRAME) for p in item]
            if item.name.startswith(("<", "+", "[")) or len(words) == len(spoken):
                phones += [Phone(name, start, start + length) for name, start, length in parts]
                continue
            first, start, length = parts[0]
            if first in PLOSIVES and length > LONGEST_PLOSIVE:
                parts[0] = (first, start + length - LONGEST_PLOSIVE, LONGEST_PLOSIVE)
            text = spoken[len(words)].text
            words.append((Word(text, parts[0][1], sum(parts[-1][1:])), cost))
            names = self._names.get(text, [name for name, _, _ in parts])
            if len(names) != len(parts):
                names = [name for name, _, _ in parts]
            stresses = _spread(self._stresses.get(text, ()), [name for name, _, _ in parts], text)
            for name, stress, (_, start, length) in zip(names, stresses, parts, strict=True):
                phones.append(Phone(name, start, start + length, stress))
        return phones, words


def _silenced(phones: Iterable[Phone], sound: Int16) -> list[Phone]:
    """Return phones within a sound; those that are too soft to be heard become silence."""
    levels = measure_loudness(sound)
    return [
        Phone(SILENCE, each.start, each.end) if is_silent(levels, each) else each
        for each in _within(phones, len(sound) / RATE)
    ]


def is_silent(levels: Float64, phone: Phone) -> bool:
    """Whether a sound is too soft for what a recogniser hears in it. levels: dB, a hundred in a second."""
    part = levels[int(phone.start * 100) : int(phone.end * 100) + 1]
    return not len(part) or bool(part.max() < SILENT)


def _spelled(text: str, english: bool) -> str:
    """Return a word as the dictionary has it: words of other languages must not meet English ones there."""
    return text if english else f"~{text}"


def _spread(stresses: Sequence[float], names: Sequence[str], text: str) -> list[float]:
    """Return the stress of each phone. Without stresses for all vowels, the first of a long word has it."""
    vowels = [at for at, name in enumerate(names) if name in VOWELS]
    if len(stresses) != len(vowels):
        stresses = [1.0 if at == 0 and len(text) > 3 else 0.0 for at in range(len(vowels))]
    result = [1.0] * len(names)
    for at, stress in zip(vowels, stresses, strict=True):
        result[at] = UNSTRESSED + (1 - UNSTRESSED) * stress
    return result


def _model_path(name: str) -> str:
    try:
        from pocketsphinx import get_model_path
    except (ImportError, OSError) as error:
        raise UnsupportedError(
            f"speech is found in sound by the package pocketsphinx, which cannot be imported: {error}. "
            'Install it with: pip install "mpeg4-fba[speech]"; it has no wheels for Python 3.14 and later'
        ) from error
    return str(get_model_path(name))


def recogniser_of_phones() -> Any:
    """Return pocketsphinx' recogniser of phones without a text. Raises UnsupportedError without it."""
    return _decoder(BEAM, allphone=_model_path("en-us/en-us-phone.lm.bin"), lw=2.0, pip=0.3)


def _decoder(beam: tuple[float, float], **options: Any) -> Any:
    from pocketsphinx import Decoder

    return Decoder(beam=beam[0], wbeam=beam[1], pbeam=beam[0], loglevel="FATAL", **options)


def _seconds(frame: int) -> float:
    """Return the second at which a frame of a padded sound begins."""
    return frame * FRAME + LEAD - PADDING


def _run(decoder: Any, sound: Int16) -> None:
    padded = np.pad(sound.astype(np.float64), round(PADDING * RATE))
    level = max(float(np.sqrt((padded**2).mean())) / 10 ** (FLOOR / 20), 1.0)
    padded += np.random.default_rng(0).normal(0, level, len(padded))
    decoder.start_utt()
    decoder.process_raw(np.clip(np.rint(padded), -32768, 32767).astype(np.int16).tobytes(), full_utt=True)
    decoder.end_utt()


def _later(phones: Iterable[Phone], seconds: float) -> list[Phone]:
    return [Phone(each.name, each.start + seconds, each.end + seconds, each.stress) for each in phones]


def _within(phones: Iterable[Phone], seconds: float) -> Iterator[Phone]:
    """Yield phones cut to the sound, and silence between them."""
    at = 0.0
    for phone in phones:
        start, end = max(phone.start, at), min(phone.end, seconds)
        if end <= start:
            continue
        if start > at + 1e-6:
            yield Phone(SILENCE, at, start)
        yield Phone(phone.name, start, end, phone.stress)
        at = end
    if at < seconds:
        yield Phone(SILENCE, at, seconds)


def _smooth(spoken: Sequence[Costly]) -> Iterator[Costly]:
    """Yield words with the mean of their cost and their neighbours': short words alone would say little."""
    lengths = [word.end - word.start for word, _ in spoken]
    for at, (word, _) in enumerate(spoken):
        around = slice(max(at - 1, 0), at + 2)
        yield word, float(np.average([cost for _, cost in spoken[around]], weights=lengths[around]))
