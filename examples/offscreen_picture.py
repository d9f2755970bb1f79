"""A strip of pictures of a performance, made without a window.

    python examples/offscreen_picture.py [STRIP.png]

Needs OpenGL (in software, too: Debian's libegl1 and libgl1), but no display.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from PIL import Image

import fba
from fba import player
from fba.formats import merge

SAMPLES = Path(fba.__file__).parent / "samples"
SIZE = (320, 360)
TIMES = (0.0, 2.0, 5.1, 7.6)


def main(path: Path) -> None:
    """Draw the sample performance at a few moments, side by side."""
    face = fba.read(SAMPLES / "hello.fap")
    body = fba.read(SAMPLES / "hello.bvh").resample(face.rate)
    strip = Image.new("RGB", (SIZE[0] * len(TIMES), SIZE[1]))
    with player.Offscreen(merge(face, body), SIZE) as view:
        for number, time in enumerate(TIMES):
            strip.paste(Image.fromarray(view.frame(time)).convert("RGB"), (number * SIZE[0], 0))
    strip.save(path)
    print(f"{path}: {strip.width}x{strip.height}, at {', '.join(f'{time} s' for time in TIMES)}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.gettempdir()) / "hello-strip.png")
