"""Learns what feature points look like: python -m tools.photos.learn_features [COUNT] [SEED]

Renders faces (a minute for ten without a graphics card) and writes fba/face/fitting/front_features.npz.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import fba
from fba.face.fitting._features import learn
from tools.photos.rendered_faces import rendered_faces

OUTPUT = Path(fba.__file__).parent / "face/fitting/front_features.npz"


def main(count: int = 70, seed: int = 1) -> None:
    made = list(rendered_faces(count, seed))
    arrays = learn([pixels for pixels, _ in made], np.array([points for _, points in made]))
    np.savez_compressed(OUTPUT, **arrays)
    print(f"{OUTPUT}: {OUTPUT.stat().st_size} bytes from {count} faces")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
