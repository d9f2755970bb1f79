"""Materials of an OBJ file: its .mtl files, colours and one picture each."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

from fba.errors import FbaWarning, ModelError
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
        """Return the PNG or JPEG of this name beside a file; b"" with an FbaWarning where it is neither.

        where: the line that names it.
        """
        path = find_beside(file, name)
        if path is None:
            warnings.warn(
                f"{where}: the picture {name!r} is not in the folder of the file; left out",
                FbaWarning,
                stacklevel=5,
            )
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
        warnings.warn(
            f"{path}: the file of its materials, {library!r}, is not in its folder; left out",
            FbaWarning,
            stacklevel=4,
        )
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
        warnings.warn(f"{where}: {error}", FbaWarning, stacklevel=5)
        return b""
    if not content.startswith(PICTURES):
        warnings.warn(f"{where}: {path.name!r} is neither PNG nor JPEG; left out", FbaWarning, stacklevel=5)
        return b""
    return content
