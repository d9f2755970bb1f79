"""By how much two performances differ: a stream against what it was made from."""

from pathlib import Path

import fba
from fba import player

original = fba.read(Path(fba.__file__).parent / "samples" / "hello.fap")
coarse = fba.decode(fba.encode(original, fba.EncoderOptions(fap_quant=8)))

scene = player.CompareScene([player.Scene(original), player.Scene(coarse)])
found = scene.differences()
print(f"{len(found.times)} times compared")
for one in found.largest(3):
    print(f"{one.kind} {one.number} {one.name}: {one.most:g} {one.unit} at {one.time:.2f} s")
# player.play(scene) shows both side by side; `fba play A B --compare` does the same.
