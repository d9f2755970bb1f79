"""Makes the pictures of the documentation: `python docs/make_pictures.py`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

import fba
import player
from fba import Animation, FaceTrack
from fba.formats import merge
from player.recording import write_picture

UInt8 = npt.NDArray[np.uint8]

IMAGES = Path(__file__).with_name("images")
SAMPLES = Path(fba.__file__).with_name("samples")
MOMENTS = (1.9, 2.6, 4.4, 6.6)
"""Seconds of the sample performance that the first picture shows."""
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


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    Image.fromarray(hello()).save(IMAGES / "hello.png", optimize=True)
    write_picture(IMAGES / "faces.jpg", faces())
    write_picture(IMAGES / "expressions.jpg", player.contact_sheet("expressions", tile=(320, 320)))
    write_picture(IMAGES / "visemes.jpg", player.contact_sheet("visemes", tile=(200, 200)))
    write_picture(IMAGES / "faps.jpg", player.contact_sheet("faps", tile=(150, 150)))


if __name__ == "__main__":
    main()
