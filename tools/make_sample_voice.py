"""Let flite speak what the sample says: fba/samples/hello.wav, and its phones for the performance's mouth.

    python tools/make_sample_voice.py

Wanted only to change the text or the voice: both files are kept. The voice is slt of flite, made from the
recordings of CMU ARCTIC; both may be used, changed and shipped freely, also in products, if the copyright of
Carnegie Mellon University is named, as fba/samples/NOTICE.txt does.
"""

from __future__ import annotations

import csv
import shutil
import subprocess
import sys
import tempfile
import wave
from pathlib import Path

import numpy as np

VOICE = "slt"
SAID = (("Hello!", 1.20), ("All of me, in a few kilobits a second.", 3.83))
"""Texts, and when their first sounds begin in the performance, seconds."""
FADE = 0.01
"""Seconds over which a text's sound begins and ends."""
LOUDEST = 0.8
"""Of full scale."""
ROOT = Path(__file__).parents[1]


def main() -> None:
    """Write both files."""
    program = shutil.which("flite")
    if program is None:
        sys.exit("flite is not installed; the sample's voice is spoken by it")
    phones: list[tuple[str, float, float]] = []
    sound, rate = np.zeros(0), 0
    for text, begin in SAID:
        said, samples, rate = speak(program, text)
        first, last = said[0][1], said[-1][2]
        part = samples[round(first * rate) : round(last * rate)].astype(float)
        fade = np.minimum(np.arange(len(part)), np.arange(len(part))[::-1]) / (FADE * rate)
        start = round(begin * rate)
        longer = np.zeros(start + len(part))
        longer[: len(sound)] = sound
        longer[start:] += part * np.minimum(fade, 1.0)
        sound = longer
        phones += [(name, at - first + begin, end - first + begin) for name, at, end in said]
    with wave.open(str(ROOT / "fba" / "samples" / "hello.wav"), "wb") as file:
        file.setparams((1, 2, rate, 0, "NONE", ""))
        file.writeframes(np.rint(sound * (LOUDEST * 32767 / np.abs(sound).max())).astype("<i2").tobytes())
    table = ROOT / "tools" / "performance" / "phones.csv"
    with table.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(("phone", "start", "end"))
        rows.writerows((name, f"{start:.3f}", f"{end:.3f}") for name, start, end in phones)


def speak(program: str, text: str) -> tuple[list[tuple[str, float, float]], np.ndarray, int]:
    """Return the phones of a text without the silence around it, its samples, and their rate."""
    with tempfile.TemporaryDirectory(prefix="fba-") as folder:
        path = Path(folder) / "said.wav"
        done = subprocess.run(
            [program, "-voice", VOICE, "-t", text, "-psdur", "-o", str(path)],
            capture_output=True,
            text=True,
            check=True,
        )
        with wave.open(str(path)) as file:
            samples = np.frombuffer(file.readframes(file.getnframes()), dtype="<i2")
            rate = file.getframerate()
    phones, start = [], 0.0
    for each in done.stdout.split():
        name, _, end = each.rpartition(":")
        phones.append((name, start, float(end)))
        start = float(end)
    return phones[1:-1], samples, rate


if __name__ == "__main__":
    main()
