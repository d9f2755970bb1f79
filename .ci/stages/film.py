"""A film of plain pictures with sound, written and read again: it needs no OpenGL."""

import array
import math
import wave

import av
import numpy as np

from fba_player.export._recorder import Recorder

RATE = 44100
with wave.open("tone.wav", "wb") as file:
    file.setnchannels(1)
    file.setsampwidth(2)
    file.setframerate(RATE)
    file.writeframes(array.array("h", (int(9000 * math.sin(t / 16)) for t in range(RATE))).tobytes())
with Recorder("tone.mp4", (64, 48), rate=25, audio="tone.wav") as film:
    for brightness in range(0, 250, 10):
        film.add(np.full((48, 64, 4), brightness, dtype=np.uint8))
with av.open("tone.mp4") as film:
    shown = [frame.to_ndarray(format="rgb24").mean() for frame in film.decode(video=0)]
with av.open("tone.mp4") as film:
    heard = np.concatenate([frame.to_ndarray()[0] for frame in film.decode(audio=0)])
print(f"PyAV {av.__version__}: {len(shown)} pictures, {len(heard) / RATE:.3f} s of sound")
assert np.allclose(shown, range(0, 250, 10), atol=5), shown
assert abs(len(heard) - RATE) < 3000
assert abs(heard.std() - 9000 / 32768 / 2**0.5) < 0.02
