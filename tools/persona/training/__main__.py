"""`python -m tools.persona.training -o FILE` trains what recognises expressions: from one seed always the
same."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tools.persona.training.bosphorus import read_database
from tools.persona.training.examples import make_examples
from tools.persona.training.training import train_recogniser

PEOPLE, EACH = 40, 6


def main() -> None:
    """Make examples, train, write the file, and print how well each part is recognised."""
    parser = argparse.ArgumentParser(prog="python -m tools.persona.training", description=main.__doc__)
    parser.add_argument("-o", "--output", type=Path, required=True, help="file to write")
    parser.add_argument("--people", type=int, default=PEOPLE, help="number of synthetic faces")
    parser.add_argument("--each", type=int, default=EACH, help="examples of each class of each of them")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--bosphorus", type=Path, metavar="FOLDER", help="train with scans in Bosphorus's layout"
    )
    given = parser.parse_args()
    if not given.output.parent.is_dir():
        parser.error(f"{given.output}: there is no folder {given.output.parent}; make it first")
    about = f"{given.people} faces, {given.each} examples of each of 35 classes, seed {given.seed}"
    examples = make_examples(given.people, given.each, given.seed)
    if given.bosphorus is not None:
        examples, about = read_database(given.bosphorus), f"scans of {given.bosphorus.name}"
    recogniser = train_recogniser(examples, seed=given.seed, about=about)
    recogniser.save(given.output)
    lines = []
    for part, component in recogniser.components.items():
        lines.append(
            f"{part:10} {len(component.classes):2} classes, {100 * component.share:.1f} % of other people's "
            f"right, {len(component.axes)} components have {100 * component.kept_variance:.1f} %"
        )
    lines.append(f"{given.output}: {given.output.stat().st_size} bytes")
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
