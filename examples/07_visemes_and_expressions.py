"""A smile and a vowel by name, and where they move the vertices of the built-in head."""

import numpy as np

import fba
from fba.face import Deformer, FaceModel, resolve

FRAMES = 25
mask = np.zeros((FRAMES, 68), dtype=bool)
mask[:, [0, 1]] = True  # FAP 1 is the viseme, FAP 2 the expression
viseme = np.zeros((FRAMES, 4), dtype=np.int16)
viseme[:, 0] = 10  # viseme_select1: the vowel of "car"
viseme[:, 2] = 63  # viseme_blend: all of it, nothing of select2
expression = np.zeros((FRAMES, 6), dtype=np.int16)
expression[:, 0] = 1  # expression_select1: joy
expression[:, 1] = np.linspace(0, 63, FRAMES)  # expression_intensity1, at most 63
face = fba.FaceTrack(np.zeros((FRAMES, 68), dtype=np.int32), mask, viseme, expression)

model = FaceModel.default()
shown = resolve(face, model)  # float32 (T, 68): the FAPs that the face shows
vertices = Deformer(model)(shown)  # float32 (T, V, 3), metres
moved = np.linalg.norm(vertices - model.vertices, axis=2).max(axis=1)
print("FAPs that move in the last frame:", np.count_nonzero(shown[-1]))
for frame in (0, 12, 24):
    print(
        f"frame {frame}: open_jaw {shown[frame, 3 - 1]:.0f}, vertices move up to {1000 * moved[frame]:.1f} mm"
    )
