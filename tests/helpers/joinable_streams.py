"""A performance whose stream has many I planes at which decoding can begin."""

import numpy as np

import fba
from fba import Animation, BodyTrack, FaceTrack
from fba.codec import EncoderOptions

FRAMES = 60
JOINABLE = EncoderOptions(intra_period=0.4, start_codes=True, bap_steps="visage")


def performance(frames: int = FRAMES, *, body: bool = True) -> Animation:
    random = np.random.default_rng(3)
    values = np.cumsum(random.integers(-20, 21, (frames, 68)), axis=0).astype(np.int32)
    values[:, :2] = 0
    mask = np.broadcast_to(np.arange(68) > 1, values.shape)
    turns = np.zeros((frames, 296), np.int32)
    turns[:, :30] = 20 * values[:, 2:32]
    sent = np.broadcast_to(np.arange(296) < 30, turns.shape)
    return Animation(25, np.arange(frames), FaceTrack(values, mask), BodyTrack(turns, sent) if body else None)


def assert_same(frame: fba.Frame, other: fba.Frame) -> None:
    for part in ("face", "body"):
        one, two = getattr(frame, part), getattr(other, part)
        assert (one is None) == (two is None)
        if one is not None:
            np.testing.assert_array_equal(one.values, two.values)
            np.testing.assert_array_equal(one.mask, two.mask)
