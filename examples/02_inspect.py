"""What is in a stream: parameters, frames and bits, without decoding its values into an animation."""

from pathlib import Path

import fba

SAMPLES = Path(fba.__file__).parent / "samples"

Path("out").mkdir(exist_ok=True)
fba.write("out/hello.fba", fba.read(SAMPLES / "hello.fap"))

info = fba.probe("out/hello.fba")
print(f"{info.size} bytes, {info.frames} frames at {info.rate} frames/s")
print(f"{info.bits_per_second / 1000:.2f} kbit/s")
assert info.face is not None
print(f"face: {len(info.face.parameters)} FAPs in {info.face.frames} frames")
print("body:", info.body)

try:  # every error that fba raises on purpose is an FbaError
    fba.probe(b"this is no stream")
except fba.FbaError as error:
    print(f"{type(error).__name__}: {error}")
