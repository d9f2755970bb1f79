"""Films: one in a single call, and one with a drawing of your own on every picture. Needs OpenGL."""

from pathlib import Path

import fba
from fba import player

SIZE = (160, 120)

animation = fba.read(Path(fba.__file__).parent / "samples" / "hello.fap")[50:60]
Path("out").mkdir(exist_ok=True)
player.render(animation, "out/film.mp4", size=SIZE)  # the suffix chooses: .mp4, .gif, .png ...

begin = float(animation.times[0])
with (
    player.Offscreen(animation, SIZE, camera="front") as view,
    player.Recorder("out/marked.mp4", SIZE, rate=animation.rate) as film,
):
    for number, time in enumerate(animation.times):
        pixels = view.frame(float(time))
        pixels[:8, : SIZE[0] * (number + 1) // len(animation), :3] = (255, 160, 0)  # a bar that grows
        film.add(pixels, float(time) - begin)
for path in (Path("out/film.mp4"), Path("out/marked.mp4")):
    print(f"{path}: {path.stat().st_size} bytes")
