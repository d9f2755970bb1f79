"""Draw the references that tests/player/gl/test_reference_pictures.py compares with, and a sheet to look at.

    python tests/helpers/make_references.py [--only NAME ...] [--sheet FILE.png]

Look at the sheet before you commit what this wrote. Needs OpenGL; software OpenGL, as in CI. With --dry it
only says how far what is drawn now is from the references; with GALLIUM_DRIVER=softpipe in the environment
that is how far another rasteriser is.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from picture_difference import difference, laid_on_chequers
from reference_cases import FOLDER, Drawer, cases

COLUMNS, LABEL = 7, 14
SCALE = 2


def main() -> None:
    """Draw them all, and say which changed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", default=list(cases()), metavar="NAME")
    parser.add_argument("--sheet", type=Path, help="a picture of all of them")
    parser.add_argument("--dry", action="store_true", help="write no references")
    options = parser.parse_args()
    shown = []
    with Drawer() as draw:
        for name in options.only:
            case = cases()[name]
            pixels = draw(case)
            said = "new"
            if case.path.is_file():
                with Image.open(case.path) as old:
                    said = str(difference(np.asarray(old), pixels))
            print(f"{name}: {said}")  # noqa: T201
            clear = bool((pixels[..., 3] < 255).any())
            if not options.dry:
                Image.fromarray(pixels if clear else pixels[..., :3].copy()).save(case.path, optimize=True)
            shown.append((name, Image.fromarray((laid_on_chequers(pixels) * 255).round().astype(np.uint8))))
    for path in set(FOLDER.glob("*.png")) - {case.path for case in cases().values()}:
        print(f"{path.name} belongs to no case: remove it")  # noqa: T201
    if options.sheet is not None:
        options.sheet.parent.mkdir(parents=True, exist_ok=True)
        sheet(shown).save(options.sheet)


def sheet(pictures: list[tuple[str, Image.Image]]) -> Image.Image:
    """All pictures, twice their size, with their names."""
    wide, high = 160 * SCALE, 160 * SCALE + LABEL
    rows = -(-len(pictures) // COLUMNS)
    whole = Image.new("RGB", (COLUMNS * wide, rows * high), (24, 26, 30))
    draw = ImageDraw.Draw(whole)
    for number, (name, picture) in enumerate(pictures):
        x, y = number % COLUMNS * wide, number // COLUMNS * high
        whole.paste(
            picture.resize((picture.width * SCALE, picture.height * SCALE), Image.Resampling.NEAREST),
            (x, y + LABEL),
        )
        draw.text((x + 2, y), name, fill=(230, 230, 230))
    return whole


if __name__ == "__main__":
    main()
