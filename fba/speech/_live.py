"""Speech while it is spoken: a face whose frames follow their sound by a bounded delay."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import groupby
from math import ceil
from typing import Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64, Int16
from fba.errors import OptionError, UnsupportedError
from fba.speech._alignment import FRAME, LEAD, is_silent, recogniser_of_phones
from fba.speech._coarticulation import coarticulate, find_style
from fba.speech._life import LiveLife
from fba.speech._performance import check_share, with_outer_lips
from fba.speech._pieces import RATE, STEP, measure_loudness
from fba.speech._sounds import SILENCE, Phone, find_shapes
from fba.speech._spectrum import Spectrum

PIECE = 2 * STEP
"""Samples that are heard at once."""
DELAY = Fraction(24, 100)
"""Seconds of sound that are heard behind the moment of a frame before the next one is shown.

An encoder may need the next one. To 0.3 s, it leaves the time of a piece, and of resampling.
"""
LEAST_RATE = 10
"""Frames in a second: with fewer, nothing would be left of the delay to hear with."""
KEPT = 1.0
"""Seconds of sounds that are kept: their pull on the mouth ends before."""
SHORTEST, LONGEST = 4.0, 12.0
"""Seconds after which the recogniser begins anew in a pause, and anywhere: its memory grows with them."""
PAUSE = 0.25
"""Seconds of silence that are a pause."""
RUN_UP = 0.4
"""Seconds of sound that it hears again when it begins anew."""
SETTLED = 0.15
"""Seconds before the end of what was heard until which the phones of the recogniser stay."""
USUAL_VOICE = (48, 6, 2, 16, -2, 1, 3, -5, -3, -4, 3, 3, 0)
"""Mean cepstrum of voices, with which the recogniser begins."""
PRIOR, MEMORY = 60.0, 600.0
"""Hundredths of a second for which that counts, and after which a voice is forgotten."""
OWN_PRIOR = 500
"""Frames for which pocketsphinx lets a mean cepstrum count that it is given."""
SPOKEN = -50.0
"""dB below full scale: only louder sound counts for the mean cepstrum."""
SHORT_CLOSURE = 0.04
"""Seconds below which the spectrum alone does not show that lips meet."""


class LiveSpeech:
    """A face that speaks as its sound comes; a frame is made from the sound until 0.26 s behind it.

    rate: frames in a second, from 10 on. style, life: as of `perform`. recogniser: whether pocketsphinx finds
    phones of English; if not, loudness and spectrum move jaw and lips, more roughly. None: if it is
    installed. recognises: whether it is used. seconds: of sound so far.

    Raises OptionError for numbers out of range, UnsupportedError for a recogniser that is not installed.
    """

    def __init__(
        self,
        *,
        rate: Fraction = Fraction(25),
        style: float = 0.5,
        life: float = 0.5,
        recogniser: bool | None = None,
    ) -> None:
        check_share("style", style)
        check_share("life", life)
        if rate < LEAST_RATE:
            raise OptionError(f"speech that comes needs {LEAST_RATE} frames/s or more, not {float(rate):g}")
        self._ahead = DELAY - 1 / rate
        self._source = _find_source(recogniser)
        self.recognises = isinstance(self._source, _Recogniser)
        self._rate, self._style = rate, find_style(style)
        self._life = LiveLife(rate, life)
        self._waiting: Int16 = np.zeros(0, dtype=np.int16)
        self._heard = self._frames = self._samples = 0

    @property
    def seconds(self) -> float:
        """Length of the sound so far."""
        return self._samples / RATE

    def push(self, sound: Int16) -> Iterator[Animation]:
        """Yield the frames, one by one, that are certain with the next samples, int16 (N,) at 16 kHz."""
        self._samples += len(sound)
        yield from self._hear(sound, None)

    def finish(self) -> Iterator[Animation]:
        """Yield the frames up to the end of the sound."""
        last = max(ceil(self.seconds * self._rate), 1)
        yield from self._hear(np.zeros(round(2 * DELAY * RATE), dtype=np.int16), last)

    def _hear(self, sound: Int16, last: int | None) -> Iterator[Animation]:
        self._waiting = np.concatenate([self._waiting, sound])
        while len(self._waiting) >= PIECE:
            piece, self._waiting = self._waiting[:PIECE], self._waiting[PIECE:]
            self._heard += PIECE
            self._source.push(piece)
            self._life.push(measure_loudness(piece))
            while (self._frames / self._rate + self._ahead) * RATE <= self._heard and self._frames != last:
                yield self._show()
                self._frames += 1

    def _show(self) -> Animation:
        """Return the next frame."""
        now = float(self._frames / self._rate)
        shapes = [
            replace(each, start=each.start - now, end=each.end - now)
            for each in find_shapes(self._source.phones(now - KEPT))
        ]
        face = with_outer_lips(coarticulate(shapes, self._rate, 1, style=self._style))
        face = self._life.add(face, self._frames)
        return Animation(
            face=face, body=None, rate=self._rate, index=np.array([self._frames], dtype=np.int64)
        )


def _find_source(recogniser: bool | None) -> _Recogniser | _Rough:
    if recogniser is False:
        return _Rough()
    try:
        return _Recogniser()
    except UnsupportedError:
        if recogniser:
            raise
        return _Rough()


class _Rough:
    """Sounds by loudness and spectrum."""

    def __init__(self) -> None:
        self._spectrum = Spectrum()
        self._judged: list[Phone] = []

    def push(self, sound: Int16) -> None:
        """Hear a piece."""
        self._judged = [*self._judged[-2 * round(KEPT / FRAME) :], *self._spectrum.push(sound)]

    def phones(self, since: float) -> list[Phone]:
        """Return the sounds from a second on, as far as they are known."""
        found: list[Phone] = []
        for name, group in groupby(
            (each for each in self._judged if each.end > since), lambda each: each.name
        ):
            parts = list(group)
            start, end = parts[0].start, parts[-1].end
            if name in ("P", "F") and end - start < SHORT_CLOSURE and found:
                found[-1] = replace(found[-1], end=end)
            else:
                found.append(Phone(name, start, end, float(np.mean([each.stress for each in parts]))))
        return found


class _Recogniser:
    """Phones by pocketsphinx, whose best guess of the last tenth of a second changes while it hears on.

    It hears one utterance after another, each of which begins anew in a pause, if there is one.
    """

    def __init__(self) -> None:
        self._decoder: Any = recogniser_of_phones()
        self._mean = np.array(USUAL_VOICE, dtype=np.float64)
        self._sum, self._weight = self._mean * PRIOR, PRIOR
        self._before: list[Phone] = []  # of earlier utterances
        self._levels: Float64 = np.zeros(0)
        self._recent: Int16 = np.zeros(round(RUN_UP * RATE), dtype=np.int16)
        self._heard = 0  # samples
        self._begin()

    def _begin(self) -> None:
        """Begin an utterance with what was heard last."""
        self._decoder.start_utt()
        self._set_mean()
        self._origin = self._heard / RATE - RUN_UP + LEAD
        self._decoder.process_raw(self._recent.tobytes())

    def _set_mean(self) -> None:
        self._decoder.set_cmn(",".join(f"{value:.4g}" for value in self._mean))

    def push(self, sound: Int16) -> None:
        """Hear a piece."""
        self._heard += len(sound)
        self._recent = np.concatenate([self._recent, sound])[-round(RUN_UP * RATE) :]
        levels = measure_loudness(sound)
        self._levels = np.concatenate([self._levels, levels])[-4 * round(KEPT / FRAME) :]
        self._decoder.process_raw(sound.tobytes())
        self._learn(len(levels), spoken=bool(levels.max() > SPOKEN))
        length = self._heard / RATE - self._origin
        pause = self._levels[-round(PAUSE / FRAME) :].max() < self._levels.max() - 30
        if length > LONGEST or (pause and length > SHORTEST):
            now = self._heard / RATE
            self._before = self.phones(now - 2 * KEPT)
            self._decoder.end_utt()
            self._begin()

    def _learn(self, count: int, *, spoken: bool) -> None:
        """Move the mean cepstrum: that of pocketsphinx needs some seconds until it fits a voice."""
        held = np.array([float(each) for each in self._decoder.get_cmn(True).split(",")])
        if spoken:
            self._sum += (OWN_PRIOR + count) * held - OWN_PRIOR * self._mean
            self._weight += count
            if self._weight > MEMORY:
                self._sum, self._weight = self._sum * (MEMORY / self._weight), MEMORY
            self._mean = self._sum / self._weight
        self._set_mean()

    def phones(self, since: float) -> list[Phone]:
        """Return the sounds from a second on, as far as they are known."""
        border = self._origin + RUN_UP - SETTLED if self._before else 0.0
        found = [each if each.end <= border else replace(each, end=border) for each in self._before]
        for each in self._decoder.seg() or ():
            start = max(self._origin + each.start_frame * FRAME, border)
            end = self._origin + (each.end_frame + 1) * FRAME
            if end > start:
                found.append(Phone(each.word, start, end))
        return [self._judge(each) for each in found if each.end > max(since, each.start)]

    def _judge(self, phone: Phone) -> Phone:
        """Return a phone, or silence where the sound is too soft for what the recogniser hears in it."""
        first = self._heard / STEP - len(self._levels)
        within = replace(phone, start=max(phone.start - first / 100, 0.0), end=phone.end - first / 100)
        return replace(phone, name=SILENCE) if within.end > 0 and is_silent(self._levels, within) else phone
