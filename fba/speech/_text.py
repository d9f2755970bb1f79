"""The words of a text, with numbers and abbreviations spoken out and unknown words pronounced, by gruut."""

from __future__ import annotations

import html
import re
import unicodedata
from dataclasses import dataclass
from functools import cache
from typing import Any

from fba.errors import FormatError, UnsupportedError
from fba.speech._sounds import STRESS_MARKS, strip_marks
from fba.text_files import packaged_rows

MOST_LETTERS = 1_000_000
"""Longest text: some twenty hours of speech."""
ENGLISH = "en-us"
NEEDS_GRUUT = 'needs the package gruut: pip install "mpeg4-fba[speech]"'


@dataclass(frozen=True, slots=True)
class Pronounced:
    """A word to be spoken. text: in small letters. phones: in IPA, with stress; () if nothing says them."""

    text: str
    phones: tuple[str, ...] = ()

    @property
    def arpabet(self) -> list[tuple[str, str]]:
        """Phones in ARPAbet, each with the one in IPA that it stands for. Raises FormatError for others."""
        table = _arpabet()
        return [pair for phone in self.phones for pair in _lookup(phone, table)]


@cache
def _arpabet() -> dict[str, tuple[str, ...]]:
    rows = packaged_rows(__package__, "ipa.csv")
    return {ipa: tuple(row["arpabet"].split()) for row in rows for ipa in row["ipa"].split()}


def _lookup(phone: str, table: dict[str, tuple[str, ...]]) -> list[tuple[str, str]]:
    """Return a phone in ARPAbet, and in IPA; one that the table lacks, such as Spanish we, by its letters."""
    plain = strip_marks(phone)
    if plain in table:
        return [(name, phone) for name in table[plain]]
    stress = "".join(mark for mark in phone if mark in STRESS_MARKS)
    parts = [(name, stress + letter) for letter in plain if letter in table for name in table[letter]]
    if not parts:
        raise FormatError(f"the sound {phone!r} has no likeness in English, whose recogniser aligns the text")
    return parts


def split_text(text: str, language: str = ENGLISH) -> list[Pronounced]:
    """Return the words of a text as they are spoken. Markup in angle brackets is left out,
    and `&amp;` and its like are the characters that they stand for.

    language: as gruut names it: en-us, de-de, fr-fr. With gruut, numbers and abbreviations become words.

    Raises FormatError for a text without words, in another script, or longer than a million letters;
    UnsupportedError for a language that is not installed, and for what needs gruut where it is not installed.
    """
    if len(text) > MOST_LETTERS:
        raise FormatError(f"the text has {len(text)} letters; {MOST_LETTERS} can be spoken at once")
    text = html.unescape(re.sub(r"<[^<>]*>", " ", text))
    _check_script(text, language)
    words = _split_by_gruut(text, language)
    if words is None:
        words = _split_plainly(text, language)
    if not words:
        raise FormatError("the text has no words; give what is spoken, or leave the text out")
    return words


def _check_script(text: str, language: str) -> None:
    """Raise FormatError for letters of which no language of the Latin script has any."""
    if language.partition("-")[0] in ("ar", "fa", "ru"):
        return
    for number, line in enumerate(text.splitlines(), 1):
        for letter in line:
            if letter.isalpha() and not unicodedata.name(letter, "LATIN").startswith("LATIN"):
                script = unicodedata.name(letter).split()[0].title()
                raise FormatError(
                    f"the text has letters of the {script} script, which {language} does not use; name its "
                    "language, or write it in Latin letters",
                    line=number,
                    token=line.strip(),
                )


def _split_by_gruut(text: str, language: str) -> list[Pronounced] | None:
    """Return the words by gruut; None where it is not installed."""
    try:
        import gruut
    except ImportError:
        return None
    try:
        sentences = list(gruut.sentences(text, lang=language))
    except Exception as error:  # gruut raises what its parts raise, and for a missing language as well
        raise _missing_language(language, error) from error
    words = [word for sentence in sentences for word in sentence if word.is_spoken]
    if words and not any(word.phonemes for word in words):
        raise _missing_language(language, None)
    return [_pronounced(word) for word in words if word.phonemes]


def _missing_language(language: str, error: Exception | None) -> UnsupportedError:
    short = language.partition("-")[0]
    reason = f" ({error})" if error is not None and str(error) else ""
    return UnsupportedError(
        f"gruut does not speak {language!r}{reason}; install its package of the "
        f"language, gruut_lang_{short}, or give timings of another program"
    )


def _pronounced(word: Any) -> Pronounced:
    text = "".join(each for each in word.text.lower().replace("’", "'") if each.isalnum() or each in "'-_")
    phones = (phone for phone in word.phonemes if strip_marks(phone))
    return Pronounced(text or "?", tuple(phones))


def _split_plainly(text: str, language: str) -> list[Pronounced]:
    if language.partition("-")[0] != "en":
        raise UnsupportedError(f"the language {language!r} {NEEDS_GRUUT}")
    digits = re.search(r"\S*\d\S*", text)
    if digits:
        raise UnsupportedError(f"the number {digits[0]!r} in the text {NEEDS_GRUUT}; or write it in words")
    return [Pronounced(word) for word in re.findall(r"[a-z]+(?:'[a-z]+)*", text.lower().replace("’", "'"))]
