"""Bodies with a head of their own in a scene: no face is put on them, FAPs turn their heads."""

import numpy as np
import pytest

from fba import Animation
from fba.body import BodyModel
from fba.formats.gltf.bodies import import_body
from fba.parameters import fap_numbers
from fba_player._figure.person import head_rows
from fba_player.scene.scene import Scene
from player_tracks import body_track, face_track
from small_people import BONES, write_person

QUARTER = 157080
"""1e-5 rad."""


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> BodyModel:
    return import_body(write_person(tmp_path_factory.mktemp("people") / "person.glb"))


def test_the_head_of_the_body_is_shown_and_turned(body: BodyModel) -> None:
    yaw = fap_numbers()["head_yaw"]
    animation = Animation(25, np.arange(2), face_track([{}, {yaw: QUARTER}]), body_track([{}, {}]))
    scene = Scene(animation, body=body)
    still, turned = scene.view_at(0.0), scene.view_at(1 / 25)
    assert (len(still.faces), len(still.eyes)) == (1, 0)
    box = slice(8 * list(BONES).index("head"), 8 * list(BONES).index("head") + 8)
    rows = head_rows(body)
    assert rows[box].all()
    assert rows.sum() == 8
    before, after = (np.asarray(view.faces[0].positions) for view in (still, turned))
    np.testing.assert_allclose(after[~rows], before[~rows], atol=1e-6)
    skull = body.skeleton.centres[body.skeleton.number("skullbase")]
    quarter = (before[box] - skull)[:, [2, 1, 0]] * [1, 1, -1]  # +z goes to +x: the subject's left
    np.testing.assert_allclose(after[box] - skull, quarter, atol=2e-4)


def test_the_camera_looks_at_the_head_of_the_body(body: BodyModel) -> None:
    animation = Animation(25, np.arange(1), face_track([{}]), body_track([{}]))
    scene = Scene(animation, body=body)
    box = np.asarray(scene.view_at(0.0).faces[0].positions)[head_rows(body)]
    middle = (box.min(axis=0) + box.max(axis=0)) / 2
    np.testing.assert_allclose(scene.face_subject.centre, middle, atol=0.02)
    subject = scene.subject
    assert subject.centre[1] + subject.half_height > box[:, 1].max()
