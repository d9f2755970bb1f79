"""Faces and bodies as captures and editors make them, drawn at random."""

from fractions import Fraction

import numpy as np

from fba import Animation, BodyTrack, EncoderOptions, FaceTrack
from fba.parameters import bap_steps, fap_groups, faps

LENGTH = 120
MATES = [
    (one.number - 1, one.left_right_mate - 1) for one in faps() if (one.left_right_mate or 0) > one.number
]
LIPS = [(one.number - 1, one.lip_mate - 1) for one in faps() if one.lip_mate and one.group == 2]


def made_face(rng: np.random.Generator, length: int = LENGTH) -> FaceTrack:
    """Return FAPs as captures and editors make them: equal for a while, still, or of their own."""
    step = np.array([1, 1, *(one.step for one in faps()[2:])])
    motion = np.cumsum(rng.integers(-2, 3, (length, 68)) * (rng.random((length, 68)) < 0.6), axis=0)
    motion[:, rng.random(68) < 0.3] = 0
    values = (motion * step).astype(np.int32)
    for pairs in (LIPS, MATES):
        for one, other in pairs:
            start, stop = sorted(rng.integers(0, length + 1, 2)) if rng.random() < 0.5 else (0, length)
            values[start:stop, other] = values[start:stop, one]
    values[:, :2] = 0
    mask = np.tile(rng.random(68) < 0.85, (length, 1))
    mask[:, :2] = False
    if rng.random() < 0.5:
        start, stop = sorted(rng.integers(1, length, 2))
        mask[start:stop] &= rng.random(68) < 0.7
    viseme, expression = np.zeros((length, 4), np.int16), np.zeros((length, 6), np.int16)
    if rng.random() < 0.4:
        mask[:, 0] = True
        viseme[:, 0], viseme[:, 2] = rng.integers(0, 15, length), 63
        mask[:, 1] = rng.random() < 0.5
        expression[:, 0], expression[:, 1] = 3, 40
        expression[:, 4] = rng.random() < 0.5
        viseme[:, 3] = rng.random(length) < (0.05 if rng.random() < 0.3 else 0)
    asked = None
    if rng.random() < 0.3:  # of whole groups, as a mask type says it
        asked = np.zeros((length, 68), dtype=bool)
        for group in fap_groups()[1:]:
            asked[:, np.array(group) - 1] = rng.random() < 0.5
    return FaceTrack(values, mask, viseme, expression, asked)


def made_animation(seed: int) -> Animation:
    rng = np.random.default_rng(seed)
    index = np.append(0, np.cumsum(rng.choice([1, 1, 1, 4], LENGTH - 1)))
    body = None
    if rng.random() < 0.5:
        walk = np.cumsum(rng.integers(-3, 4, (LENGTH, 296)), axis=0)
        moving = rng.random(296) < 0.2
        body = BodyTrack(
            (walk * bap_steps("iso") * moving).astype(np.int32), np.tile(rng.random(296) < 0.5, (LENGTH, 1))
        )
    return Animation(Fraction(25), index, made_face(rng), body)


def made_options(rng: np.random.Generator) -> EncoderOptions:
    """Return options of an encoder that limits what it cannot carry, drawn at random."""
    return EncoderOptions(
        fap_quant=int(rng.choice([1, 1, 3])),
        bap_quant=int(rng.choice([1, 4])),
        intra_period=float(rng.choice([0.5, 2])) if rng.random() < 0.3 else None,
        start_codes=bool(rng.random() < 0.3),
        clamp=True,
    )
