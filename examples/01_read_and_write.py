"""Read a file, look at its frames, cut a part out, and write that in another format."""

from pathlib import Path

import fba

SAMPLES = Path(fba.__file__).parent / "samples"  # hello.fap and hello.bvh come with fba

animation = fba.read(SAMPLES / "hello.fap")  # the format is recognised from the content
print(animation)
print(f"{len(animation)} frames at {animation.rate} frames/s, {float(animation.duration):.2f} s")

assert animation.face is not None  # there is no body in this file
print("FAPs that are sent:", int(animation.face.mask.any(axis=0).sum()))

first_second = animation[:25]  # slices are animations
Path("out").mkdir(exist_ok=True)
fba.write("out/first_second.fba", first_second)
fba.write("out/first_second.fap", first_second)
for path in (Path("out/first_second.fba"), Path("out/first_second.fap")):
    print(f"{path}: {path.stat().st_size} bytes, {len(fba.read(path))} frames")
