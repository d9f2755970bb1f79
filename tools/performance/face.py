"""The face as FAPs, 25 frames a second: smile, brows, speech, eyes, and part of the head's rotation.

The mouth in speech is what `fba.speech` makes of the phones that the sample's voice says. Eyes hold their
gaze while the head moves; lids follow them and blink.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from scipy.spatial.transform import Rotation

from fba import Animation, FaceTrack
from fba.parameters import FAP_COUNT, fap_numbers
from fba.speech import Phone, find_shapes
from fba.speech._coarticulation import coarticulate
from performance.body import BodyMotion
from performance.curves import RATE, Float, read_table, read_tracks, sample_times, smooth

SHUT_TOP, SHUT_BOTTOM = 930.0, 110.0
"""FAP values of both lids of a closed eye: together more than 1024, the height of the opening."""
FOLLOW_TOP, FOLLOW_BOTTOM = 13.0, -6.0
"""FAP units by which a lid moves for each degree that the eye looks down."""
OPEN = 60.0
"""FAP units by which awake eyes are opened wider than those of the neutral face."""
STILL = 30
"""Samples (0.1 s) between the small flicks that eyes make all the time."""
PARTS = {
    "jaw": (1, "open_jaw"),
    "top": (-1, "lower_t_midlip"),
    "bottom": (-1, "raise_b_midlip"),
    "width": (1, "stretch_l_cornerlip"),
    "push": (1, "push_b_lip"),
    "tip": (1, "raise_tongue_tip"),
    "tongue": (1, "raise_tongue"),
}
"""Opening of the jaw, rise of the top lip, fall of the bottom lip, spread of the corners, protrusion of the
lips, rise of the tongue's tip and body: sign and name of the FAPs in whose units they are."""
AHEAD, BEHIND = 0.10, 0.12
"""Seconds by which speech is visible before it begins and after it ends."""
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
    rounded = np.clip(say["push"] / 250, 0, 1)
    spread = smile * (1 - 0.45 * held) * (1 - 0.6 * rounded)
    top = say["top"] + 95 * grin + 25 * smile * held - 35 * press
    bottom = say["bottom"] + 150 * grin - 60 * press
    middle = {"top": top, "bottom": bottom}
    half = {"top": 0.88 * top + 130 * spread, "bottom": 0.86 * bottom - 150 * spread}
    width = say["width"] + 80 * spread
    corner = 400 * spread - 0.5 * say["jaw"] * rounded
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


def speech() -> tuple[dict[str, Float], Float]:
    """(curves (T,) by PARTS, share (T,) of the mouth that speech controls, 0..1)."""
    time = sample_times()
    phones = [Phone(row["phone"], float(row["start"]), float(row["end"])) for row in read_table("phones.csv")]
    values = coarticulate(find_shapes(phones), Fraction(RATE), len(time)).values
    held = np.zeros(len(time))
    for phone in phones:
        held[(time >= phone.start - AHEAD) & (time <= phone.end + BEHIND)] = 1.0
    parts = {
        part: sign * values[:, fap_numbers()[name] - 1].astype(float) for part, (sign, name) in PARTS.items()
    }
    return parts, smooth(held, 0.04)


def eyeballs(yaw: Float, pitch: Float, head: Rotation) -> tuple[Float, Float]:
    """((T,) left, (T,) down) of the eyeballs in the head, degrees, for a gaze in the world, degrees."""
    turn = np.deg2rad([yaw, pitch])
    looked = np.stack(
        [np.sin(turn[0]) * np.cos(turn[1]), -np.sin(turn[1]), np.cos(turn[0]) * np.cos(turn[1])], axis=-1
    )
    x, y, z = head.inv().apply(looked).T
    return np.rad2deg(np.arctan2(x, z)), np.rad2deg(np.arctan2(-y, np.hypot(x, z)))


def lids(pitch: Float, squint: Float, smile: Float) -> tuple[Float, Float]:
    """(top (T,), bottom (T,)) FAP values of the lids. squint: -1 wide .. 1 narrow."""
    shut = _blinks()
    top = FOLLOW_TOP * pitch - OPEN + np.where(squint < 0, 190, 60) * squint
    bottom = FOLLOW_BOTTOM * pitch + 150 * np.maximum(squint, 0) + 85 * smile
    top, bottom = np.clip(top, -250, 850), np.clip(bottom, -150, 300)
    return top + (SHUT_TOP - top) * shut, bottom + (SHUT_BOTTOM - bottom) * shut


def _blinks() -> Float:
    """(T,) closure by blinks, 0 open .. 1 shut: down fast, up slower, and slower still at the end."""
    time = sample_times()
    result = np.zeros(round(len(time)))
    for row in read_table("blinks.csv"):
        start, closing, shut, opening = (float(row[k]) for k in ("time", "closing", "shut", "opening"))
        down = np.clip((time - start) / closing, 0, 1)
        up = np.clip((time - start - closing - shut) / opening, 0, 1)
        result = np.maximum(result, down**2 * (3 - 2 * down) * (1 - up) ** 2 * (1 + 2 * up))
    return result


def flicks(seed: int) -> Float:
    """(T,) degrees: random steps of about a third of a degree, each held until the next."""
    steps = np.arange(round(len(sample_times()) / STILL))
    held = 0.45 * (np.modf((steps // (2 + steps % 3 % 2) * 7 + seed) * 0.6180339887498949)[0] - 0.5)
    assert RATE % 10 == 0
    return np.repeat(held, STILL)
