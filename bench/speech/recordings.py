"""Recordings beside streams coded from them by others: `python -m bench.speech.recordings FOLDER`, a table.

FOLDER holds pairs of a WAV file and a stream whose name ends with that of the sound. Printed are correlations
of jaw and lips, of the stream as players show it with what `fba.speech` makes of the sound without its text;
the delay at which visemes and sounds belong together best; and what each follows of the loudness.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import fba
from fba.arrays import Float64, Int64
from fba.audio import read_mono
from fba.errors import FbaWarning
from fba.face import FaceModel, resolve
from fba.parameters import fap_numbers
from fba.speech import RATE, find_shapes, find_speech, perform

DELAYS = np.arange(-10, 11) / 25
"""Seconds by which the sound is moved against the stream."""
QUIET = -60.0
"""dB below full scale that count as silence."""


@dataclass(frozen=True)
class Pair:
    """Frames of a stream beside its sound. theirs, ours: (T, 3), open jaw, gap and width of the lips.

    shares: of the visemes that are sent (T, 15). heard: the viseme in each hundredth of a second of sound.
    loudness: dB, of the same.
    """

    name: str
    rate: float
    theirs: Float64
    ours: Float64
    shares: Float64
    heard: Int64
    loudness: Float64


def read_pair(sound: Path, stream: Path) -> Pair:
    """Return a stream and what is found in its sound."""
    coded = fba.read(stream)
    assert coded.face is not None
    samples = np.concatenate(list(read_mono(sound, RATE)))
    found = find_speech([samples])
    made = perform(found, life=0)
    model = FaceModel.default()
    frames = coded.index / float(coded.rate)
    own = np.stack([np.interp(frames, made.index / 25, each) for each in _mouth(made, model).T], axis=1)
    heard = np.zeros(round(found.seconds * 100) + 1, dtype=np.int64)
    for shape in find_shapes(found.phones):
        heard[round(shape.start * 100) : round(shape.end * 100)] = shape.viseme
    steps = samples[: len(samples) // 160 * 160].reshape(-1, 160).astype(np.float64)
    loudness = 10 * np.log10(np.maximum((steps**2).mean(axis=1) / 2.0**30, 10 ** (QUIET / 10)))
    shares = np.zeros((len(coded), 15))
    for row, (first, second, blend, _) in zip(shares, coded.face.viseme, strict=True):
        row[first] += blend / 63
        row[second] += 1 - blend / 63
    theirs = _mouth(coded, model).astype(np.float64)
    return Pair(sound.stem, float(coded.rate), theirs, own, shares, heard, loudness)


def _mouth(animation: fba.Animation, model: FaceModel) -> Float64:
    assert animation.face is not None
    faps = resolve(animation.face, model).astype(np.float64)
    jaw, upper, lower, corner = (
        faps[:, fap_numbers()[name] - 1]
        for name in ("open_jaw", "lower_t_midlip", "raise_b_midlip", "stretch_l_cornerlip")
    )
    return np.stack([jaw, -upper - lower, corner], axis=1)


def correlate(one: Float64, other: Float64) -> float:
    """Return the correlation of two curves."""
    return float(np.corrcoef(one, other)[0, 1])


def share_of_knowledge(pairs: Sequence[Pair], delay: float) -> float:
    """Return how many bits the visemes that are sent say of those that are heard `delay` seconds later."""
    counts = np.zeros((15, 15))
    for pair in pairs:
        steps = np.rint((np.arange(len(pair.shares)) / pair.rate + delay) * 100).astype(int) + 2
        inside = (steps >= 0) & (steps < len(pair.heard))
        for viseme in range(15):
            counts[:, viseme] += pair.shares[inside][pair.heard[steps[inside]] == viseme].sum(axis=0)
    joint = counts / counts.sum()
    apart = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0, keepdims=True)
    return float((joint[joint > 0] * np.log2(joint[joint > 0] / apart[joint > 0])).sum())


def learn_mouth(others: Sequence[Pair], pair: Pair) -> Float64:
    """Return the mouth (T, 3) of a stream if each number meant what is heard where others send it."""
    shares = np.concatenate([each.shares for each in others])
    mouths = np.concatenate([each.ours for each in others])
    prior = 5 * np.eye(15)  # frames by which rare numbers are drawn to the mean
    table = np.linalg.solve(shares.T @ shares + prior, shares.T @ mouths + 5 * mouths.mean(axis=0))
    return np.asarray(pair.shares @ table)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sounds", type=Path, help="folder of WAV files")
    parser.add_argument("streams", type=Path, help="folder of streams")
    given = parser.parse_args()
    warnings.simplefilter("ignore", FbaWarning)
    pairs = [
        read_pair(sound, stream)
        for sound in sorted(given.sounds.glob("*.wav"))
        for stream in given.streams.glob(f"*{sound.stem}.fba")
    ]
    print("| recording | s | jaw | lips apart | lips wide | jaw, numbers learned from the others |")
    print("|---|---|---|---|---|---|")
    learned = []
    for pair in pairs:
        learned.append(learn_mouth([each for each in pairs if each is not pair], pair))
        cells = [f"{correlate(pair.theirs[:, at], pair.ours[:, at]):.2f}" for at in range(3)]
        cells.append(f"{correlate(learned[-1][:, 0], pair.ours[:, 0]):.2f}")
        print(f"| {pair.name} | {len(pair.theirs) / pair.rate:.1f} | {' | '.join(cells)} |")
    theirs, ours = (np.concatenate([getattr(pair, name) for pair in pairs]) for name in ("theirs", "ours"))
    cells = [f"{correlate(theirs[:, at], ours[:, at]):.2f}" for at in range(3)]
    cells.append(f"{correlate(np.concatenate(learned)[:, 0], ours[:, 0]):.2f}")
    print(f"| all | {len(ours) / pairs[0].rate:.1f} | {' | '.join(cells)} |")
    sent = np.concatenate([pair.shares for pair in pairs]).mean(axis=0)
    heard = np.bincount(np.concatenate([pair.heard for pair in pairs]), minlength=15)
    print("\nshare of each viseme, sent:", " ".join(f"{each:.1%}" for each in sent))
    print("share of each viseme, heard:", " ".join(f"{each:.1%}" for each in heard / heard.sum()))
    bits = [share_of_knowledge(pairs, delay) for delay in DELAYS]
    print("bits that sent visemes say of heard ones, by delay in ms:")
    print(" ".join(f"{1000 * delay:+.0f}: {each:.2f}" for delay, each in zip(DELAYS, bits, strict=True)))
    loud = np.concatenate([_loudness(pair) for pair in pairs])
    print(
        f"jaw and loudness: sent {correlate(theirs[:, 0], loud):.2f}, made {correlate(ours[:, 0], loud):.2f}"
    )


def _loudness(pair: Pair) -> Float64:
    times = np.arange(len(pair.theirs)) / pair.rate
    return np.interp(times, np.arange(len(pair.loudness)) / 100, pair.loudness)


if __name__ == "__main__":
    main()
