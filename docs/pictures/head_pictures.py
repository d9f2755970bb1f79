"""Pictures of the built-in head: expressions, visemes, FAPs, the sample performance, fitted heads."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

import fba
from fba import Animation, FaceTrack, player
from fba.face import FaceModel, feature_point_names
from fba.face.calibration import fit
from fba.formats import merge

UInt8 = npt.NDArray[np.uint8]

PAGE = Path(__file__).parents[1] / "calibrate.md"
SAMPLES = Path(fba.__file__).with_name("samples")
MOMENTS = (1.9, 2.6, 4.4, 6.6)
"""Seconds of the sample performance that the first picture shows."""
SWITCHED = 2.6
"""Seconds of it that the picture of switches shows."""
FACES = (
    # yaw and pitch of the camera, degrees; expression with its intensity, or 0; FAPs on top
    (-28.0, 2.0, 0, 0, {}),
    (10.0, 0.0, 1, 55, {3: 150, 48: -4000, 49: 6000, 50: 5000}),
    (32.0, 4.0, 6, 40, {49: -12000, 23: 8000, 24: 8000}),
)
"""The built-in head at the top of the documentation."""


def performance() -> Animation:
    """The sample, after a trip through the codec."""
    face, body = fba.read(SAMPLES / "hello.fap"), fba.read(SAMPLES / "hello.bvh")
    data = fba.encode(merge(face, body.resample(face.rate)), fba.EncoderOptions(bap_steps="visage"))
    return fba.decode(data, bap_steps="visage")


def strip(pictures: Sequence[UInt8]) -> UInt8:
    """Pictures of one size, side by side."""
    return np.concatenate(pictures, axis=1)[..., :3]


def hello() -> UInt8:
    scene = player.Scene(performance())
    with player.Offscreen(scene, (320, 400), samples=4) as view:
        return strip([view.frame(time) for time in MOMENTS])


def faces() -> UInt8:
    scene = player.Scene(Animation(25, np.arange(1), FaceTrack.empty(1)))
    definitions = scene.model.definitions
    found = []
    with player.Offscreen(scene, (420, 460), samples=4) as view:
        for yaw, pitch, expression, intensity, extra in FACES:
            faps = definitions.expressions[expression] * (intensity / 63)
            for number, value in extra.items():
                faps[number - 1] += value
            view.camera = player.Camera(yaw=yaw, pitch=pitch).fit(scene.face_subject, 420 / 460).zoom(0.86)
            found.append(view.still(faps))
    return strip(found)


def figures() -> UInt8:
    """The figures that come with the library: faces at rest and glad, and as they stand in the sample."""
    animation = performance()
    rows = []
    for name in fba.figures.FIGURES:
        face, body = fba.figures.face(name), fba.figures.body(name)
        head = player.Scene(Animation(25, np.arange(1), FaceTrack.empty(1)), face)
        whole = player.Scene(animation, face, body=body)
        glad = head.model.definitions.expressions[1]
        shown = []
        with player.Offscreen(head, (360, 400), samples=4) as view:
            for camera, faps in (("three-quarter", glad * 0), ("profile", glad * 0), ("front", glad)):
                view.camera = head.camera(camera, 360 / 400)
                shown.append(view.still(faps))
        with player.Offscreen(whole, (360, 400), "body", samples=4) as view:
            shown.append(view.frame(SWITCHED))
        rows.append(strip(shown))
    return np.concatenate(rows)


def fitted() -> Image.Image:
    """The built-in head, fitted to a broad person, to a child, and to the points of docs/calibrate.md."""
    head = FaceModel.default()
    row = {name: number for number, name in enumerate(feature_point_names())}
    child = head.points * 0.82
    down = np.clip(-child[:, 1] / 0.06, 0, 2)
    child *= 1 - 0.06 * down[:, None] * (1, 2, 0)
    child[:, 2] -= 0.003 * down
    for pupil, lids in (("3.5", "3.1 3.3 3.7 3.9 3.11 3.13"), ("3.6", "3.2 3.4 3.8 3.10 3.12 3.14")):
        rows = [row[name] for name in lids.split()]
        child[rows] += (child[rows] - child[row[pupil]]) * (0.1, 0.16, 0.1)
    page = PAGE.read_text(encoding="utf-8")
    given = np.full((len(row), 3), np.nan)
    for name, *place in filter(None, map(str.split, page.split("\nEND\n")[0].splitlines())):
        if name in row and len(place) == 3:
            given[row[name]] = [float(number) for number in place]
    people = [
        head,
        *(fit(head, points, tables="carry") for points in (head.points * (1.12, 0.96, 1.0), child, given)),
    ]
    pictures = []
    for camera in ("front", "three-quarter"):
        for person in people:
            scene = player.Scene(Animation(25, np.arange(1), FaceTrack.empty(1)), person)
            with player.Offscreen(scene, (300, 360), scene.camera(camera, 300 / 360), samples=4) as view:
                pictures.append(view.frame(0.0).copy())
    columns = len(people)
    return Image.fromarray(np.concatenate([strip(pictures[:columns]), strip(pictures[columns:])]))


def switches() -> UInt8:
    """Six switches of the player, two rows."""
    animation = performance()
    face = player.Scene(Animation(animation.rate, animation.index, animation.face))
    whole = player.Scene(animation)
    shown: list[UInt8] = []
    for scene, name, value, size in (
        (face, "wireframe", True, (400, 440)),
        (face, "points", True, (400, 440)),
        (face, "influence", "open_jaw", (400, 440)),
        (whole, "skeleton", "through", (400, 440)),
        (whole, "grid", True, (400, 440)),
        (face, "normals", True, (400, 440)),
    ):
        scene.show(name, value)
        with player.Offscreen(scene, size, "body" if scene is whole else "three-quarter", samples=4) as view:
            shown.append(view.frame(SWITCHED))
        scene.show(name, False)
    return np.concatenate([strip(shown[:3]), strip(shown[3:])])


def expressions() -> UInt8:
    return player.contact_sheet("expressions", tile=(320, 320))


def visemes() -> UInt8:
    return player.contact_sheet("visemes", tile=(200, 200))


def faps() -> UInt8:
    return player.contact_sheet("faps", tile=(150, 150))


def proof() -> UInt8:
    return player.contact_sheet("proof", tile=(132, 165))
