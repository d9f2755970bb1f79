"""Prints whether numba is there, and digests of a stream decoded and encoded again."""

import hashlib
import sys
from pathlib import Path

import fba
from fba.compiled import is_compiled

data = min(map(Path, sys.argv[1:]), key=lambda path: path.stat().st_size).read_bytes()
animation = fba.decode(data)
print("numba:", is_compiled())
print("decoded", len(animation.index), "frames")
for track in (animation.face, animation.body):
    if track is not None:
        print(type(track).__name__, hashlib.sha256(track.values.tobytes() + track.mask.tobytes()).hexdigest())
print("encoded", hashlib.sha256(fba.encode(animation)).hexdigest())
