"""An animation from NumPy arrays: a jaw that opens and closes, and an arm that bends."""

from pathlib import Path

import numpy as np

import fba
from fba.parameters import bap_numbers, fap_numbers

FRAMES, RATE = 50, 25
jaw, elbow = fap_numbers()["open_jaw"], bap_numbers()["l_elbow_flexion"]

faps = np.zeros((FRAMES, 68), dtype=np.int32)
faps[:, jaw - 1] = 400 * np.abs(np.sin(np.arange(FRAMES) / 5))  # 1/1024 of the mouth-nose distance
fap_mask = np.zeros(faps.shape, dtype=bool)
fap_mask[:, jaw - 1] = True  # sent in every frame, also where it is 0

baps = np.zeros((FRAMES, 296), dtype=np.int32)
baps[:, elbow - 1] = np.linspace(0, np.radians(90) * 1e5, FRAMES)  # 1e-5 rad
bap_mask = np.zeros(baps.shape, dtype=bool)
bap_mask[:, elbow - 1] = True

animation = fba.Animation(
    RATE, np.arange(FRAMES), fba.FaceTrack(faps, fap_mask), fba.BodyTrack(baps, bap_mask), name="bend"
)
print(animation)
Path("out").mkdir(exist_ok=True)
fba.write("out/bend.fba", animation, bap_steps="visage")  # finer steps; who reads it needs the same
again = fba.read("out/bend.fba", bap_steps="visage")
assert again.face is not None
print("FAP", jaw, "peaks at", again.face.values[:, jaw - 1].max())
