"""Knees that bend forward, and BAPs of another convention by the standard's."""

from pathlib import Path

import numpy as np
import pytest

import fba
from fba import BodyTrack
from fba.body import BapSolver
from fba.body.turned_legs import by_the_standard, find_turned_legs
from fba.parameters import BAP_COUNT, bap_numbers


def bent(*degrees: float, knee: str = "l_knee_flexion") -> BodyTrack:
    """A body whose knee bends by these angles, frame by frame."""
    values = np.zeros((len(degrees), BAP_COUNT), dtype=np.int32)
    values[:, bap_numbers()[knee] - 1] = np.radians(degrees) * 1e5
    return BodyTrack(values, values != 0)


@pytest.mark.parametrize(
    ("body", "finding"),
    [
        (bent(0, 10, 30, 45), "knees bend forward in 2 of 4 frames, by up to 45 degrees"),
        (bent(30, knee="r_knee_flexion"), "in 1 of 1 frames"),
        (bent(30, 30, -30), "in 2 of 3 frames"),
        (bent(30, -30, -30), None),  # a jitter among knees that bend
        (bent(30, -30), None),
        (bent(0, 15, 19), None),  # stretched
        (bent(-45, -120), None),
        (bent(-30, 320, 315), None),  # past half a turn
        (bent(90, knee="l_hip_flexion"), None),
        (BodyTrack.empty(3), None),
        (BodyTrack.empty(0), None),
    ],
)
def test_knees_that_bend_forward(body: BodyTrack, finding: str | None) -> None:
    found = find_turned_legs(body)
    assert found is None if finding is None else finding in (found or "")


def test_of_the_files_of_others_one_is_found(shared: Path) -> None:
    found = [
        path.name
        for path in sorted((shared / "data" / "vreng").glob("*.bap"))
        if (body := fba.read(path).body) is not None and find_turned_legs(body)
    ]
    assert found == ["sit.bap"]


def test_bodies_by_the_standard_pose_alike() -> None:
    values = np.random.default_rng(1).integers(-60_000, 60_000, (5, BAP_COUNT), dtype=np.int32)
    body = BodyTrack(values, values > 0)
    turned = by_the_standard(body, "vreng")
    np.testing.assert_allclose(
        BapSolver().pose(turned.values), BapSolver(axes="vreng").pose(body.values), atol=1e-12
    )
    assert np.array_equal(turned.mask, body.mask)
    assert by_the_standard(turned, "vreng") == body
    assert by_the_standard(body, "iso") == body
    with pytest.raises(ValueError, match="more than signs"):
        by_the_standard(body, "abduct_first")
