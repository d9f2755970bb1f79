"""Speech sounds: phones with times, and the visemes that each shows (ISO/IEC 14496-2, table of visemes)."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

from fba.errors import FormatError, did_you_mean
from fba.text_files import packaged_rows

SILENCE = "SIL"
FIRST_SHARE = 0.6
"""Share of a diphthong's time that its first viseme takes."""
STRESS_MARKS = {"ˈ": 1.0, "'": 1.0, "ˌ": 0.7, ",": 0.7}
IGNORED_MARKS = frozenset("ˈˌ'ːˑ:‿|‖ʰʲʷˠˤⁿˡ0123456789")
"""Marks of IPA that do not change what lips show: stress, length, ties, releases, tones."""
UNSTRESSED = 0.85


@dataclass(frozen=True, slots=True)
class Phone:
    """A speech sound. name: in ARPAbet or IPA. start, end: seconds. stress: 1 for the main one."""

    name: str
    start: float
    end: float
    stress: float = 1.0


@dataclass(frozen=True, slots=True)
class Word:
    """A spoken word. start, end: seconds."""

    text: str
    start: float
    end: float


@dataclass(frozen=True)
class Speech:
    """What is spoken: phones and words with their times. seconds: length of the sound.

    found: share of the words of the text that are heard in the sound; None without a text. missed: words that
    are not heard, the first ones. extra: spans, in seconds, in which something else is spoken than the text.
    """

    phones: tuple[Phone, ...]
    words: tuple[Word, ...]
    seconds: float
    found: float | None = None
    missed: tuple[Word, ...] = ()
    extra: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Sound:
    """What a phone shows.

    visemes: numbers of one viseme, or of two that follow each other. size: of its shape, 0 to 1. weight: how
    strongly it holds against its neighbours, 0 to 1.
    """

    visemes: tuple[int, ...]
    size: float
    weight: float


@dataclass(frozen=True, slots=True)
class Shape:
    """A viseme that speech passes through. start, end: seconds. size, weight: as of `Sound`."""

    viseme: int
    start: float
    end: float
    size: float
    weight: float

    @property
    def centre(self) -> float:
        """Seconds."""
        return (self.start + self.end) / 2


@cache
def _table() -> dict[str, Sound]:
    table = {}
    for row in packaged_rows(__package__, "sounds.csv"):
        numbers, _, size = row["visemes"].partition("*")
        sound = Sound(tuple(map(int, numbers.split("+"))), float(size or 1), float(row["weight"]))
        table.update(dict.fromkeys(f"{row['arpabet']} {row['ipa']}".split(), sound))
    return table


def find_sound(name: str) -> Sound:
    """Return what a phone shows. name: ARPAbet, with or without a digit of stress, or IPA with its marks.

    Raises FormatError for an unknown one.
    """
    table = _table()
    plain = name.strip().strip("".join(STRESS_MARKS))
    for key in (plain, plain.upper().rstrip("012"), strip_marks(plain)):
        if key in table:
            return table[key]
    if not plain:
        return table[SILENCE]
    known = strip_marks(plain)[:1]  # a letter with further letters or marks that the table does not list
    if known in table and not plain.isascii():
        return table[known]
    raise FormatError(
        f"{name!r} is no phone of ARPAbet or IPA{did_you_mean(plain.upper(), table)}; "
        "silence is SIL, pau or an empty text"
    )


def strip_marks(text: str) -> str:
    """Return a phone of IPA without stress, length, tone and other marks that lips do not show."""
    letters = (letter for letter in unicodedata.normalize("NFD", text) if not unicodedata.combining(letter))
    return "".join(letter for letter in letters if letter not in IGNORED_MARKS)


def find_shapes(phones: Iterable[Phone]) -> tuple[Shape, ...]:
    """Return the visemes that phones show, in their order; a diphthong shows two."""
    shapes: list[Shape] = []
    for phone in phones:
        sound = find_sound(phone.name)
        bounds = [phone.start, phone.end]
        if len(sound.visemes) == 2:
            bounds.insert(1, phone.start + FIRST_SHARE * (phone.end - phone.start))
        for viseme, start, end in zip(sound.visemes, bounds, bounds[1:], strict=False):
            last = shapes[-1] if shapes else None
            if last is not None and last.viseme == viseme and (viseme == 0 or last.weight == sound.weight):
                shapes[-1] = Shape(viseme, last.start, end, max(last.size, sound.size), last.weight)
            else:
                size = sound.size * phone.stress if viseme > 9 else sound.size
                shapes.append(Shape(viseme, start, end, size, sound.weight))
    return tuple(shapes)
