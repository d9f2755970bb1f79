"""Fits the weights by which a spectrum shows visemes: `python tools/fit_spectrum.py [--write]`.

Voices of flite speak random words of the dictionary in pocketsphinx, as they are, in noise, and as over a
telephone; flite says when each phone is. A linear discriminant with one covariance for all visemes separates
them. Prints which part of hundredths of a second is right in the sentences of `bench.speech.spoken`, spoken
by each voice, with weights of the other voices. --write replaces `fba/speech/spectrum.csv`.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from bench.speech.measures import add_noise, telephone, visemes  # noqa: E402
from bench.speech.spoken import FLITE, KNOWN, speak  # noqa: E402
from fba.arrays import Float64, Int16, Int64  # noqa: E402
from fba.audio import read_mono  # noqa: E402
from fba.speech import RATE, Phone, find_shapes  # noqa: E402
from fba.speech._spectrum import (  # noqa: E402
    BANDS,
    OFFSETS,
    STEP,
    WINDOW,
    Spectrum,
    Weights,
    gather,
    measure_bands,
)

TABLE = ROOT / "fba/speech/spectrum.csv"
TEXTS, WORDS = 60, 7
"""Texts that each voice speaks, and words of each."""
REST = 0.15
"""Seconds of silence before and after a text."""
CHANGES = (lambda sound: sound, add_noise, telephone)
RIDGE = 1.0
"""dB squared added to the variances."""


def texts() -> list[str]:
    """Return texts of random words."""
    from pocketsphinx import get_model_path

    lines = Path(get_model_path("en-us/cmudict-en-us.dict")).read_text(encoding="utf-8").splitlines()
    words = [word for word in (line.split()[0] for line in lines) if word.isalpha() and 2 <= len(word) <= 9]
    rng = np.random.default_rng(5)
    return [" ".join(rng.choice(words, WORDS)) + "." for _ in range(TEXTS)]


def spoken(voice: str, said: list[str]) -> Iterator[tuple[Int16, Int64]]:
    """Yield sounds, and the viseme of each of their hundredths of a second."""
    silence = np.zeros(round(REST * RATE), dtype=np.int16)
    with tempfile.TemporaryDirectory(prefix="fba-") as folder:
        path = Path(folder) / "speech.wav"
        for text in said:
            phones = [
                Phone(each.name, each.start + REST, each.end + REST) for each in speak(voice, text, path)
            ]
            sound = np.concatenate([silence, *read_mono(path, RATE), silence])
            true = visemes(find_shapes(phones), len(sound) / RATE)
            yield sound, np.pad(true, (0, max(len(sound) // STEP - len(true), 0)))[: len(sound) // STEP]


def rows(sound: Int16, true: Int64) -> tuple[Float64, Int64, Float64]:
    """Return what is weighed of a sound, the visemes, and the mean level of its speech."""
    levels = measure_bands(np.pad(sound, ((WINDOW - STEP) // 2, (WINDOW + STEP) // 2)))[: len(true)]
    usual = levels[true > 0].mean(axis=0)
    rim = OFFSETS[-1]
    return gather(levels - usual), true[rim : len(levels) - rim], usual


def learn(parts: list[tuple[Float64, Int64, Float64]]) -> Weights:
    """Return weights, constants, and the usual speaker of sounds as of `rows`."""
    weighed, true, usual = zip(*parts, strict=True)
    return *fit(np.concatenate(weighed), np.concatenate(true)), np.mean(usual, axis=0)


def fit(weighed: Float64, true: Int64) -> tuple[Float64, Float64]:
    """Return weights (offsets x bands, 15) and constants (15,)."""
    means = np.stack([weighed[true == viseme].mean(axis=0) for viseme in range(15)])
    away = weighed - means[true]
    variance = away.T @ away / len(away) + RIDGE * np.eye(weighed.shape[1])
    weights = np.linalg.solve(variance, means.T)
    shares = np.bincount(true, minlength=15) / len(true)
    return weights, np.log(shares) - 0.5 * (means.T * weights).sum(axis=0)


def write(table: Weights) -> None:
    """Write the table that `fba.speech` reads."""
    weights, constants, usual = table
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["offset", "band", "usual", *range(15)])
        for row, values in enumerate(weights):
            offset, band = OFFSETS[row // BANDS], row % BANDS
            writer.writerow([offset, band, f"{usual[band]:.1f}", *(f"{value:.4f}" for value in values)])
        writer.writerow(["", "", "", *(f"{value:.3f}" for value in constants)])


def main() -> None:
    """Fit, print, and write if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"replace {TABLE.name}")
    arguments = parser.parse_args()
    said = texts()
    found: dict[str, list[tuple[Float64, Int64, Float64]]] = {}
    for voice in FLITE:
        found[voice] = []
        for sound, true in spoken(voice, said):
            for change in CHANGES:
                found[voice].append(rows(change(sound), true))

    tail = np.zeros(RATE // 4, dtype=np.int16)
    for voice in FLITE:
        table = learn([part for other in FLITE if other != voice for part in found[other]])
        shares = []
        for change in CHANGES:
            sounds, visemes_said = zip(*spoken(voice, list(KNOWN)), strict=True)
            spectrum, true = Spectrum(table), np.concatenate(visemes_said)
            whole = np.concatenate([*(change(sound[: len(sound) // STEP * STEP]) for sound in sounds), tail])
            judged = [
                each for at in range(0, len(whole), STEP) for each in spectrum.push(whole[at : at + STEP])
            ]
            shares.append((visemes(find_shapes(judged), len(true) / 100)[: len(true)] == true).mean())
        print(voice, *(f"{share:.1%}" for share in shares))
    if arguments.write:
        write(learn([part for parts in found.values() for part in parts]))


if __name__ == "__main__":
    main()
