"""Motion capture (BVH) into an FBA stream, and what the stream says of itself.

    python examples/encode_a_capture.py [CAPTURE.bvh [STREAM.fba]]

Without arguments: the sample that comes with fba (BVH made by a script, not captured), into a folder for
temporary files.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import fba

SAMPLE = Path(fba.__file__).parent / "samples" / "hello.bvh"
BAP_STEPS = "visage"  # finer than the standard's own table; whoever decodes must know


def main(capture: Path, stream: Path) -> None:
    """Encode a capture at 25 frames a second."""
    animation = fba.read(capture).resample(25)
    fba.write(stream, animation, bap_steps=BAP_STEPS)
    info = fba.probe(stream, bap_steps=BAP_STEPS)
    smaller = capture.stat().st_size / stream.stat().st_size
    print(f"{capture.name}: {float(animation.duration):.2f} s, {capture.stat().st_size} bytes")
    print(f"{stream}: {info.size} bytes, {smaller:.0f} times smaller")
    print(f"{info.frames} frames at {info.rate} frames/s, {info.bits_per_second / 1000:.2f} kbit/s")
    if info.body is not None:
        print(f"body: {len(info.body.parameters)} of 296 parameters in {info.body.frames} frames")
    back = fba.read(stream, bap_steps=BAP_STEPS)
    print(f"decoded again: {len(back)} frames")


if __name__ == "__main__":
    given = [Path(argument) for argument in sys.argv[1:]]
    source = given[0] if given else SAMPLE
    default = Path(tempfile.gettempdir()) / f"{source.stem}.fba"
    main(source, given[1] if len(given) > 1 else default)
