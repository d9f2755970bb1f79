"""The light on a body as its limbs move: dark where something is before the key light or close above."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from fba.body import BapSolver, BodyModel
from fba.compiled import is_compiled
from fba_player._figure.body_light import UNOBSTRUCTED_LIGHT, build_body_light

pytestmark = pytest.mark.skipif(not is_compiled(), reason="without numba all light counts as free")


def shade(joints: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    body = BodyModel.default()
    places, normals = np.empty_like(body.vertices), np.empty_like(body.vertices)
    body.skin(joints, places, normals)
    return build_body_light(body, dict.fromkeys(part.name for part in body.parts)).shade(
        places, normals, joints
    ), places


@pytest.fixture(scope="module")
def standing() -> npt.NDArray[np.float64]:
    return BapSolver(BodyModel.default().skeleton).pose(np.zeros(296))


def test_no_more_light_than_there_is_and_little_lost_in_the_open(standing: npt.NDArray[np.float64]) -> None:
    light, places = shade(standing)
    assert (light >= 0).all()
    assert (light <= np.array(UNOBSTRUCTED_LIGHT, dtype=np.float32) + 1e-6).all()
    shin = (np.abs(places[:, 1] - 0.25) < 0.05) & (places[:, 2] > np.quantile(places[:, 2], 0.6))
    assert np.median(light[shin, 0]) > 0.9
    assert np.median(light[shin, 1]) > 0.8


def test_an_arm_before_the_chest_takes_its_key_light(standing: npt.NDArray[np.float64]) -> None:
    """The left forearm is put 25 cm from the chest, on the way from its middle to the key light."""
    body = BodyModel.default()
    light, places = shade(standing)
    names = list(body.skeleton.names)
    rows = slice(body.starts["shirt"], body.starts["shirt"] + len(body.part("shirt").vertices))
    chest = np.array([0.0, 1.3, places[rows][np.abs(places[rows, 1] - 1.3) < 0.03, 2].max()])
    key = np.array([0.70, 0.68, 0.80]) / np.linalg.norm([0.70, 0.68, 0.80])
    moved = standing.copy()
    for name, aside in (("l_elbow", 0.15), ("l_wrist", -0.15)):
        moved[names.index(name), :3, 3] = chest + 0.25 * key + (aside, 0, 0)
    before = build_body_light(body, dict.fromkeys(part.name for part in body.parts))
    normals = np.empty_like(places)
    body.skin(standing, np.empty_like(places), normals)
    shaded = before.shade(places, normals, moved)
    near = np.flatnonzero(np.linalg.norm(places - chest, axis=1) < 0.03)
    assert len(near) > 2
    assert shaded[near, 0].max() < 0.35
    assert light[near, 0].min() > 0.8


def test_positions_of_another_body_are_refused(standing: npt.NDArray[np.float64]) -> None:
    body = BodyModel.default()
    light = build_body_light(body, dict.fromkeys(part.name for part in body.parts))
    more = np.zeros((len(body.vertices) + 1, 3), dtype=np.float32)
    with pytest.raises(ValueError, match=f"{len(more)} positions for a body of {len(more) - 1} vertices"):
        light.shade(more, more, standing)
