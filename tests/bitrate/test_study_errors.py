"""Errors of the study: worked out by hand for poses that are simple."""

import numpy as np
import pytest

from bench.bitrate.errors import measure_errors
from fba.face import FaceModel


def test_a_root_that_is_elsewhere_moves_every_point_by_as_much() -> None:
    source, shown = np.zeros((2, 296)), np.zeros((2, 296))
    shown[1, 180:183] = [3, 4, 12]  # BAPs 181 to 183, millimetres
    errors = measure_errors("body", source, shown, 25.0)
    per_joint = errors.millimetres.reshape(2, -1)
    assert not per_joint[0].any()
    np.testing.assert_allclose(per_joint[1], 13.0, atol=1e-4)
    assert errors.units == 12


def test_a_joint_that_turns_moves_points_3_cm_off_it() -> None:
    source, shown = np.zeros((1, 296)), np.zeros((1, 296))
    shown[0, 0:1] = 10_000  # 0.1 rad of the pelvis and all above it, or of a leg
    errors = measure_errors("body", source, shown, 25.0).millimetres
    assert (errors == 0).any()  # what hangs elsewhere stays
    assert errors[errors > 0].min() == pytest.approx(2 * 30 * np.sin(0.05), rel=1e-4)  # the joint itself


def test_the_face_is_measured_in_the_frame_of_the_head() -> None:
    source, shown = np.zeros((3, 68)), np.zeros((3, 68))
    shown[1, 47] = 1745  # FAP 48, head_pitch: 0.01745 rad is one degree
    shown[2, 2] = 100  # FAP 3, open_jaw: the chin goes down by 100 / 1024 of the mouth-nose separation
    errors = measure_errors("face", source, shown, 25.0)
    chin = 1000 * 100 * FaceModel.default().fapu.MNS
    assert errors.millimetres[:2].tolist() == [0, 0]
    assert chin <= errors.millimetres[2] < 2 * chin  # the chin, and no vertex twice as far
    assert errors.degrees == pytest.approx(1.0, abs=1e-3)
    assert errors.units == 1745
