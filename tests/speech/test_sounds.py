"""Phones in ARPAbet and IPA, the visemes that they show, and the words of texts."""

from __future__ import annotations

import importlib.util
import sys

import pytest

from fba.errors import FormatError, UnsupportedError
from fba.speech import Phone, find_shapes, split_text

needs_gruut = pytest.mark.skipif(importlib.util.find_spec("gruut") is None, reason="gruut is not installed")


@pytest.mark.parametrize(
    ("name", "visemes"),
    [
        ("P", [1]), ("m", [1]), ("f", [2]), ("TH", [3]), ("ð", [3]), ("T", [4]), ("ŋ", [5]), ("tʃ", [6]),
        ("z", [7]), ("N", [8]), ("ɹ", [9]), ("AA1", [10]), ("ˈɑː", [10]), ("EH0", [11]), ("iː", [12]),
        ("AO2", [13]), ("UW", [14]), ("AY1", [10, 12]), ("oʊ", [13, 14]), ("y", [14, 12]), ("SIL", [0]),
        ("", [0]), ("pau", [0]), ("h", [0]), ("ɛ̃", [11]),
    ],
)  # fmt: skip
def test_phones_show_visemes_of_the_standards_table(name: str, visemes: list[int]) -> None:
    assert [shape.viseme for shape in find_shapes([Phone(name, 0.0, 0.1)])] == visemes


def test_the_first_part_of_a_diphthong_is_the_longer() -> None:
    first, second = find_shapes([Phone("AY", 1.0, 2.0)])
    assert (first.start, first.end, second.start, second.end) == (1.0, 1.6, 1.6, 2.0)


@pytest.mark.parametrize("name", ["QQ", "xyz!", "12"])
def test_unknown_phones_are_refused(name: str) -> None:
    with pytest.raises(FormatError, match="is no phone of ARPAbet or IPA"):
        find_shapes([Phone(name, 0.0, 1.0)])


@needs_gruut
def test_numbers_and_abbreviations_become_words() -> None:
    words = split_text("Dr. Smith paid $25, <b>he</b> said &quot;thanks&quot;.")
    assert " ".join(word.text for word in words) == "doctor smith paid twenty five dollars he said thanks"
    assert all(word.phones for word in words)


@needs_gruut
def test_unknown_words_are_pronounced() -> None:
    (word,) = split_text("blurfnag")
    assert [name for name, _ in word.arpabet][:5] == ["B", "L", "ER", "F", "N"]


@pytest.mark.parametrize(
    ("text", "language", "error", "said"),
    [
        ("", "en-us", FormatError, "has no words"),
        ("...", "en-us", FormatError, "has no words"),
        ("Привет, мир", "en-us", FormatError, "letters of the Cyrillic script"),
        ("one\n你好", "en-us", FormatError, "line 2: .*letters of the Cjk script"),
        ("a" * 1_000_001, "en-us", FormatError, "1000001 letters"),
        ("Saluton", "eo", UnsupportedError, "'eo'"),
    ],
)
def test_texts_that_cannot_be_spoken_are_refused(
    text: str, language: str, error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said):
        split_text(text, language)


def test_without_gruut_words_are_split_and_numbers_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gruut", None)
    assert [word.text for word in split_text("Don't STOP — now!")] == ["don't", "stop", "now"]
    with pytest.raises(UnsupportedError, match=r"the number 'No\.5' in the text needs the package gruut"):
        split_text("It is No.5 of them")
    with pytest.raises(UnsupportedError, match="'de-de' needs the package gruut"):
        split_text("Guten Tag", "de-de")
