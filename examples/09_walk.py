"""Walks of five characters, and the joints of one in metres."""

from pathlib import Path

import fba
from fba.body import BapSolver, gait

for character in ("normal", "bored", "proud", "hurried", "sneaking"):
    walk = gait.walk(character=character, cycles=2, rate=30)
    soles = gait.soles(walk)  # where heel, ball and toes are, frame by frame
    print(f"{character}: {float(walk.duration):.2f} s, feet slip by {1000 * soles.slip:.1f} mm")

proud = gait.walk(1.2, "proud", cycles=2, rate=30)  # strides of 1.2 m
assert proud.body is not None
joints = BapSolver().pose(proud.body.values)  # (T, 87, 4, 4): a matrix for each joint
root = joints[:, 0, :3, 3]
print(f"proud: {root[-1, 2] - root[0, 2]:.2f} m forward")

Path("out").mkdir(exist_ok=True)
fba.write("out/proud.bap", proud)
