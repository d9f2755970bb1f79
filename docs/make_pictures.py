"""Makes the pictures of the documentation: `python docs/make_pictures.py [NAME...]`, without names all.

The files are in docs/images. Recordings are read from the shared material (FBA_SHARED, else ../shared beside
the checkout); plots need matplotlib. What is missing is said, and the other pictures are made.
"""

from __future__ import annotations

import argparse
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
from PIL import Image

from fba.errors import FbaError, did_you_mean

IMAGES = Path(__file__).resolve().with_name("images")
QUALITY = 85
"""Of JPEG."""
PICTURES = {
    "allexps.jpg": "pictures.body_pictures.expressions_sheet",
    "angry.jpg": "pictures.body_pictures.angry_sheet",
    "architecture.svg": "pictures.architecture_picture.main",
    "capture-faces.jpg": "pictures.face_capture_picture.main",
    "capture-markers.jpg": "pictures.marker_capture_picture.main",
    "capture-points.jpg": "pictures.points_picture.main",
    "capture-report.jpg": "pictures.capture_picture.main",
    "bodies.jpg": "pictures.body_pictures.bodies",
    "clips.jpg": "pictures.body_pictures.clips",
    "compare.jpg": "pictures.player_pictures.compare",
    "dance.jpg": "pictures.body_pictures.dance_sheet",
    "emotion-measured.jpg": "pictures.emotion_picture.measured",
    "emotion-mixtures.jpg": "pictures.emotion_picture.mixtures",
    "emotion-named.jpg": "pictures.emotion_picture.named",
    "emotion-told.jpg": "pictures.emotion_picture.told_apart",
    "emotion-told-named.jpg": "pictures.emotion_picture.told_apart_named",
    "expressions.jpg": "pictures.head_pictures.expressions",
    "faces.jpg": "pictures.head_pictures.faces",
    "faps.jpg": "pictures.head_pictures.faps",
    "figures.jpg": "pictures.head_pictures.figures",
    "find.png": "pictures.find_picture.main",
    "fitted.jpg": "pictures.head_pictures.fitted",
    "gait.jpg": "pictures.gait_curves.walks",
    "gait_curves.svg": "pictures.gait_curves.main",
    "hello.png": "pictures.head_pictures.hello",
    "lanes.jpg": "pictures.player_pictures.lanes",
    "loss.svg": "pictures.loss_picture.main",
    "markers-page.jpg": "pictures.player_pictures.markers",
    "moods.jpg": "pictures.emotion_picture.moods",
    "page.jpg": "pictures.page_picture.main",
    "panels.jpg": "pictures.player_pictures.panels",
    "persona-styles.jpg": "pictures.persona_style_picture.main",
    "persona.jpg": "pictures.persona_picture.main",
    "photos.jpg": "pictures.photo_picture.main",
    "points.jpg": "pictures.player_pictures.points",
    "postures.jpg": "pictures.body_pictures.postures",
    "proof.jpg": "pictures.head_pictures.proof",
    "real-recordings-bodies-bars.svg": "make_bitrate_page.pictures",
    "real-recordings-bodies.svg": "make_bitrate_page.pictures",
    "real-recordings-faces-bars.svg": "make_bitrate_page.pictures",
    "real-recordings-faces.svg": "make_bitrate_page.pictures",
    "simplify.jpg": "pictures.simplify_picture.levels",
    "speech.png": "pictures.speech_picture.main",
    "switches.jpg": "pictures.head_pictures.switches",
    "twists.jpg": "pictures.body_pictures.twists",
    "virtual-markers.jpg": "pictures.marker_picture.main",
    "visemes.jpg": "pictures.head_pictures.visemes",
    "window.jpg": "pictures.player_pictures.window",
    "wipe.jpg": "pictures.player_pictures.wipe",
}
"""What makes each picture: a function of a module, which returns it or writes it itself."""


def make(function: str, names: list[str]) -> None:
    """Make the pictures of one function, one of `PICTURES`."""
    module, _, what = function.rpartition(".")
    picture = getattr(import_module(module), what)()
    if picture is not None:
        image = Image.fromarray(picture[..., :3]) if isinstance(picture, np.ndarray) else picture
        image.save(IMAGES / names[0], quality=QUALITY, optimize=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(PICTURES)}")
    chosen = set()
    for given in parser.parse_args().names or PICTURES:
        found = [name for name in PICTURES if given in (name, Path(name).stem)]
        if not found:
            parser.error(
                f"there is no picture {given!r}{did_you_mean(given, [Path(name).stem for name in PICTURES])}"
            )
        chosen.update(found)
    failed = 0
    for function in dict.fromkeys(PICTURES[name] for name in sorted(chosen)):
        names = [name for name in PICTURES if PICTURES[name] == function]
        try:
            make(function, names)
        except (FbaError, ImportError, OSError) as error:
            failed += 1
            print(f"{', '.join(names)}: not made: {error}", file=sys.stderr)
        else:
            print(*names, sep="\n")
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
