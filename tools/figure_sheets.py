"""Sheets of pictures to judge a figure by, before and after a change.

python -m tools.figure_sheets [--figure NAME] [--lines 360 720 1080] [--only face|body] FOLDER

face: eight views, the expressions and the visemes from two sides. body: dance, walk and sit, eight frames
each, of the shared recordings (FBA_SHARED, else ../shared beside the checkout). Each picture has so many
lines; the sheets are JPEG files in FOLDER, named by content and lines.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from PIL import Image

import fba
from fba import figures, player
from fba.arrays import UInt8
from tools.figure_checks import SHARED

MOTIONS = {"dance": "data/greta/Dance.bvh", "walk": "data/vreng/cmu_walk.bvh", "sit": "data/vreng/sit.bap"}
FRAMES = 8
"""Of each motion."""
QUALITY = 88


def face_sheet(figure: str, lines: int) -> UInt8:
    """Return the sheet of a figure's face, uint8 (H, W, 3)."""
    return player.contact_sheet("proof", figures.face(figure), tile=(lines * 4 // 5, lines))


def body_sheet(figure: str, lines: int, motion: str) -> UInt8:
    """Return the sheet of a figure's body, uint8 (H, W, 3). motion: of `MOTIONS`."""
    animation = fba.read(SHARED / MOTIONS[motion])
    scene = player.Scene(animation, figures.face(figure), body=figures.body(figure))
    return player.film_sheet(scene, FRAMES, tile=(lines * 4 // 5, lines), camera="body")


def main(arguments: list[str] | None = None) -> int:
    """Write the sheets that the command line asks for; return 1 if a recording is missing."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.figure_sheets",
        description=__doc__,
        formatter_class=argparse.RawTextHelpFormatter,
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--figure", default="alex", choices=list(figures.FIGURES))
    parser.add_argument("--lines", type=int, nargs="+", default=[360, 720, 1080])
    parser.add_argument("--only", choices=["face", "body"])
    given = parser.parse_args(arguments)
    given.folder.mkdir(parents=True, exist_ok=True)
    missing = 0
    for lines in given.lines:
        made = {"face": face_sheet(given.figure, lines)} if given.only != "body" else {}
        for motion in MOTIONS if given.only != "face" else ():
            if (SHARED / MOTIONS[motion]).exists():
                made[motion] = body_sheet(given.figure, lines, motion)
            else:
                print(f"{motion}: not made, there is no {SHARED / MOTIONS[motion]}", file=sys.stderr)
                missing = 1
        for name, pixels in made.items():
            path = given.folder / f"{given.figure}-{name}-{lines}.jpg"
            Image.fromarray(pixels).save(path, quality=QUALITY)
            print(path)
    return missing


if __name__ == "__main__":
    sys.exit(main())
