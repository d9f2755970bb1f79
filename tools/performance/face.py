"""The face as FAPs, 25 frames a second: smile, brows, speech, eyes, and part of the head's rotation."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from fba import Animation, FaceTrack
from fba.parameters import FAP_COUNT, fap_numbers
from performance.body import BodyMotion
from performance.curves import RATE, Float, read_tracks
from performance.eyes import eyeballs, flicks, lids
from performance.mouth import speech

FACE_RATE = 25
OUTER = 0.88
"""Motion of the outer contour of the lips relative to the inner one."""
RADIAN = 1e5
"""Angle units (AU) to a radian."""


def animate(body: BodyMotion, name: str) -> Animation:
    """The face's animation for a motion of the body."""
    curves = _mouth() | _brows() | _eyes(body)
    for fap, angle in zip(("head_yaw", "head_roll", "head_pitch"), body.own.T, strict=True):
        curves[fap] = np.deg2rad(angle) * RADIAN
    step = RATE // FACE_RATE
    count = len(curves["open_jaw"][::step])
    values = np.zeros((count, FAP_COUNT), dtype=np.int32)
    mask = np.zeros((count, FAP_COUNT), dtype=bool)
    for fap, curve in curves.items():
        column = fap_numbers()[fap] - 1
        values[:, column] = np.rint(curve[::step])
        mask[:, column] = True
    face = FaceTrack(values, mask, np.zeros((count, 4), np.int16), np.zeros((count, 6), np.int16))
    return Animation(Fraction(FACE_RATE), np.arange(count), face, None, name)


def _mouth() -> dict[str, Float]:
    key = read_tracks("face_keys.csv")
    say, held = speech()
    smile, grin = key["smile"], key["grin"] * (1 - held)
    press = key["press"] * (1 - held)
    spread = smile * (1 - 0.45 * held)
    top = say["top"] + 95 * grin + 25 * smile * held - 35 * press
    bottom = say["bottom"] + 150 * grin - 60 * press
    middle = {"top": top, "bottom": bottom}
    half = {"top": 0.88 * top + 130 * spread, "bottom": 0.86 * bottom - 150 * spread}
    width = say["width"] + 150 * spread
    corner = 430 * spread - 12 * np.clip(say["push"], 0, None) / 100
    jaw = say["jaw"] + 60 * grin
    curves = {
        "open_jaw": np.maximum(jaw, 0),
        "lower_t_midlip": -middle["top"],
        "raise_b_midlip": -middle["bottom"],
        "push_t_lip": say["push"] - 20 * spread,
        "push_b_lip": 0.9 * say["push"] - 20 * spread,
        "raise_tongue_tip": say["tip"],
        "raise_tongue": say["tongue"],
    }
    for side, uneven in (("l", 1.06), ("r", 0.95)):  # nobody smiles quite evenly
        curves |= {
            f"stretch_{side}_cornerlip": width,
            f"raise_{side}_cornerlip": corner * uneven,
            f"lower_t_lip_{side}m": -half["top"] * uneven,
            f"raise_b_lip_{side}m": -half["bottom"],
            f"lift_{side}_cheek": 190 * spread * uneven,
        }
    outer = {
        "lower_t_midlip_o": -OUTER * middle["top"] + 20 * press,
        "raise_b_midlip_o": -OUTER * middle["bottom"] - 25 * press,
    }
    for side in "lr":  # the outer corners go with the inner ones, unsent
        outer[f"lower_t_lip_{side}m_o"] = OUTER * curves[f"lower_t_lip_{side}m"]
        outer[f"raise_b_lip_{side}m_o"] = OUTER * curves[f"raise_b_lip_{side}m"]
        outer[f"stretch_{side}_nose"] = 45 * spread
    return curves | outer


def _brows() -> dict[str, Float]:
    key = read_tracks("face_keys.csv")
    curves = {}
    for side, tilt in (("l", 1.0), ("r", -0.6)):
        inner, outer = key["brow_inner"], key["brow_outer"] + tilt * key["brow_tilt"]
        curves[f"raise_{side}_i_eyebrow"] = inner
        curves[f"raise_{side}_m_eyebrow"] = 0.55 * (inner + outer)
        curves[f"raise_{side}_o_eyebrow"] = outer
        curves[f"squeeze_{side}_eyebrow"] = key["squeeze"]
    return curves


def _eyes(body: BodyMotion) -> dict[str, Float]:
    key = read_tracks("face_keys.csv")
    yaw, pitch = eyeballs(key["gaze_yaw"] + flicks(1), key["gaze_pitch"] + flicks(4), body.head)
    top, bottom = lids(pitch, key["squint"], key["smile"])
    curves = {}
    for side, inward in (("l", -0.6), ("r", 0.6)):  # degrees: both eyes look at one point some metres away
        curves[f"close_t_{side}_eyelid"] = top
        curves[f"close_b_{side}_eyelid"] = bottom
        curves[f"yaw_{side}_eyeball"] = np.deg2rad(yaw + inward) * RADIAN
        curves[f"pitch_{side}_eyeball"] = np.deg2rad(pitch) * RADIAN
    return curves
