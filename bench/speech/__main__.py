"""How well speech is found and shown: `python -m bench.speech`, tables beside the goals.

Programs speak sentences and say when each phone begins. Measured are the phones that `fba.speech` finds in
the sound, the visemes, and what is left of them in streams: of the sentences on which its thresholds were
chosen, by five voices in turn, and of others, by six.
"""

from __future__ import annotations

import argparse
import warnings
from itertools import islice, product
from statistics import fmean

import numpy as np

from bench.speech.measures import CLOSURE, add_noise, measure, measure_coding, telephone
from bench.speech.spoken import FLITE, KNOWN, OTHERS, VOICES, Spoken, say
from fba.errors import FbaWarning
from fba.speech import Coding

GOALS: dict[Coding, int] = {"visemes": 200, "faps": 500}
"""Bits in a second."""
COUNTS = (1, 2, 4, 12, 60)
"""Sentences in a stream."""


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sentences", type=int, default=60, help="how many of each set to measure")
    limit = parser.parse_args().sentences
    warnings.simplefilter("ignore", FbaWarning)
    sets = {
        "known": list(islice(say(KNOWN, FLITE), limit)),
        "others": list(islice(say(OTHERS, VOICES), limit)),
    }
    print("| sentences | sound | phone starts within 30 ms | viseme right with text | without | refused "
          "| lips shut at p, b, m, at most 40 ms off |")  # fmt: skip
    print("|---|---|---|---|---|---|---|")
    print("| (goal) | | 90 % | 85 % | 72 % | | all |")
    kinds = {"as spoken": lambda sound: sound, "telephone": telephone, "noise at 10 dB": add_noise}
    for kind, change in kinds.items():
        for name, sentences in sets.items():
            counts = measure(sentences, change)
            starts, with_text, without = map(
                np.concatenate, (counts.starts, counts.with_text, counts.without)
            )
            print(
                f"| {name} | {kind} | {(starts <= 0.03).mean():.1%} | {with_text.mean():.1%} "
                f"| {without.mean():.1%} | {counts.failed} | {_closed(counts.closures)} |",
                flush=True,
            )
    print_codings(sets)


def print_codings(sets: dict[str, list[Spoken]]) -> None:
    """Print what streams keep, of one sentence to all of them."""
    print("\n| coding | goal, bit/s | sentences | in a stream | seconds | bit/s | within the goal | left out "
          "| viseme right | lips, mean mm | 95 % within, mm | lips shut |")  # fmt: skip
    print(f"|{'---|' * 12}")
    for (coding, goal), (name, sentences) in product(GOALS.items(), sets.items()):
        for count in COUNTS:
            parts = [sentences[at : at + count] for at in range(0, len(sentences), count)]
            kept = [measure_coding(coding, part) for part in parts]
            bits, left_out, right, mean, largest = (
                fmean(getattr(each, field) for each in kept)
                for field in ("bits", "left_out", "right", "mean", "largest")
            )
            within = sum(each.bits <= goal for each in kept)
            print(
                f"| {coding} | {goal} | {name} | {count} | {fmean(each.seconds for each in kept):.1f} "
                f"| {bits:.0f} | {within} of {len(kept)} | {left_out:.0%} "
                f"| {f'{right:.1%}' if coding == 'visemes' else ''} | {mean:.2f} | {largest:.1f} "
                f"| {_closed([error for each in kept for error in each.closures])} |",
                flush=True,
            )


def _closed(errors: list[float]) -> str:
    return f"{sum(error <= CLOSURE for error in errors)} of {len(errors)}"


if __name__ == "__main__":
    main()
