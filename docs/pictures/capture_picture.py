"""Picture of docs/motion-capture.md.

It shows the sample capture beside a result that was spoiled on purpose: the right hand is turned over, and
the left shoulder drawn up.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from fba.animation import Animation
from fba.body import Skeleton
from fba.capture import from_skeleton
from fba.capture.bones import find_bones
from fba.capture.comparison import compare
from fba.cli.capture_report import CaptureReport, draw_sights
from fba.errors import FbaWarning
from fba.formats.bvh._reader import read_motion
from fba.parameters import bap_numbers

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "fba/samples/hello.bvh"
TARGET = Path(__file__).parents[1] / "images" / "capture-report.jpg"
SPOILED = {"r_wrist_twisting": 130.0, "l_sternoclavicular_abduct": 30.0}
"""BAPs, and degrees that are added to them."""
WIDTH = 1200


def spoil(animation: Animation) -> Animation:
    """The animation with the BAPs of `SPOILED` changed in its second half."""
    assert animation.body is not None
    values = animation.body.values.copy()
    mask = animation.body.mask.copy()
    for name, degrees in SPOILED.items():
        values[len(values) // 2 :, bap_numbers()[name] - 1] += round(np.radians(degrees) * 1e5)
        mask[:, bap_numbers()[name] - 1] = True
    return replace(animation, body=replace(animation.body, values=values, mask=mask))


def main() -> None:
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        motion = read_motion(SOURCE)
    result = spoil(from_skeleton(motion))
    mapped = find_bones(motion, None, Skeleton.default()).joints
    report = CaptureReport(SOURCE, motion, mapped, result, compare(motion, result, mapped))
    picture = Image.fromarray(draw_sights(report, 2))
    size = (WIDTH, round(picture.height * WIDTH / picture.width))
    picture.resize(size, Image.Resampling.LANCZOS).save(TARGET, quality=84, optimize=True)
