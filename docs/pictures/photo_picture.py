"""The picture of docs/photos.md: a rendered person, points on her photographs, and the head made of them."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from fba import Animation, FaceTrack, player
from fba.arrays import UInt8
from fba.errors import FbaWarning
from fba.face import FaceModel, fitting
from fba.parameters import point_rows
from fba_player.export.photo_sheet import photo_sheet
from tools.photos.rendered_faces import varied_head

SIZE = (720, 880)
SEED = 3
TURNS = {"front": 6.0, "side": 86.0}
"""Degrees to the person's left from which the photographs are taken."""


def photograph(head: FaceModel, name: str) -> fitting.Photo:
    """A picture of a head, with the places of its feature points."""
    with warnings.catch_warnings(action="ignore", category=FbaWarning):  # it has no FAPs
        scene = player.Scene(Animation(25, np.arange(1), FaceTrack.empty(1)), model=head)
    camera = player.Camera(yaw=TURNS[name], pitch=3).fit(scene.face_subject, SIZE[0] / SIZE[1])
    camera = replace(camera, distance=1.5, field_of_view=2 * float(np.degrees(np.arctan(0.17 / 1.5))))
    with player.Offscreen(scene, SIZE, samples=4) as view:
        view.camera = camera
        pixels = view.still(np.zeros(68))[..., :3]
    clip = np.column_stack([head.points, np.ones(len(head.points))]) @ camera.clip_matrix(SIZE).T
    places = (clip[:, :2] / clip[:, 3:] * (0.5, -0.5) + 0.5) * SIZE
    asked = fitting.FRONT_POINTS if name == "front" else fitting.SIDE_POINTS
    points = {one: (float(x), float(y)) for one in asked for x, y in [places[point_rows()[one]]]}
    return fitting.Photo(fitting.Photograph(np.ascontiguousarray(pixels), SIZE, f"{name}.png"), points)


def main() -> UInt8:
    head = varied_head(np.random.default_rng(SEED))
    assert head is not None
    photos = [photograph(head, name) for name in TURNS]
    steps = [*fitting.find_front_points(photos[0].photograph).steps]
    steps += fitting.find_side_points(photos[1].photograph).steps
    made = fitting.head_from_photos(*photos)
    return photo_sheet(photos, made, steps)
