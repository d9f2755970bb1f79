"""Files of mouth shapes with times: of Rhubarb, Papagayo, Moho, and of speech services."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from itertools import pairwise
from statistics import median
from typing import Any

from fba.errors import FormatError

Entry = tuple[float, float, int | str]
"""Start, end (seconds), and what is there: a viseme's number, or a phone."""

OCULUS = {
    "sil": 0, "PP": 1, "FF": 2, "TH": 3, "DD": 4, "kk": 5, "CH": 6, "SS": 7, "nn": 8, "RR": 9, "aa": 10,
    "E": 11, "ih": 12, "I": 12, "oh": 13, "O": 13, "ou": 14, "U": 14,
}  # fmt: skip
"""MPEG-4's visemes of the 15 of Oculus' lip sync, by their names."""
AZURE = (0, 10, 10, 13, 11, 9, 12, 14, 13, 10, 13, 10, 0, 9, 8, 7, 6, 3, 2, 4, 5, 1)
"""MPEG-4's visemes of the 22 of Azure's speech service, by their numbers."""
POLLY = {
    "sil": 0, "p": 1, "f": 2, "T": 3, "t": 4, "k": 5, "S": 6, "s": 7, "l": 8, "r": 9, "a": 10, "@": 10,
    "e": 11, "E": 11, "i": 12, "o": 13, "O": 13, "u": 14,
}  # fmt: skip
"""MPEG-4's visemes of those of Amazon Polly, by their names."""
RHUBARB = {"A": 1, "B": 7, "C": 11, "D": 10, "E": 13, "F": 14, "G": 2, "H": 8, "X": 0}
"""MPEG-4's visemes of Rhubarb's nine mouth shapes, by their letters."""
PRESTON_BLAIR = {
    "rest": 0, "MBP": 1, "FV": 2, "etc": 7, "L": 8, "AI": 10, "E": 11, "O": 13, "U": 14, "WQ": 14,
}  # fmt: skip
"""MPEG-4's visemes of the ten drawings by which animators know mouths."""
MOHO_RATE = 24.0
"""Frames per second of Moho's files, which do not say it."""
TICKS_APART, MS_APART = 1e4, 5.0
"""Distances between visemes from which offsets are ticks of 100 ns, and ms; nearer ones are seconds."""


def until_next(starts: Sequence[tuple[float, int | str]], end: float) -> list[Entry]:
    """Return entries of which each lasts until the next. end: of the last, seconds."""
    times = [*(start for start, _ in starts), end]
    return [(start, stop, what) for (start, what), (_, stop) in zip(starts, pairwise(times), strict=True)]


def parse_rhubarb_json(text: str) -> list[Entry]:
    """Return the entries of Rhubarb's JSON. In its WASM edition, cues are cut short by the next ones."""
    cues = json.loads(text)["mouthCues"]
    return _cues([(float(cue["start"]), float(cue["end"]), cue["value"]) for cue in cues])


def parse_rhubarb_xml(text: str) -> list[Entry]:
    """Return the entries of Rhubarb's XML."""
    found = re.findall(r"<mouthCue\s+start=\"([^\"]*)\"\s+end=\"([^\"]*)\"\s*>\s*(\w+)\s*</mouthCue>", text)
    if len(found) != text.count("<mouthCue "):
        raise FormatError("has mouth cues that are cut off or damaged")
    return _cues([(float(start), float(end), letter) for start, end, letter in found])


def _cues(cues: list[tuple[float, float, str]]) -> list[Entry]:
    nexts = [*(start for start, _, _ in cues[1:]), float("inf")]
    return [
        (start, max(min(end, following), start) if end >= start else end, RHUBARB[letter])
        for (start, end, letter), following in zip(cues, nexts, strict=True)
    ]


def parse_rhubarb_tsv(text: str) -> list[Entry]:
    """Return the entries of Rhubarb's table, whose last row is the end."""
    rows = [line.split("\t") for line in text.splitlines() if line.strip()]
    starts: list[tuple[float, int | str]] = [(float(row[0]), RHUBARB[row[1].strip()]) for row in rows]
    return until_next(starts, starts[-1][0])


def parse_moho(text: str) -> list[Entry]:
    """Return the entries of Moho's switch data, as Papagayo, Rhubarb and OpenToonz know them."""
    rate, starts = MOHO_RATE, list[tuple[float, int | str]]()
    for line in text.splitlines()[1:]:
        first, *rest = line.split() or [""]
        if first == "FPS":
            rate = float(rest[0])
        elif rest:
            starts.append((max(int(first) - 1, 0) / rate, _drawing(rest[0])))
    return until_next(starts, starts[-1][0] + 1 / rate) if starts else []


def _drawing(name: str) -> int | str:
    """Return the viseme of a mouth that animators draw, of Rhubarb's letter, or the phone that it names."""
    lowered = {each.lower(): viseme for each, viseme in PRESTON_BLAIR.items()}
    if name.lower() in lowered:
        return lowered[name.lower()]
    return RHUBARB.get(name, name)


def parse_papagayo(text: str) -> list[Entry]:
    """Return the entries of Papagayo's project: of its first voice, mouths in words, and rests between them.

    Lines: title, sound, frames per second, frames, voices; a voice: name, text, phrases; a phrase: text,
    start, end, words; a word: its text, start, end, phonemes; a phoneme: frame, name.
    """
    lines = [line.strip() for line in text.splitlines()]
    rate, last = float(lines[2]), int(lines[3])
    starts: list[tuple[float, int | str]] = []
    at = 8  # after the name and text of the first voice, and its count of phrases
    for _ in range(int(lines[7])):
        words = int(lines[at + 3])
        at += 4
        for _ in range(words):
            *_, end, count = lines[at].split()
            for line in lines[at + 1 : at + 1 + int(count)]:
                frame, name = line.split()
                starts.append((int(frame) / rate, _drawing(name)))
            starts.append(((int(end) + 1) / rate, 0))
            at += 1 + int(count)
    moments = [start for start, _ in starts[1:]]
    kept = [  # no rest between words that follow each other
        each
        for each, following in zip(starts, [*moments, float("inf")], strict=True)
        if each[1] != 0 or each[0] < following
    ]
    return until_next(kept, max(last / rate, kept[-1][0])) if kept else []


def parse_polly_lines(text: str) -> list[Entry]:
    """Return the entries of Amazon Polly's speech marks, an event a line."""
    return _parse_polly([json.loads(line) for line in text.splitlines() if line.strip()])


def _parse_polly(events: Sequence[dict[str, Any]]) -> list[Entry]:
    starts: list[tuple[float, int | str]] = [
        (event["time"] / 1000, POLLY[event["value"]]) for event in events if event["type"] == "viseme"
    ]
    return until_next(starts, starts[-1][0] + 0.1) if starts else []


_TIMES = {
    "audiooffsetms": 1e-3, "offsetms": 1e-3, "timems": 1e-3, "tms": 1e-3, "timestampms": 1e-3, "ms": 1e-3,
    "audiooffset": 1e-7, "offset": 1e-3, "time": 1.0, "start": 1.0,
}  # fmt: skip
"""Seconds of the unit of an event's time, by its name in small letters; for offsets, the usual one."""
_SHAPES = ("visemeid", "viseme", "value", "name", "id")


def parse_events(text: str) -> list[Entry]:
    """Return Azure's, Oculus' and Polly's events: each lasts until the next, the last to its end or 0.1 s."""
    events = json.loads(text)
    if isinstance(events, dict):
        names = ("visemes", "events", "viseme_events", "visemeEvents")
        events = next((events[name] for name in names if name in events), None)
    if events is None:
        raise FormatError("holds no list of visemes or of other timings that are known")
    if events and "type" in events[0]:
        return _parse_polly(events)
    plain = [{key.lower().replace("_", ""): value for key, value in event.items()} for event in events]
    starts = [(time, _shape(event)) for time, event in zip(_times(plain), plain, strict=True)]
    return until_next(starts, float(plain[-1].get("end", starts[-1][0] + 0.1))) if starts else []


def _shape(event: dict[str, Any]) -> int | str:
    what = next(event[key] for key in _SHAPES if key in event)
    return OCULUS[what.removeprefix("viseme_")] if isinstance(what, str) else AZURE[what]


def _times(events: Sequence[dict[str, Any]]) -> list[float]:
    """Return the seconds of events. Azure's offsets are ticks of 100 ns; programs make them ms or seconds."""
    if not events:
        return []
    key = next((key for key in _TIMES if key in events[0]), "time")
    times, unit = [float(event[key]) for event in events], _TIMES[key]
    if key in ("audiooffset", "offset") and len(times) > 1:
        apart = median(after - before for before, after in pairwise(times))
        unit = 1e-7 if apart >= TICKS_APART else 1e-3 if apart >= MS_APART else 1.0
    return [time * unit for time in times]
