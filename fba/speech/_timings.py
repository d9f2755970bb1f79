"""Timings of speech that other programs make: which sound or mouth shape is when.

`format_visemes` writes them for other programs: JSON with Oculus' names, and Praat's TextGrid.
"""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np

from fba.animation import Animation
from fba.atomic import PathLike
from fba.errors import FormatError
from fba.face import Definitions
from fba.source import naming_file, open_source
from fba.speech._mouth_cues import (
    OCULUS,
    Entry,
    parse_events,
    parse_moho,
    parse_papagayo,
    parse_polly_lines,
    parse_rhubarb_json,
    parse_rhubarb_tsv,
    parse_rhubarb_xml,
)
from fba.speech._sounds import SILENCE, Phone, Shape, Speech, find_sound

_NAMES = {number: name for name, number in reversed(OCULUS.items())}

VisemeFormat = Literal["json", "textgrid"]
MOST_BYTES = 1 << 26
"""Largest file of timings."""
MOST_HEADER = 4096
"""Characters of the titles of a table's columns."""
MOST_SECONDS = 100 * 3600.0
SIZES = (1.0, 0.75, 0.5)
"""Of visemes with which a mouth is compared."""


def read_timings(path: PathLike) -> Speech:
    """Return the timings of a file, whose kind is seen by its content.

    Praat's TextGrid (long and short, the tier named phones, phonemes or segments, else the only one), the
    JSON and CSV of the Montreal Forced Aligner, NIST's CTM, SRT whose texts are phones; the mouths of Rhubarb
    (JSON, TSV, XML), Papagayo and Moho, the visemes of Azure, Oculus and Polly as JSON.

    Raises FormatError for a file of no such kind, unknown sounds, or times that run back.
    """
    with naming_file(path):
        text = _read_text(path)
        for kind, fits, parse in _KINDS:
            if fits(text):
                return _order(_parse(parse, text), kind)
    if "jawopen" in text[:MOST_HEADER].lower():
        raise FormatError(
            "holds ARKit's curves, the motion of a face rather than timings: `fba speak` takes them, and so "
            "does perform as the motion that fba.read makes of them",
            path=path,
        )
    raise FormatError(
        "is no file of timings; those of Praat, Montreal Forced Aligner, CTM, SRT, Rhubarb, Papagayo, Moho, "
        "Azure, Oculus and Polly can be read",
        path=path,
    )


def _read_text(path: PathLike) -> str:
    file, _ = open_source(Path(path))
    with file:
        data = file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise FormatError(f"has more than {MOST_BYTES} bytes, too many for timings")
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        raise FormatError(f"is no text in UTF-8 or UTF-16: {error.reason} at byte {error.start}") from None


def _order(entries: list[Entry], kind: str) -> Speech:
    """Return entries as phones. Raises FormatError for none, or for times that run back or are impossible."""
    if not entries:
        raise FormatError(f"holds no timings ({kind})")
    phones: list[Phone] = []
    before = 0.0
    for number, (start, end, what) in enumerate(entries, 1):
        if not (math.isfinite(start) and math.isfinite(end) and 0 <= start <= end <= MOST_SECONDS):
            raise FormatError(f"entry {number} lasts from {start} to {end} s, which is impossible")
        if start < before - 0.0005:
            raise FormatError(
                f"entry {number} begins at {start:g} s, before the one before it ends, {before:g} s"
            )
        if end > start:
            name = what if isinstance(what, str) else PHONES[what]
            try:
                find_sound(name)
            except FormatError as error:
                raise FormatError(f"entry {number}, at {start:g} s: {error}") from None
            if start > before:
                phones.append(Phone(SILENCE, before, start))
            phones.append(Phone(name, start, end))
        before = end
    return Speech(tuple(phones), (), before)


def find_timings(motion: Animation) -> Speech:
    """Return the phones that the mouth of a captured face is most like, fully or less strongly.

    A mouth is bent towards the sounds around, so that most are not the ones that were meant.

    Raises FormatError for an animation without a face or without frames.
    """
    if motion.face is None:
        raise FormatError("the motion is that of a body, not of a face")
    if not len(motion):
        raise FormatError("the motion has no frames")
    table = Definitions.default().visemes
    alike, squares = motion.face.values @ table.T, np.square(table).sum(axis=1)
    nearest = np.argmin(np.min([size**2 * squares - 2 * size * alike for size in SIZES], axis=0), axis=1)
    starts = np.flatnonzero(np.diff(nearest, prepend=-1))
    times = [*(motion.index[starts] / float(motion.rate)), float((motion.index[-1] + 1) / motion.rate)]
    names = [PHONES[number] for number in nearest[starts]]
    phones = (Phone(name, start, end) for name, (start, end) in zip(names, pairwise(times), strict=True))
    return Speech(tuple(phones), (), times[-1])


PHONES = (SILENCE, "P", "F", "TH", "T", "K", "CH", "S", "L", "R", "AA", "EH", "IH", "AO", "UH")
"""A phone that shows each viseme."""

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_TIERS = ("phones", "phonemes", "segments", "phone", "phoneme", "mau", "pho", "phonalign", "phons")


def _parse_textgrid(text: str) -> list[Entry]:
    """Both forms hold the same values in the same order: numbers, and texts in quotation marks."""
    body = text.split("\n", 2)[-1]
    tokens = re.findall(rf'"(?:[^"]|"")*"|(?<![\w\[.]){_NUMBER}(?![\w\].])|<exists>', body)
    values: Iterator[str] = iter(tokens)
    tiers: dict[str, list[Entry]] = {}
    try:
        float(next(values)), float(next(values))
        if next(values) != "<exists>":
            raise FormatError("its TextGrid has no tiers")
        for _ in range(int(next(values))):
            kind, name = _unquoted(next(values)), _unquoted(next(values))
            float(next(values)), float(next(values))
            count = int(next(values))
            entries: list[Entry] = []
            for _ in range(count):
                if kind == "IntervalTier":
                    entries.append((float(next(values)), float(next(values)), _unquoted(next(values))))
                else:
                    next(values), next(values)  # a point has no duration
            if kind == "IntervalTier":
                tiers[name.lower()] = entries
    except (StopIteration, ValueError):
        raise FormatError("its TextGrid is cut off or damaged") from None
    return _choose_tier(tiers)


def _choose_tier(tiers: dict[str, list[Entry]]) -> list[Entry]:
    """Return the tier of phones. tiers: by their names in small letters, with or without the speaker's."""
    for wanted in _TIERS:
        for name, entries in tiers.items():
            if name == wanted or name.endswith(f"- {wanted}"):
                return entries
    if len(tiers) == 1:
        return next(iter(tiers.values()))
    raise FormatError(f"has no tier named phones; its tiers are {', '.join(tiers) or 'none'}")


def _unquoted(text: str) -> str:
    if not text.startswith('"'):
        raise ValueError
    return text[1:-1].replace('""', '"')


def _parse_ctm(text: str) -> list[Entry]:
    rows = [line.split() for line in text.splitlines() if line.strip() and not line.startswith(";;")]
    sources = {(row[0], row[1]) for row in rows}
    if len(sources) > 1:
        raise FormatError(f"its CTM holds {len(sources)} recordings; keep one")
    return [(float(row[2]), float(row[2]) + float(row[3]), re.sub(r"_[BIES]$", "", row[4])) for row in rows]


def _parse_mfa_json(text: str) -> list[Entry]:
    """The Montreal Forced Aligner's JSON: tiers of intervals."""
    tiers = json.loads(text)["tiers"]
    return _choose_tier(
        {
            name.lower(): [(float(start), float(end), str(what)) for start, end, what in tier["entries"]]
            for name, tier in tiers.items()
        }
    )


def _parse_mfa_csv(text: str) -> list[Entry]:
    """The Montreal Forced Aligner's table: Begin, End, Label, Type, Speaker."""
    rows = list(csv.DictReader(text.splitlines()))
    speakers = {row["Speaker"] for row in rows}
    if len(speakers) > 1:
        raise FormatError(f"its table holds {len(speakers)} speakers; keep one")
    return [(float(row["Begin"]), float(row["End"]), row["Label"]) for row in rows if row["Type"] == "phones"]


def _parse_srt(text: str) -> list[Entry]:
    entries: list[Entry] = []
    for block in re.split(r"\n\s*\n", text.strip().replace("\r", "")):
        lines = block.split("\n")
        times = re.fullmatch(r"\s*(\S+)\s*-->\s*(\S+).*", lines[1] if len(lines) > 1 else "")
        if times is None:
            raise FormatError(f"its SRT has a block without times: {block[:40]!r}")
        start, end = (_clock(each) for each in times.groups())
        names = " ".join(lines[2:]).split() or [SILENCE]
        step = (end - start) / len(names)
        entries += [(start + step * at, start + step * (at + 1), name) for at, name in enumerate(names)]
    return entries


def _clock(text: str) -> float:
    hours, minutes, seconds = text.replace(",", ".").split(":")
    return int(hours) * 3600 + int(minutes) * 60 + float(seconds)


def _parse(parse: Callable[[str], list[Entry]], text: str) -> list[Entry]:
    try:
        return parse(text)
    except FormatError:
        raise
    except (
        ValueError,
        KeyError,
        IndexError,
        TypeError,
        AttributeError,
        RecursionError,
        StopIteration,
        ZeroDivisionError,
    ) as error:
        raise FormatError(f"its timings are damaged: {type(error).__name__}, {error}") from None


def _is_json(text: str) -> bool:
    return text.lstrip()[:1] == "{"


def _is_ctm(text: str) -> bool:
    line = next((line for line in text.splitlines() if line.strip() and not line.startswith(";;")), "")
    return (
        re.fullmatch(rf"\S+ \S+ {_NUMBER} {_NUMBER} \S+(?: {_NUMBER})?", " ".join(line.split())) is not None
    )


_KINDS: tuple[tuple[str, Callable[[str], bool], Callable[[str], list[Entry]]], ...] = (
    ("TextGrid", lambda text: "ooTextFile" in text[:40], _parse_textgrid),
    ("Montreal Forced Aligner", lambda text: _is_json(text) and '"tiers"' in text, _parse_mfa_json),
    ("Montreal Forced Aligner", lambda text: text.startswith("Begin,End,Label,Type,Speaker"), _parse_mfa_csv),
    ("Rhubarb", lambda text: _is_json(text) and '"mouthCues"' in text, parse_rhubarb_json),
    ("Polly", lambda text: _is_json(text) and '"type"' in text.lstrip().split("\n")[0], parse_polly_lines),
    ("visemes", lambda text: text.lstrip()[:1] in ("[", "{"), parse_events),
    ("Rhubarb", lambda text: "<rhubarbResult" in text[:MOST_HEADER], parse_rhubarb_xml),
    ("Moho", lambda text: text.startswith("MohoSwitch1"), parse_moho),
    ("Papagayo", lambda text: text.startswith("lipsync version 1"), parse_papagayo),
    ("SRT", lambda text: re.match(r"\s*\d+\s*\r?\n[^\n]*-->", text) is not None, _parse_srt),
    (
        "Rhubarb",
        lambda text: re.match(rf"{_NUMBER}\t[A-HX]\s*(\n|$)", text) is not None,
        parse_rhubarb_tsv,
    ),
    ("CTM", _is_ctm, _parse_ctm),
)


def format_visemes(shapes: Sequence[Shape], kind: VisemeFormat) -> str:
    """Return visemes as the text of a file, which `read_timings` reads.

    json: times in seconds, names of Oculus' lip sync, MPEG-4's numbers, and the share of the shape, 0 to 1.
    textgrid: an interval tier "phones" with a phone in ARPAbet that shows each viseme, empty for none.
    """
    if kind == "json":
        events = [
            {
                "time": round(each.start, 4),
                "end": round(each.end, 4),
                "viseme": _NAMES[each.viseme],
                "number": each.viseme,
                "share": round(each.size, 3),
            }
            for each in shapes
        ]
        return json.dumps({"visemes": events}, indent=1) + "\n"
    end = shapes[-1].end if shapes else 0.0
    lines = ['File type = "ooTextFile"', 'Object class = "TextGrid"', "", "0", f"{end:g}", "<exists>", "1"]
    lines += ['"IntervalTier"', '"phones"', "0", f"{end:g}", str(len(shapes))]
    for each in shapes:
        name = PHONES[each.viseme] if each.viseme else ""
        lines += [f"{each.start:.4f}", f"{each.end:.4f}", f'"{name}"']
    return "\n".join(lines) + "\n"
