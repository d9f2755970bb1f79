"""What coarser quantisers save, and what they cost: a table over fap_quant.

    python examples/compare_quantisers.py [FACE.fap]

Errors are of low-level FAPs: lips in fractions of 1/1024 of the mouth-nose distance, the head in degrees.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import fba
from fba.parameters import fap_numbers

SAMPLE = Path(fba.__file__).parent / "samples" / "hello.fap"
QUANTISERS = (1, 2, 4, 8, 16, 31)
LIPS = ("lower_t_midlip", "raise_b_midlip")
HEAD = ("head_pitch", "head_yaw", "head_roll")


def main(path: Path) -> None:
    """Encode a face with every quantiser of a few and compare what comes back."""
    animation = fba.read(path)
    if animation.face is None:
        raise SystemExit(f"{path} has no face")
    original = animation.face.values.astype(np.float64)
    lips, head = ([fap_numbers()[name] - 1 for name in names] for names in (LIPS, HEAD))
    print(f"{path.name}: {len(animation)} frames")
    print("fap_quant    bytes  kbit/s  lips: mean   max  head: mean    max")
    for quant in QUANTISERS:
        data = fba.encode(animation, fba.EncoderOptions(fap_quant=quant))
        face = fba.decode(data).face
        assert face is not None
        error = np.abs(face.values - original)
        turned = np.rad2deg(error[:, head] * 1e-5)
        print(
            f"{quant:9} {len(data):8} {8 * len(data) / float(animation.duration) / 1000:7.2f}"
            f" {error[:, lips].mean():11.1f} {error[:, lips].max():5.0f}"
            f" {turned.mean():11.2f} {turned.max():6.2f}"
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else SAMPLE)
