"""A process that fuzzes one target, guided by coverage. Arguments: its name, its corpus, those of libFuzzer.

Everything of ours is imported in `main`: only modules that atheris sees being imported count what is reached.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import atheris


def main(arguments: Sequence[str]) -> None:
    """Fuzz until libFuzzer ends the process."""
    with atheris.instrument_imports(include=["fba", "fba_conformance", "tools.fuzz"]):
        from tools.fuzz._engine import Check
        from tools.fuzz.targets import find_target

        # Loops are not compiled here, so only libFuzzer's own limit of time holds.
        check = Check(find_target(arguments[0]), Path(tempfile.mkdtemp(prefix="fba-fuzz-")), math.inf)

    def feed(data: bytes) -> None:
        check(data)

    atheris.Setup(["fuzz", *arguments[1:]], feed)
    atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv[1:])
