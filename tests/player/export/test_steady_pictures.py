"""What stands still is still in pictures, and what moves slowly changes them evenly."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import graphics
from fba.animation import Animation
from fba.errors import DisplayError
from fba.parameters import fap_numbers
from fba.player import Offscreen
from player_tracks import body_track, face_track

SIZE = (640, 360)
SLOW = 400
"""Turn of the head in a frame, 1e-5 rad: eyes and mouth of a body 360 lines high move 1/15 of a pixel."""
REST = {"open_jaw": 200, "head_yaw": 0}
"""FAPs of all frames: a mouth a little open."""
BLOCK = 12
"""Size (pixels) of the blocks of a picture whose changes are compared: as wide as an eye and its lids."""


def pictures(faces: list[dict[str, int]], *, body: bool) -> npt.NDArray[np.int16]:
    """(T, H, W, 3): a picture of each frame, of the face, or of the whole body."""
    numbers, count = fap_numbers(), len(faces)
    posed = [{numbers[name]: value for name, value in {**REST, **row}.items()} for row in faces]
    bodies = body_track([{} for _ in faces]) if body else None
    animation = Animation(25, np.arange(count), face_track(posed), bodies)  # type: ignore[arg-type]
    try:
        with Offscreen(animation, SIZE) as view:
            return np.array([view.frame(number / 25)[..., :3] for number in range(count)], dtype=np.int16)
    except DisplayError as error:
        graphics.skip(str(error))
        raise


@pytest.mark.parametrize("body", [False, True])
def test_frames_of_equal_values_are_equal_to_the_last_pixel(body: bool) -> None:
    """Also where something else was shown between them: nothing is left of it."""
    first, again, other, last = pictures([{}, {}, {"head_yaw": 20000, "open_jaw": 700}, {}], body=body)
    assert (other != first).any()
    np.testing.assert_array_equal(again, first)
    np.testing.assert_array_equal(last, first)


def test_eyes_and_mouth_of_a_slowly_turning_head_do_not_tick() -> None:
    """Change of a frame: sum over all pixels of differences from the frame before. No frame changes more than
    1.35 times the mean of all; no block of 12 x 12 pixels with features (those that change by more than 1 of
    765 in the mean) more than 3 times its own mean.
    """
    frames = pictures([{"head_yaw": SLOW * number} for number in range(24)], body=True)
    steps = np.abs(np.diff(frames, axis=0)).sum(axis=3)
    whole = steps.sum(axis=(1, 2))
    assert whole.max() < 1.35 * whole.mean()
    moving = steps.mean(axis=0) > 0.5
    rows, columns = (np.flatnonzero(moving.any(axis=axis)) for axis in (1, 0))
    high, wide = (int(np.ptp(places)) // BLOCK for places in (rows, columns))
    head = steps[:, rows[0] : rows[0] + high * BLOCK, columns[0] : columns[0] + wide * BLOCK]
    blocks = head.reshape(len(steps), high, BLOCK, wide, BLOCK).mean(axis=(2, 4))
    inside = blocks.mean(axis=0) > 1.0
    assert inside.sum() >= 9
    worst = (blocks.max(axis=0) / np.maximum(blocks.mean(axis=0), 1e-9))[inside]
    assert worst.max() < 3.0
