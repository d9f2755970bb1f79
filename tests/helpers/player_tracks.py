"""Tracks for the player's tests, from what each frame sends."""

import numpy as np

from fba.animation import BodyTrack, FaceTrack


def face_track(frames: list[dict[int, int]]) -> FaceTrack:
    """A face track of frames {FAP: value}."""
    rows = frames
    values, mask = np.zeros((len(rows), 68), dtype=int), np.zeros((len(rows), 68), dtype=bool)
    for row, (into, sent) in zip(rows, zip(values, mask, strict=True), strict=True):
        for number, value in row.items():
            into[number - 1], sent[number - 1] = value, True
    return FaceTrack(values, mask)


def body_track(frames: list[dict[int, int]]) -> BodyTrack:
    """A body track of frames {BAP: value}."""
    values, mask = np.zeros((len(frames), 296), dtype=int), np.zeros((len(frames), 296), dtype=bool)
    for row, (into, sent) in zip(frames, zip(values, mask, strict=True), strict=True):
        for number, value in row.items():
            into[number - 1], sent[number - 1] = value, True
    return BodyTrack(values, mask)
