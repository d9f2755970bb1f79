"""Makes the picture of curves, bit rate and puppeteer: `python docs/make_panel_picture.py`."""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path

import fba
from player.picture_files import write_picture
from player.puppet import Expression
from player.scene import Scene
from player.ui.picture import SETTLES, Studio
from player.ui.puppet_panel import PuppetPanel
from player.ui.session import Session
from player.ui.source import Source

IMAGES = Path(__file__).resolve().with_name("images")
SAMPLE = Path(fba.__file__).with_name("samples") / "hello.fap"
TIME = 4.4
CURVES = [3, 49, 31]
MOVED = {3: 420.0, 15: -120.0}
"""FAPs moved by hand."""


def main() -> None:
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        path = Path("hello.fba")
        fba.write(path, fba.read(SAMPLE), intra_period=2)
        scene = Scene(fba.read(path))
        session = Session(scene, source=Source(scene, path), size=(1280, 720))
        session.source.look(wait=True)
        session.open |= {"curves", "rate", "puppet"}
        session.selection.faps = CURVES
        session.transport.seek(TIME)
        with Studio(session) as studio:
            studio.draw(SETTLES)
            panel = next(one for one in studio.gui.panels if isinstance(one, PuppetPanel))
            puppet = panel.performer(session).puppet
            puppet.expression = Expression(1, 45)
            for number, value in MOVED.items():
                puppet.move_fap(number, value)
            studio.draw(1)
            write_picture(IMAGES / "panels.jpg", studio.draw(SETTLES))


if __name__ == "__main__":
    main()
