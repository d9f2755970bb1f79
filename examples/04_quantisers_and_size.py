"""What coarser quantisers save, and what they cost."""

from pathlib import Path

import numpy as np

import fba
from fba.parameters import fap_numbers

animation = fba.read(Path(fba.__file__).parent / "samples" / "hello.fap")
assert animation.face is not None
original = animation.face.values.astype(np.float64)
columns = fap_numbers()
lips = [columns[name] - 1 for name in ("lower_t_midlip", "raise_b_midlip")]
head = [columns[name] - 1 for name in ("head_pitch", "head_yaw", "head_roll")]

print("Errors of lips in 1/1024 of the distance from mouth to nose, of the head in degrees.")
print("quantiser    bytes  kbit/s  lips: mean   max  head: mean    max")
for quant in (1, 2, 4, 8, 16, 31):
    data = fba.encode(animation, fba.EncoderOptions(fap_quant=quant))
    face = fba.decode(data).face
    assert face is not None
    error = np.abs(face.values - original)
    turned = np.rad2deg(error[:, head] * 1e-5)  # FAPs of angles count 1e-5 rad
    print(
        f"{quant:9} {len(data):8} {8 * len(data) / float(animation.duration) / 1000:7.2f}"
        f" {error[:, lips].mean():11.1f} {error[:, lips].max():5.0f}"
        f" {turned.mean():11.2f} {turned.max():6.2f}"
    )
