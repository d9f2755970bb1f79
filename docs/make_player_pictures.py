"""Makes the pictures of the window: `python docs/make_player_pictures.py`."""

from __future__ import annotations

from pathlib import Path

import fba
from player.compare import CompareScene
from player.picture_files import write_picture
from player.scene import Scene
from player.ui.picture import Studio
from player.ui.session import Session

IMAGES = Path(__file__).with_name("images")
SAMPLE = Path(fba.__file__).with_name("samples") / "hello.fap"
COARSE = 31
"""Quantiser step of what is compared."""
MOMENT = 4.4


def compare() -> None:
    """Two performances over each other, and the panel of their differences."""
    original = fba.read(SAMPLE)
    coarse = fba.decode(fba.encode(original, fba.EncoderOptions(fap_quant=COARSE)))
    names = ["hello.fap", "coarse.fba"]
    scene = CompareScene([Scene(original), Scene(coarse)], arrangement="over", names=names)
    session = Session(scene, size=(1280, 720))
    session.open.add("differences")
    with Studio(session) as studio:
        session.transport.seek(MOMENT)
        write_picture(IMAGES / "compare.jpg", studio.draw(8)[..., :3])


if __name__ == "__main__":
    compare()
