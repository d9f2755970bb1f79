"""Make the captured face that comes with fba: talk.c3d, 50 markers on a speaker of hello.fap.

    python tools/make_face_capture.py [FILE]        # default: fba/samples/talk.c3d of this checkout

Nobody was captured. A head with other proportions than the built-in one's performs the FAPs of hello.fap,
after half a second of rest, and moves about; its markers are seen 50 times a second, 0.1 mm off, with gaps.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import fba
from tools.captures import damage
from tools.captures.heads import other_head
from tools.captures.marked_actor import record
from tools.captures.marker_files import c3d
from tools.captures.performances import perform_track

SAMPLES = Path(fba.__file__).parent / "samples"
RATE = 50
SECONDS = 6
NOISE = 1e-4
GAPS = 0.01
"""Share of the time for which a marker is not seen."""


def main(path: Path) -> None:
    """Write the capture."""
    performed = perform_track(fba.read(SAMPLES / "hello.fap"), RATE)[: RATE * SECONDS]
    motion = record(other_head(), performed, RATE).motion
    studio = replace(motion, positions=motion.positions[..., [0, 2, 1]] * (1, -1, 1), up="+z")
    path.write_bytes(c3d(damage.drop(damage.add_noise(studio, NOISE), GAPS), integers=True))
    print(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else SAMPLES / "talk.c3d")
