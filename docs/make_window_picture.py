"""Makes the picture of the player's window for the documentation: `python docs/make_window_picture.py`."""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path

import fba
from fba.formats import merge
from player.recording import write_picture
from player.scene import Scene
from player.ui.picture import picture
from player.ui.session import Session
from player.ui.source import Source

IMAGES = Path(__file__).resolve().with_name("images")
SAMPLES = Path(fba.__file__).with_name("samples")
TIME, MARKS = 4.4, (2.0, 6.6)
"""What is shown, and the loop that is marked, seconds."""
PANELS = ("file", "curves")


def main() -> None:
    face, body = fba.read(SAMPLES / "hello.fap"), fba.read(SAMPLES / "hello.bvh")
    together = merge(face, body.resample(face.rate))
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        path = Path("hello.fba")
        path.write_bytes(fba.encode(together, fba.EncoderOptions(bap_steps="visage", intra_period=2)))
        scene = Scene(fba.read(path, bap_steps="visage"))
        source = Source(scene, path, bap_steps="visage")
        session = Session(scene, source=source, size=(1280, 720))
        session.transport.seek(TIME)
        session.transport.mark_in, session.transport.mark_out = MARKS
        write_picture(IMAGES / "window.jpg", picture(session, PANELS))


if __name__ == "__main__":
    main()
