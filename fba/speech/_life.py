"""What a face does beside its mouth while it speaks: nods, raised brows, blinks, glances.

Nods and brows go with the syllables that stand out by stress, length, loudness and pitch; blinks come at
pauses, and every few seconds; the gaze leaves the listener in long pauses.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.arrays import Float64, Int64
from fba.parameters import FAP_COUNT, fap_numbers
from fba.speech._prosody import Prosody
from fba.speech._sounds import SILENCE, Phone, Speech, find_sound
from fba.tracks import FaceTrack

NOD, TURN = 5200.0, 2600.0
"""Of the head, in 1e-5 rad: 3 degrees down at a syllable that stands out, 1.5 to a side between phrases."""
BROWS = 160.0
"""By how much brows rise, in ENS / 1024."""
UPPER_LID, LOWER_LID = 700.0, 324.0
"""By how much lids close, in IRISD / 1024."""
GLANCE = 9000.0
"""Of the eyes, in 1e-5 rad: 5 degrees."""
ACCENTS_APART = 0.7
"""Seconds between syllables that stand out, at least."""
BLINK_PERIOD = 3.6
"""Seconds after which eyes blink without a pause."""
PAUSE = 0.18
"""Least length of a pause, seconds."""

QUIETEST, USUAL_LEVEL = -96.0, -25.0
"""dB below full scale, of silence and of speech before any was heard."""
LOUD_RANGE = 12.0
"""dB around the usual loudness within which the head follows it."""
LOUD_BEFORE = 48
"""Hundredths of a second whose loudness counts."""

_PARTS = {
    "nod": {"head_pitch": NOD},
    "turn": {"head_yaw": TURN},
    "brows": {
        f"raise_{side}_{part}_eyebrow": BROWS * size
        for side in "lr"
        for part, size in (("i", 0.8), ("m", 1.0), ("o", 0.7))
    },
    "blink": {
        "close_t_l_eyelid": UPPER_LID,
        "close_t_r_eyelid": UPPER_LID,
        "close_b_l_eyelid": LOWER_LID,
        "close_b_r_eyelid": LOWER_LID,
    },
    "gaze": {"yaw_l_eyeball": GLANCE, "yaw_r_eyeball": GLANCE},
}
_SHAPES = {
    "nod": ((-0.22, 0.0), (0.02, 1.0), (0.38, 0.0)),
    "brows": ((-0.20, 0.0), (-0.02, 1.0), (0.15, 1.0), (0.5, 0.0)),
    "blink": ((-0.08, 0.0), (0.0, 1.0), (0.04, 1.0), (0.2, 0.0)),
    "gaze": ((0.0, 0.0), (0.12, 1.0), (0.7, 1.0), (0.82, 0.0)),
}
"""Seconds from the moment, and share of the whole size there; linear between."""


@dataclass(frozen=True)
class Life:
    """Motion beside the mouth. keys: frames and sizes of each part, in their order."""

    keys: dict[str, list[tuple[int, float]]]

    @property
    def frames(self) -> set[int]:
        """The frames between which everything moves linearly."""
        return {frame for keys in self.keys.values() for frame, _ in keys}

    @property
    def faps(self) -> Int64:
        """Columns of the FAPs that move."""
        names = fap_numbers()
        return np.array([names[name] - 1 for part in self.keys for name in _PARTS[part]], dtype=np.int64)

    def values(self, index: Int64) -> Float64:
        """Return the FAPs float64 (T, 68) in frames."""
        result = np.zeros((len(index), FAP_COUNT))
        for part, keys in self.keys.items():
            frames, sizes = zip(*keys, strict=True)
            curve = np.interp(index, frames, sizes)
            for name, size in _PARTS[part].items():
                result[:, fap_numbers()[name] - 1] = size * curve
        return result


def find_life(speech: Speech, rate: Fraction, amount: float, prosody: Prosody | None = None) -> Life:
    """Return what a face does beside its mouth. amount: 0, nothing, to 1. prosody: of its sound, if any."""
    if amount <= 0:
        return Life({})
    keys: dict[str, list[tuple[int, float]]] = {part: [(0, 0.0)] for part in _PARTS}
    for number, (moment, size) in enumerate(_accents(speech, prosody)):
        _add(keys["nod"], "nod", moment, amount * size, rate)
        if size > 0.6 or number % 3 == 0:
            _add(keys["brows"], "brows", moment, amount * size, rate)
    for moment in _blinks(speech):
        _add(keys["blink"], "blink", moment, 1.0, rate)
    side = 1.0
    for pause in _pauses(speech):
        side = -side
        keys["turn"].append((max(round(pause.end * rate), keys["turn"][-1][0] + 1), side * amount))
        if pause.end - pause.start > 0.4 and pause.start > 0:
            _add(keys["gaze"], "gaze", pause.start, side * amount, rate)
    return Life({part: _simplify(each) for part, each in keys.items() if len(each) > 1})


class LiveLife:
    """The same while speech comes: the head and the brows go with the loudness, eyes blink as ever.

    rate: frames in a second. amount: as of `find_life`.
    """

    def __init__(self, rate: Fraction, amount: float) -> None:
        self._rate, self._amount = rate, amount
        self._levels = np.full(LOUD_BEFORE, QUIETEST)
        self._usual = USUAL_LEVEL
        self._number, self._blink = 0, _next_blink(0.0, 1)

    def push(self, levels: Float64) -> None:
        """Hear levels (N,), dB, of hundredths of a second."""
        self._levels = np.concatenate([self._levels, levels])[-LOUD_BEFORE:]
        loud = levels[levels > self._usual - LOUD_RANGE]
        self._usual += 0.003 * float((loud - self._usual).sum())

    def add(self, face: FaceTrack, frame: int) -> FaceTrack:
        """Return a face (1 frame) that lives."""
        if not self._amount:
            return face
        now = float(frame / self._rate)
        if now > self._blink + _SHAPES["blink"][-1][0]:
            self._number += 1
            self._blink = _next_blink(self._blink, self._number)
        loud = float(np.clip((self._levels - self._usual) / LOUD_RANGE + 0.5, 0, 1).mean())
        sizes = {"nod": self._amount * loud, "brows": self._amount * max(2 * loud - 1, 0.0)}
        offsets, shares = zip(*_SHAPES["blink"], strict=True)
        sizes["blink"] = float(np.interp(now - self._blink, offsets, shares))
        values, mask = face.values.copy(), face.mask.copy()
        for part, size in sizes.items():
            for name, most in _PARTS[part].items():
                column = fap_numbers()[name] - 1
                values[:, column] += round(size * most)
                mask[:, column] = True
        return FaceTrack(values, mask)


def _next_blink(last: float, number: int) -> float:
    """Return when eyes blink again without a pause: not like a clock."""
    return last + BLINK_PERIOD * (0.8 + 0.1 * (number * 7 % 5))


def _add(keys: list[tuple[int, float]], part: str, moment: float, size: float, rate: Fraction) -> None:
    """Add a movement, unless the one before it is still going on."""
    frames = [round((moment + offset) * rate) for offset, _ in _SHAPES[part]]
    if frames[0] < keys[-1][0]:
        return
    for frame, (_, share) in zip(frames, _SHAPES[part], strict=True):
        if frame > keys[-1][0]:
            keys.append((frame, share * size))


def _simplify(keys: list[tuple[int, float]]) -> list[tuple[int, float]]:
    """Return keys without those in the middle of a rest."""
    inner = (
        key
        for before, key, after in zip(keys, keys[1:], keys[2:], strict=False)
        if not before[1] == key[1] == after[1]
    )
    return [keys[0], *inner, keys[-1]]


def _pauses(speech: Speech) -> Iterator[Phone]:
    for phone in speech.phones:
        if phone.end - phone.start >= PAUSE and find_sound(phone.name) == find_sound(SILENCE):
            yield phone


def _blinks(speech: Speech) -> Iterator[float]:
    """Yield moments of blinks: just after the begin of pauses; without pauses, every few seconds."""
    last = 0.0
    for pause in [*_pauses(speech), Phone(SILENCE, speech.seconds, speech.seconds)]:
        number = 0
        while pause.start - last > 1.6 * BLINK_PERIOD:
            number += 1
            last = _next_blink(last, number)
            yield last
        if pause.start - last > 0.4 * BLINK_PERIOD and pause.end > pause.start:
            last = pause.start + 0.1
            yield last


def _accents(speech: Speech, prosody: Prosody | None) -> list[tuple[float, float]]:
    """Return moments and sizes, up to 1, of the syllables that stand out."""
    stressed = (phone for phone in speech.phones if phone.stress >= 1)
    vowels = [phone for phone in stressed if max(find_sound(phone.name).visemes) > 9]
    if not vowels:
        return []
    heard = [prosody.mean(each.start, each.end) if prosody else () for each in vowels]
    lengths = (each.end - each.start for each in vowels)
    features = np.array([[length, *others] for length, others in zip(lengths, heard, strict=True)])
    known = ~np.isnan(features)
    counts = np.maximum(known.sum(axis=0), 1)
    away = np.where(known, features - np.where(known, features, 0.0).sum(axis=0) / counts, 0.0)
    spread = np.sqrt((away**2).sum(axis=0) / counts)
    scores = (away / np.maximum(spread, 1e-6)).sum(axis=1) if len(vowels) > 1 else np.ones(1)
    chosen: list[tuple[float, float]] = []
    times = np.array([(phone.start + phone.end) / 2 for phone in vowels])
    taken = np.zeros(len(times), dtype=bool)
    for at in np.argsort(-scores, kind="stable"):
        left = np.searchsorted(times, times[at] - ACCENTS_APART)
        right = np.searchsorted(times, times[at] + ACCENTS_APART)
        if scores[at] > 0 and not taken[left:right].any():
            taken[at] = True
            chosen.append((float(times[at]), float(np.clip(0.4 + 0.25 * scores[at], 0.4, 1.0))))
    return sorted(chosen)
