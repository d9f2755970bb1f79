"""Make the performance that comes with fba and that `fba demo` shows: hello.bvh (body) and hello.fap (face).

    python tools/make_samples.py [FOLDER]        # default: fba/samples of this checkout

Someone notices us, waves, says "Hello! All of me, in a few kilobits a second", and bows. Nothing of it
was captured: the keys are tables in tools/performance, the rest is computed, and every machine makes
the same bytes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import fba
from performance import body, bvh, face

NAME = "hello"


def main(folder: Path) -> None:
    """Write both files into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    motion = body.animate()
    performance = face.animate(motion, NAME)
    (folder / f"{NAME}.bvh").write_bytes(bvh.format_bvh(motion.local, motion.root).encode("ascii"))
    fba.write(folder / f"{NAME}.fap", performance)
    for suffix in ("bvh", "fap"):
        path = folder / f"{NAME}.{suffix}"
        print(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "fba" / "samples")
