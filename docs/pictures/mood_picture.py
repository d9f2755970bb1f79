"""One performance in six moods, for docs/emotion.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import fba
from fba.arrays import UInt8
from fba.emotion import Mood, emote
from fba_player.export._offscreen import Offscreen
from fba_player.scene.scene import Scene

SAMPLE = Path(fba.__file__).with_name("samples") / "hello.fap"
MOODS = {"neutral": 0, "angry": 90, "surprised": 80, "sad": 90, "sleepy": 90, "happy": 80}
MOMENTS = (1.0, 2.8, 4.0, 7.6)
"""Seconds of the sample that are shown, one below the other."""
TILE = 210


def moods() -> UInt8:
    animation = fba.read(SAMPLE)
    columns = []
    for name, intensity in MOODS.items():
        scene = Scene(emote(animation, [Mood(name, intensity)]))
        with Offscreen(scene, (TILE, TILE), samples=4) as view:
            columns.append(np.concatenate([view.frame(time)[..., :3] for time in MOMENTS]))
    return np.concatenate(columns, axis=1)
