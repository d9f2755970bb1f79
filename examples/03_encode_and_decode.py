"""Bytes instead of files, and the options of the encoder."""

from pathlib import Path

import numpy as np

import fba

animation = fba.read(Path(fba.__file__).parent / "samples" / "hello.fap")
assert animation.face is not None

fine = fba.encode(animation)  # quantiser 1: the standard's finest steps
print(f"quantiser 1: {len(fine)} bytes")
assert fba.encode(fba.decode(fine)) == fine  # nothing more is lost when it is coded again

options = fba.EncoderOptions(
    fap_quant=4,  # four times the standard's steps
    intra_period=2,  # a frame where a decoder can begin, every 2 s
    start_codes=True,  # a mark before each of them, to find it again after damage
)
data = fba.encode(animation, options)
decoded = fba.decode(data).face
assert decoded is not None
print(f"quantiser 4: {len(data)} bytes")
print(f"largest error: {np.abs(decoded.values - animation.face.values).max()} units")
