"""Forced alignment: when each word and phone of a text is spoken, by pocketsphinx' model of US English."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Int16
from fba.errors import FormatError
from fba.speech._sounds import SILENCE, Phone, Word

RATE = 16_000
"""Samples per second of the sound."""
FRAME = 0.01
"""Seconds of the recogniser's frames."""
PADDING = 0.2
"""Seconds of silence put before and behind the sound: the recogniser needs some to start and end with."""
VOWELS = frozenset("AA AE AH AO AW AY EH ER EY IH IY OW OY UH UW".split())


@dataclass(frozen=True)
class Speech:
    """What is spoken: phones and words with their times; seconds: length of the sound."""

    phones: tuple[Phone, ...]
    words: tuple[Word, ...]
    seconds: float


def _decoder(**options: Any) -> Any:
    from pocketsphinx import Decoder

    return Decoder(beam=1e-80, wbeam=1e-60, pbeam=1e-80, loglevel="FATAL", **options)


def split_text(text: str) -> list[str]:
    """Return the words of a text, in small letters, without punctuation."""
    return re.findall(r"[a-z]+(?:'[a-z]+)*", text.lower().replace("’", "'"))


def align(sound: Int16, text: str) -> Speech:
    """Return when the words and phones of a text are spoken. sound: int16 (N,), 16 kHz, one channel.

    Raises FormatError where the text has no words, or words without a known pronunciation, or does not fit.
    """
    words = split_text(text)
    if not words:
        raise FormatError("the text has no words to look for in the sound")
    decoder = _decoder(lm=None, bestpath=False)
    unknown = [word for word in dict.fromkeys(words) if decoder.lookup_word(word) is None]
    if unknown:
        raise FormatError(f"no pronunciation is known of {', '.join(unknown[:5])}")
    samples = _pad(sound)
    decoder.set_align_text(" ".join(words))
    _run(decoder, samples)
    try:
        decoder.set_alignment()
        _run(decoder, samples)
        alignment = decoder.get_alignment()
    except RuntimeError as error:
        raise FormatError(f"the text does not fit the sound: {error}") from error
    if alignment is None:
        raise FormatError("the text does not fit the sound")
    return _collect(alignment, len(sound) / RATE)


def recognise(sound: Int16) -> Speech:
    """Return the phones of a sound without its text, which is rougher. sound: as of `align`."""
    from pocketsphinx import get_model_path

    decoder = _decoder(allphone=get_model_path("en-us/en-us-phone.lm.bin"), lw=2.0, pip=0.3)
    _run(decoder, _pad(sound))
    seconds = len(sound) / RATE
    phones = [
        Phone(each.word, each.start_frame * FRAME - PADDING, (each.end_frame + 1) * FRAME - PADDING)
        for each in decoder.seg() or ()
    ]
    return Speech(tuple(_within(phones, seconds)), (), seconds)


def _pad(sound: Int16) -> Int16:
    silence = np.zeros(round(PADDING * RATE), dtype=np.int16)
    return np.concatenate([silence, sound, silence])


def _run(decoder: Any, samples: Int16) -> None:
    decoder.start_utt()
    decoder.process_raw(samples.tobytes(), full_utt=True)
    decoder.end_utt()


def _collect(alignment: Any, seconds: float) -> Speech:
    phones: list[Phone] = []
    words: list[Word] = []
    for word in alignment:
        begin = word.start * FRAME - PADDING
        if not word.name.startswith(("<", "+", "[")):
            words.append(Word(re.sub(r"\(\d+\)$", "", word.name), begin, begin + word.duration * FRAME))
        for phone in word:
            start = phone.start * FRAME - PADDING
            phones.append(Phone(phone.name, start, start + phone.duration * FRAME))
    return Speech(tuple(_within(phones, seconds)), tuple(words), seconds)


def _within(phones: Sequence[Phone], seconds: float) -> Iterator[Phone]:
    """Yield phones cut to the sound, with silence where there is none."""
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
