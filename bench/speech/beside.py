"""Speech as other programs find it, beside `fba.speech`: `python -m bench.speech.beside`, one table.

The same sentences, the same sound, and the shapes of each other program in turn: true phones become the
shapes that its own rules allow for them, and so do the phones of `fba.speech`. Wanted are
rhubarb-lip-sync-wasm in a folder of npm (--rhubarb) and a Python that has openfacefx (--openfacefx).
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import tempfile
import warnings
from collections.abc import Iterable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from bench.speech.spoken import OTHERS, VOICES, Spoken, say
from fba.errors import FbaWarning
from fba.speech import RATE, Phone, find_speech, split_text

Interval = tuple[float, float, str]
"""Start, end (seconds), and a shape."""
FRAME = 0.01
CLOSURE = 0.04
FIRST_SHARE = 0.6
"""Share of a diphthong's first part, in Rhubarb and here."""
RHUBARB_RULES = {
    "AO": "E", "AA": "D", "IY": "B", "UW": "F", "EH": "C", "IH": "B", "UH": "F", "AH": "CD", "AX": "BC",
    "AE": "C", "EY": "C B", "AY": "CD B", "OW": "E F", "AW": "CD E", "OY": "E B", "ER": "EBC", "P": "A",
    "B": "A", "M": "A", "T": "BF", "D": "BF", "K": "BCEFH", "G": "BCEFH", "CH": "BF", "JH": "BF", "F": "G",
    "V": "G", "TH": "BF", "DH": "BF", "S": "BF", "Z": "BF", "SH": "BF", "ZH": "BF", "HH": "CABDEFGHX",
    "N": "BCFH", "NG": "BCEF", "L": "HBEF", "R": "BEF", "Y": "BCF", "W": "F", "SIL": "XA",
}  # fmt: skip
"""Shapes that Rhubarb's rules allow for a phone; two groups for a diphthong. The first is taken for ours."""

_NODE = """
import fs from "fs";
import { createRequire } from "module";
const { Rhubarb } = await import(createRequire(process.cwd() + "/").resolve("rhubarb-lip-sync-wasm"));
const made = [];
for (const { pcm, text } of JSON.parse(fs.readFileSync(process.argv[1]))) {
  const found = await Rhubarb.getLipSync(fs.readFileSync(pcm), text ? { dialogText: text } : {});
  made.push(found.mouthCues.map((cue) => [cue.start, cue.end, cue.value]));
}
fs.writeFileSync(process.argv[2], JSON.stringify(made));
process.exit(0);
"""
_PYTHON = """
import json, sys
import openfacefx
made = []
for job in json.load(open(sys.argv[1])):
    found = openfacefx.naive_segments(job["text"], job["seconds"])
    made.append([[each.start, each.end, each.phoneme] for each in found])
json.dump(made, open(sys.argv[2], "w"))
"""
_SHAPES = "import json, openfacefx.visemes as v; print(json.dumps(v.PHONEME_TO_VISEME))"


def run(program: Sequence[str], folder: str | None, jobs: list[dict[str, Any]]) -> list[list[Interval]]:
    """Return what a program makes of jobs: it reads them from a file, and writes intervals to another."""
    with tempfile.TemporaryDirectory(prefix="fba-") as made:
        paths = [str(Path(made) / name) for name in ("jobs.json", "made.json")]
        Path(paths[0]).write_text(json.dumps(jobs), encoding="utf-8")
        subprocess.run([*program, *paths], cwd=folder, check=True, capture_output=True)
        return [
            [(float(start), float(end), shape) for start, end, shape in each]
            for each in json.loads(Path(paths[1]).read_text(encoding="utf-8"))
        ]


def as_intervals(phones: Iterable[Phone], rules: dict[str, str]) -> list[Interval]:
    """Return the groups of shapes that rules allow for phones, in their order."""
    result: list[Interval] = []
    for phone in phones:
        name = re.sub(r"\d$", "", phone.name.upper())
        parts = rules.get("SIL" if name in ("PAU", "SIL") or name not in rules else name, "").split()
        middle = phone.start + FIRST_SHARE * (phone.end - phone.start)
        bounds = [phone.start, middle, phone.end] if len(parts) == 2 else [phone.start, phone.end]
        result += list(zip(bounds, bounds[1:], parts, strict=False))
    return result


def sample(intervals: Iterable[Interval], seconds: float, rest: str) -> list[str]:
    """Return the shape of each hundredth of a second."""
    result = [rest] * round(seconds / FRAME)
    for start, end, shape in intervals:
        part = slice(round(start / FRAME), min(round(end / FRAME), len(result)))
        result[part] = [shape] * len(result[part])
    return result


def score(found: Sequence[list[Interval]], sentences: Sequence[Spoken], shapes: Shapes) -> str:
    """Return two cells: the share of right frames, and the closures that are found at most 40 ms off."""
    right: list[bool] = []
    closed: list[bool] = []
    for made, each in zip(found, sentences, strict=True):
        seconds = len(each.sound) / RATE
        allowed = sample(shapes.of(each.phones), seconds, shapes.rest)
        shown = sample(made, seconds, shapes.rest)
        right += [shapes.fits(one, several) for one, several in zip(shown, allowed, strict=True)]
        shut = [(start, end) for start, end, shape in made if shapes.fits(shape, shapes.shut)]
        closed += [
            any(start <= phone.end + CLOSURE and end >= phone.start - CLOSURE for start, end in shut)
            for phone in each.phones
            if phone.name.upper() in ("P", "B", "M")
        ]
    return f"{np.mean(right):.1%} | {sum(closed)} of {len(closed)}"


class Shapes:
    """The shapes of a program. rules: of phones; letters: whether a rule names several, each by a letter."""

    def __init__(self, rules: dict[str, str], rest: str, shut: str, *, letters: bool) -> None:
        self._rules, self.rest, self.shut, self._letters = rules, rest, shut, letters

    def of(self, phones: Iterable[Phone]) -> list[Interval]:
        """Return what the rules allow for phones."""
        return as_intervals(phones, self._rules)

    def choose(self, phones: Iterable[Phone]) -> list[Interval]:
        """Return one shape for each phone: the first that its rule names."""
        return [(start, end, what[0] if self._letters else what) for start, end, what in self.of(phones)]

    def fits(self, shown: str, allowed: str) -> bool:
        """Whether a shape is one of those that are allowed."""
        return shown in allowed if self._letters else shown == allowed


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rhubarb", help="folder in which npm installed rhubarb-lip-sync-wasm")
    parser.add_argument("--openfacefx", help="Python that has the package openfacefx")
    parser.add_argument("--sentences", type=int, default=60)
    given = parser.parse_args()
    warnings.simplefilter("ignore", FbaWarning)
    sentences = list(islice(say(OTHERS, VOICES), given.sentences))
    ours = {
        "with the text": [find_speech([each.sound], split_text(each.text)).phones for each in sentences],
        "without": [find_speech([each.sound]).phones for each in sentences],
    }
    print("| shapes | program | text | right | p, b, m shut at most 40 ms off |")
    print("|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="fba-") as folder:
        jobs = _jobs(sentences, folder)
        if given.rhubarb:
            shapes = Shapes(RHUBARB_RULES, "X", "A", letters=True)
            node = ["node", "--input-type=module", "-e", _NODE]
            for text, phones in ours.items():
                wanted = jobs if text == "with the text" else [{**job, "text": ""} for job in jobs]
                found = run(node, given.rhubarb, wanted)
                _print("Rhubarb's nine", text, {"rhubarb-lip-sync-wasm": found}, sentences, shapes, phones)
        if given.openfacefx:
            printed = subprocess.run(
                [given.openfacefx, "-c", _SHAPES], capture_output=True, text=True, check=True
            ).stdout
            table = {name.upper(): shape for name, shape in json.loads(printed).items()}
            shapes = Shapes({"SIL": "sil", "AX": table["AH"], **table}, "sil", "PP", letters=False)
            made = run([given.openfacefx, "-c", _PYTHON], None, jobs)
            found = [shapes.of(Phone(name, start, end) for start, end, name in each) for each in made]
            text = "with the text"
            _print("Oculus' fifteen", text, {"openfacefx": found}, sentences, shapes, ours[text])


def _jobs(sentences: Sequence[Spoken], folder: str) -> list[dict[str, Any]]:
    jobs = []
    for number, each in enumerate(sentences):
        path = Path(folder) / f"{number}.pcm"
        path.write_bytes(each.sound.tobytes())
        jobs.append({"pcm": str(path), "text": each.text, "seconds": len(each.sound) / RATE})
    return jobs


def _print(
    whose: str,
    text: str,
    others: dict[str, list[list[Interval]]],
    sentences: Sequence[Spoken],
    shapes: Shapes,
    ours: Sequence[Sequence[Phone]],
) -> None:
    for program, found in {**others, "fba": [shapes.choose(phones) for phones in ours]}.items():
        print(f"| {whose} | {program} | {text} | {score(found, sentences, shapes)} |", flush=True)


if __name__ == "__main__":
    main()
