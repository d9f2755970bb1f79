"""Timings of speech that other programs make: which sound or mouth shape is when."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from fba.atomic import PathLike
from fba.errors import FormatError
from fba.source import naming_file, open_source
from fba.speech._sounds import SILENCE, Phone, Speech, find_sound

MOST_BYTES = 1 << 26
"""Largest file of timings."""
MOST_HEADER = 4096
"""Characters of the titles of a table's columns."""
MOST_SECONDS = 100 * 3600.0

OCULUS = {
    "sil": 0, "PP": 1, "FF": 2, "TH": 3, "DD": 4, "kk": 5, "CH": 6, "SS": 7, "nn": 8, "RR": 9, "aa": 10,
    "E": 11, "ih": 12, "I": 12, "oh": 13, "O": 13, "ou": 14, "U": 14,
}  # fmt: skip
"""MPEG-4's visemes of the 15 of Oculus' lip sync, by their names."""
AZURE = (0, 10, 10, 13, 11, 9, 12, 14, 13, 10, 13, 10, 0, 9, 8, 7, 6, 3, 2, 4, 5, 1)
"""MPEG-4's visemes of the 22 of Azure's speech service, by their numbers."""
RHUBARB = {"A": 1, "B": 7, "C": 11, "D": 10, "E": 13, "F": 14, "G": 2, "H": 8, "X": 0}
"""MPEG-4's visemes of Rhubarb's nine mouth shapes, by their letters."""


def read_timings(path: PathLike) -> Speech:
    """Return the timings of a file, whose kind is seen by its content.

    Praat's TextGrid (long and short, the tier named phones, phonemes or segments, else the only one), NIST's
    CTM, Rhubarb's JSON and TSV, the visemes of Azure and Oculus as JSON, SRT whose texts are phones.

    Raises FormatError for a file of no such kind, unknown sounds, or times that run back.
    """
    with naming_file(path):
        text = _read_text(path)
        for kind, fits, parse in _KINDS:
            if fits(text):
                return _order(parse(text), kind)
    if "jawopen" in text[:MOST_HEADER].lower():
        raise FormatError(
            f"holds ARKit's curves, the motion of a face rather than timings: fba encode {path} -o OUT.fba "
            "encodes them",
            path=path,
        )
    raise FormatError(
        "is no file of timings: TextGrid, CTM, Rhubarb, Azure, Oculus and SRT can be read", path=path
    )


Entry = tuple[float, float, int | str]
"""Start, end (seconds), and what is there: a viseme's number, or a phone."""


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


PHONES = (SILENCE, "P", "F", "TH", "T", "K", "CH", "S", "L", "R", "AA", "EH", "IH", "AO", "UH")
"""A phone that shows each viseme."""

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_TIERS = ("phones", "phonemes", "segments", "phone", "phoneme", "mau", "pho")


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
    for wanted in _TIERS:
        for name, entries in tiers.items():
            if name == wanted or name.endswith(f"- {wanted}"):
                return entries
    if len(tiers) == 1:
        return next(iter(tiers.values()))
    raise FormatError(f"its TextGrid has no tier named phones; its tiers are {', '.join(tiers) or 'none'}")


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


def _parse_rhubarb_json(text: str) -> list[Entry]:
    cues = json.loads(text)["mouthCues"]
    return [(float(cue["start"]), float(cue["end"]), RHUBARB[cue["value"]]) for cue in cues]


def _parse_rhubarb_tsv(text: str) -> list[Entry]:
    rows = [line.split("\t") for line in text.splitlines() if line.strip()]
    starts = [float(row[0]) for row in rows]
    return [
        (start, end, RHUBARB[row[1].strip()])
        for start, end, row in zip(starts, [*starts[1:], starts[-1]], rows, strict=True)
    ]


def _parse_events(text: str) -> list[Entry]:
    """Azure's and Oculus' events: each lasts until the next; the last until its end, else for 0.1 s."""
    events = json.loads(text)
    if isinstance(events, dict):
        events = events.get("visemes", events.get("events"))
    found = [_event(event) for event in events]
    if not found:
        return []
    ends = [*(start for start, _ in found[1:]), float(events[-1].get("end", found[-1][0] + 0.1))]
    return [(start, end, viseme) for (start, viseme), end in zip(found, ends, strict=True)]


def _event(event: Any) -> tuple[float, int]:
    lowered = {str(key).lower().replace("_", ""): value for key, value in event.items()}
    what = next(lowered[key] for key in ("visemeid", "viseme", "value", "name", "id") if key in lowered)
    viseme = OCULUS[what.removeprefix("viseme_")] if isinstance(what, str) else AZURE[what]
    for key, unit in (("audiooffset", 1e-7), ("offset", 1e-3), ("ms", 1e-3), ("time", 1.0), ("start", 1.0)):
        if key in lowered:
            return float(lowered[key]) * unit, viseme
    raise KeyError("time")


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


def _checked(parse: Callable[[str], list[Entry]]) -> Callable[[str], list[Entry]]:
    def checked(text: str) -> list[Entry]:
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
        ) as error:
            raise FormatError(f"its timings are damaged: {type(error).__name__}, {error}") from None

    return checked


def _is_ctm(text: str) -> bool:
    line = next((line for line in text.splitlines() if line.strip() and not line.startswith(";;")), "")
    return (
        re.fullmatch(rf"\S+ \S+ {_NUMBER} {_NUMBER} \S+(?: {_NUMBER})?", " ".join(line.split())) is not None
    )


_KINDS: tuple[tuple[str, Callable[[str], bool], Callable[[str], list[Entry]]], ...] = (
    ("TextGrid", lambda text: "ooTextFile" in text[:40], _checked(_parse_textgrid)),
    (
        "Rhubarb",
        lambda text: text.lstrip()[:1] == "{" and '"mouthCues"' in text,
        _checked(_parse_rhubarb_json),
    ),
    ("visemes", lambda text: text.lstrip()[:1] in ("[", "{"), _checked(_parse_events)),
    ("SRT", lambda text: re.match(r"\s*\d+\s*\r?\n[^\n]*-->", text) is not None, _checked(_parse_srt)),
    (
        "Rhubarb",
        lambda text: re.match(rf"{_NUMBER}\t[A-HX]\s*(\n|$)", text) is not None,
        _checked(_parse_rhubarb_tsv),
    ),
    ("CTM", _is_ctm, _checked(_parse_ctm)),
)
