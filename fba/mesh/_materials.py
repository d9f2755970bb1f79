"""Materials of an OBJ file: its .mtl files, colours and one picture each; and the pixels of pictures."""

from __future__ import annotations

import io
import math
import os
from pathlib import Path

import numpy as np

from fba.arrays import UInt8
from fba.errors import ModelError, warn
from fba.limits import DEFAULT_LIMITS
from fba.mesh._meshes import Material
from fba.text_files import find_beside, parse_number, read_bytes, read_words

MAX_PICTURE = 1 << 27
"""Largest picture, in bytes."""
PICTURES = (b"\x89PNG", b"\xff\xd8\xff")
"""How PNG and JPEG files begin."""


class Pictures:
    """Reads the pictures that .mtl files name, each once, however many materials name it."""

    def __init__(self) -> None:
        self._known: dict[Path, bytes] = {}

    def read(self, file: os.PathLike[str], name: str, where: str) -> bytes:
        """Return a PNG or JPEG beside a file; b"" with a warning if it is neither. where: its line."""
        path = find_beside(file, name)
        if path is None:
            warn(f"{where}: the picture {name!r} is not in the folder of the file; left out", stacklevel=5)
            return b""
        if path not in self._known:
            self._known[path] = _picture(path, where)
        return self._known[path]


def read_mtl(
    path: str | os.PathLike[str], library: str, pictures: Pictures | None = None
) -> dict[str, Material]:
    """Return materials by name of an .mtl file that lies beside an OBJ file; none where it is missing.

    pictures: a cache of the pictures already read.

    Kd is the colour (sRGB, as writers put it there), Ns the shine, map_Kd the picture: PNG or JPEG
    beside the file, others are left out with an FbaWarning. Raises ModelError naming the line.
    """
    file = find_beside(path, library)
    materials: dict[str, Material] = {}
    pictures = Pictures() if pictures is None else pictures
    if file is None:
        warn(f"{path}: the file of its materials, {library!r}, is not in its folder; left out", stacklevel=4)
        return materials
    name: str | None = None
    colour, rough, picture = (0.8, 0.8, 0.8), 0.6, b""

    def finish() -> None:
        if name is not None:
            materials[name] = Material(name, (1.0, 1.0, 1.0) if picture else colour, rough, picture or None)

    for where, tokens in read_words(file):
        if len(tokens) < 2:
            continue
        if tokens[0] == "newmtl":
            finish()
            name, colour, rough, picture = " ".join(tokens[1:]), (0.8, 0.8, 0.8), 0.6, b""
        elif tokens[0] == "Kd" and len(tokens) >= 4:
            r, g, b = (min(max(parse_number(t, where, "a colour"), 0.0), 1.0) ** 2.2 for t in tokens[1:4])
            colour = (r, g, b)
        elif tokens[0] == "Ns":
            rough = max(0.05, (2.0 / (max(parse_number(tokens[1], where, "Ns"), 0.0) + 2.0)) ** 0.25)
        elif tokens[0] == "map_Kd":
            picture = pictures.read(file, tokens[-1], where)
    finish()
    return materials


def _picture(path: Path, where: str) -> bytes:
    try:
        content = read_bytes(path, MAX_PICTURE)
    except ModelError as error:
        warn(f"{where}: {error}", stacklevel=5)
        return b""
    if not content.startswith(PICTURES):
        warn(f"{where}: {path.name!r} is neither PNG nor JPEG; left out", stacklevel=5)
        return b""
    return content


def read_pixels(texture: bytes, most: float = math.inf) -> UInt8 | None:
    """Return uint8 (H, W, 4) of a PNG, JPEG or WebP picture, at most `most` pixels wide and high.

    None where it is damaged, or has more pixels than the default limits allow.
    """
    from PIL import Image

    try:
        with Image.open(io.BytesIO(texture), formats=("PNG", "JPEG", "WEBP")) as image:
            if image.width * image.height > DEFAULT_LIMITS.pixels:
                return None
            factor = min(most / max(image.size), 1.0)
            whole: Image.Image = image.convert("RGBA")
            if factor < 1:
                size = max(int(image.width * factor), 1), max(int(image.height * factor), 1)
                whole = whole.resize(size, Image.Resampling.LANCZOS)
            return np.asarray(whole)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
