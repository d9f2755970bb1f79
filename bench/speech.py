"""How well speech is found and shown: `python -m bench.speech`, a table beside the goals.

flite speaks sentences and says when each phone begins. Measured are the phones that `fba.speech` finds in the
sound, the visemes, and what is left of them in streams.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Array, Float64, Int16, Int64
from fba.audio import read_mono
from fba.codec import decode
from fba.errors import FbaError, FbaWarning
from fba.face import Deformer, FaceModel, resolve
from fba.planning import encode
from fba.speech import (
    RATE,
    Coding,
    Phone,
    Shape,
    Speech,
    encoder_options,
    find_shapes,
    find_speech,
    perform,
    read_shapes,
    split_text,
)

VOICES = ("slt", "rms", "awb", "kal16", "kal")
"""Voices of flite: a woman, men, one of them a Scot, and an old voice at 16 and at 8 kHz."""
SENTENCES = (
    "Bob put five thin maps by the moon.",
    "My mother bought a purple umbrella from the shop.",
    "The food was too good to move away from.",
    "Five brave fishermen found a very large fish.",
    "She sells small shells, but he chose a cheap ship.",
    "Why would you want to go home before noon?",
    "Peter bumped his elbow on the lamp post.",
    "We measured the thickness of both leather gloves.",
    "Yesterday the train arrived three hours late.",
    "Please open the window, the room is warm.",
    "I think that the weather will change on Monday.",
    "Who broke the blue cup, and where is the key?",
)
FRAME = 0.01
"""Seconds between the moments at which visemes are compared."""


def speak(voice: str, text: str, path: Path) -> list[Phone]:
    """Let flite speak a text into a WAV file; return its phones."""
    program = shutil.which("flite")
    assert program is not None
    words = [program, "-voice", voice, "-t", text, "-psdur", "-o", str(path)]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()
    phones, start = [], 0.0
    for each in said:
        name, _, end = each.rpartition(":")
        phones.append(Phone(name, start, float(end)))
        start = float(end)
    return phones


def visemes(shapes: tuple[Shape, ...], seconds: float) -> Int64:
    """Return the viseme of each hundredth of a second."""
    result = np.zeros(round(seconds / FRAME), dtype=np.int64)
    for each in shapes:
        result[round(each.start / FRAME) : round(each.end / FRAME)] = each.viseme
    return result


def start_errors(found: Speech, truth: list[Phone]) -> Float64:
    """Return by how many seconds the nearest start of a found phone misses each true one."""
    starts = np.array([each.start for each in found.phones if each.name != "SIL"])
    true = np.array([each.start for each in truth if each.name != "pau"])
    return np.abs(starts[None] - true[:, None]).min(axis=1) if len(starts) else np.full(len(true), np.inf)


@dataclass
class Counts:
    """Sums over sentences."""

    starts: list[Float64]
    with_text: list[Array]
    without: list[Array]
    failed: int = 0


def measure(change: Callable[[Int16], Int16], limit: int) -> Counts:
    """Return what is found in the sentences of all voices, changed before, the first `limit` of them."""
    counts = Counts([], [], [])
    for text, sound, truth in _spoken(limit):
        changed = change(sound)
        seconds = len(sound) / RATE
        true = visemes(find_shapes(truth), seconds)
        try:
            found = find_speech([changed], split_text(text))
        except FbaError:
            counts.failed += 1
            continue
        counts.starts.append(start_errors(found, truth))
        counts.with_text.append(visemes(find_shapes(found.phones), seconds) == true)
        free = find_speech([changed])
        counts.without.append(visemes(find_shapes(free.phones), seconds) == true)
    return counts


def _spoken(limit: int) -> Iterator[tuple[str, Int16, list[Phone]]]:
    pairs = [(voice, text) for text in SENTENCES for voice in VOICES][:limit]
    with tempfile.TemporaryDirectory(prefix="fba-") as folder:
        for voice, text in pairs:
            path = Path(folder) / "speech.wav"
            truth = speak(voice, text, path)
            yield text, np.concatenate(list(read_mono(path, RATE))), truth


def add_noise(sound: Int16) -> Int16:
    """Return a sound with white noise 10 dB below it."""
    level = float(np.sqrt((sound.astype(np.float64) ** 2).mean())) / 10**0.5
    noisy = sound + np.random.default_rng(7).normal(0, level, len(sound))
    return np.asarray(np.clip(noisy, -32768, 32767), dtype=np.int16)


def telephone(sound: Int16) -> Int16:
    """Return a sound as of 8 kHz, 300 to 3400 Hz."""
    from scipy.signal import butter, sosfiltfilt

    band = butter(4, (300, 3400), "bandpass", fs=RATE, output="sos")
    return np.asarray(np.clip(sosfiltfilt(band, sound.astype(np.float64)), -32768, 32767), dtype=np.int16)


@dataclass(frozen=True)
class Coded:
    """A stream of speech: bits in a second, share of right visemes, and errors of the lips in mm."""

    bits: float
    right: float
    mean: float
    largest: float


def measure_coding(coding: Coding, limit: int) -> Coded:
    """Return what a stream keeps of the sentences, one after another, of their true phones."""
    phones: list[Phone] = []
    end = 0.0
    for _, sound, truth in _spoken(limit):
        phones += [Phone(each.name, each.start + end, each.end + end) for each in truth]
        end += len(sound) / RATE
    speech = Speech(tuple(phones), (), end)
    made = perform(speech, coding=coding, life=0)
    data = encode(made, encoder_options(coding))
    decoded = decode(data)
    full = perform(speech, coding=coding, life=0, rate=Fraction(100))
    mean, largest = _lip_errors(decoded, full)
    true = visemes(find_shapes(phones), end)
    right = float((visemes(read_shapes(decoded), end)[: len(true)] == true).mean())
    return Coded(8 * len(data) / end, right, mean, largest)


def _lip_errors(decoded: Animation, full: Animation) -> tuple[float, float]:
    """Return the mean and the 95th percentile of errors at lips, in mm, ten times a second."""
    model = FaceModel.default()
    deformer = Deformer(model)
    moments = np.arange(0, int(full.index[-1]) - 10, 10)
    shown = [_at(each, moments / float(full.rate), model) for each in (decoded, full)]
    first, second = (np.stack([deformer(row) for row in faps]) for faps in shown)
    lips = np.linalg.norm(second - deformer(np.zeros(68, np.float32)), axis=-1).max(axis=0) > 0.004
    errors = 1000 * np.linalg.norm(first - second, axis=-1)[:, lips]
    return float(errors.mean()), float(np.percentile(errors, 95))


def _at(animation: Animation, times: Float64, model: FaceModel) -> Any:
    """Return the FAPs that a player shows at times: linear between the frames."""
    assert animation.face is not None
    faps = resolve(animation.face, model)
    frames = animation.index / float(animation.rate)
    return np.stack([np.interp(times, frames, column) for column in faps.T], axis=1).astype(np.float32)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sentences", type=int, default=60, help="how many of the 60 to measure")
    limit = parser.parse_args().sentences
    warnings.simplefilter("ignore", FbaWarning)
    print("| sound | phone starts within 30 ms | viseme right with text | without | texts refused |")
    print("|---|---|---|---|---|")
    print("| (goal) | 90 % | 85 % | 72 % | |")
    kinds = {"as spoken": lambda sound: sound, "noise at 10 dB": add_noise, "telephone": telephone}
    for name, change in kinds.items():
        counts = measure(change, limit)
        starts, with_text, without = map(np.concatenate, (counts.starts, counts.with_text, counts.without))
        print(
            f"| {name} | {(starts <= 0.03).mean():.1%} | {with_text.mean():.1%} | {without.mean():.1%} "
            f"| {counts.failed} |"
        )
    print("\n| coding | goal, bit/s | bit/s | viseme right | lips, mean mm | 95 % within, mm |")
    print("|---|---|---|---|---|---|")
    codings: tuple[tuple[Coding, int], ...] = (("visemes", 200), ("faps", 500))
    for coding, goal in codings:
        kept = measure_coding(coding, limit)
        right = f"{kept.right:.1%}" if coding == "visemes" else "-"
        print(f"| {coding} | {goal} | {kept.bits:.0f} | {right} | {kept.mean:.2f} | {kept.largest:.2f} |")


if __name__ == "__main__":
    main()
