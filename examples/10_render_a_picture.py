"""Pictures of a performance, side by side, without a window.

Needs OpenGL (in software, too: Debian's libegl1 and libgl1), but no display.
"""

from pathlib import Path

from PIL import Image

import fba
from fba import player
from fba.formats import merge

SAMPLES = Path(fba.__file__).parent / "samples"
WIDTH, HEIGHT = 160, 180
TIMES = (0.0, 2.0, 5.1, 7.6)

face = fba.read(SAMPLES / "hello.fap")
body = fba.read(SAMPLES / "hello.bvh").resample(face.rate)
strip = Image.new("RGB", (WIDTH * len(TIMES), HEIGHT))
with player.Offscreen(merge(face, body), (WIDTH, HEIGHT)) as view:
    for number, time in enumerate(TIMES):
        pixels = view.frame(time)  # uint8 (180, 160, 4), top row first
        strip.paste(Image.fromarray(pixels).convert("RGB"), (number * WIDTH, 0))
Path("out").mkdir(exist_ok=True)
strip.save("out/strip.png")
print(f"out/strip.png: {strip.width}x{strip.height}")
