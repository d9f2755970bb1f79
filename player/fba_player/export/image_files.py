"""Pictures in files: single ones as PNG or JPEG, and numbered ones in place of a film.

The names of numbered pictures: frames/00000.png, frames/00001.png, ...
"""

from __future__ import annotations

import os
import re
import zlib
from pathlib import Path
from typing import BinaryIO

import numpy as np

from fba.arrays import UInt8
from fba.atomic import PathLike, atomic, write_error
from fba.errors import FormatError, Remedy, UnsupportedError
from fba_player.export._recorder import FILMS

PICTURES = (".png", ".jpg", ".jpeg")
JPEG_QUALITY = 90
NUMBER = re.compile(r"%(0?\d{0,2})d")
NAMES = "%05d.png"
"""Names of the pictures where only a folder is given."""


def write_picture(path: PathLike, pixels: UInt8, *, transparent: bool = False) -> Path:
    """Write pixels, uint8 (H, W, 3 or 4), sRGB, as .png or .jpg, atomically; return the path.

    transparent: keeps the fourth channel, the opacity (not premultiplied); PNG only. Raises UnsupportedError
    for another suffix or a transparent JPEG, FormatError if it cannot be written.
    """
    target = Path(path)
    check_picture(target, transparent=transparent)
    with atomic(target) as file:
        put_picture(file, pixels, target.suffix, transparent=transparent)
    return target


def put_picture(file: BinaryIO, pixels: UInt8, suffix: str, *, transparent: bool = False) -> None:
    """Write pixels as `write_picture` does, into an open file."""
    from PIL import Image

    channels = slice(None) if transparent else slice(3)
    picture = Image.fromarray(np.ascontiguousarray(pixels[..., channels]))
    if suffix.lower() == ".png":
        # Searching for repeats other than runs takes five times as long and finds little in shaded skin:
        # files are as large without it, and smaller than with a quick search.
        picture.save(file, format="PNG", compress_type=zlib.Z_RLE)
    else:
        picture.save(file, format="JPEG", quality=JPEG_QUALITY)


def check_picture(target: Path, *, transparent: bool) -> None:
    """Raise UnsupportedError if the suffix is not a picture's, or the picture cannot be transparent."""
    suffix = target.suffix.lower()
    if suffix not in PICTURES:
        raise UnsupportedError(
            f"{target}: pictures are written as .png or .jpg, not as {suffix or 'a bare name'}",
            what=f"rendering to {suffix or 'no suffix'}",
        )
    if transparent and suffix != ".png":
        raise UnsupportedError(
            f"{target}: only PNG pictures can be transparent; name it {target.with_suffix('.png').name}",
            what=f"transparency in {suffix}",
        )


class Numbered:
    """The names of a sequence of pictures.

    path: a name with %05d, or %d, where the number goes, or a folder with a slash at its end.
    """

    def __init__(self, path: PathLike) -> None:
        text = os.fspath(path)
        if text.endswith(("/", os.sep)):
            text = os.path.join(text, NAMES)
        self.folder, self.name = Path(text).parent, Path(text).name
        numbers = NUMBER.findall(self.name)
        if len(numbers) != 1 or self.name.count("%") != 1 or "%" in str(self.folder):
            raise UnsupportedError(
                f"{text}: the names of numbered pictures have their number at one place of the last part, "
                f"written %05d: e.g. frames/{NAMES}",
                what="names of pictures",
            )
        digits = numbers[0].lstrip("0")
        self._width = int(digits) if digits else 0
        if self._width and not numbers[0].startswith("0"):
            raise UnsupportedError(
                f"{text}: write %0{numbers[0]}d, so that the numbers have zeros in front",
                what="names of pictures",
            )
        self._before, _, self._after = NUMBER.split(self.name)

    def path(self, number: int) -> Path:
        """Return the path of the picture of a frame, counted from 0."""
        return self.folder / f"{self._before}{number:0{self._width}d}{self._after}"

    def existing(self) -> list[int]:
        """Return the numbers of the pictures that exist, ascending; FormatError for an unreadable folder."""
        try:
            names = os.listdir(self.folder)
        except FileNotFoundError:
            return []
        except OSError as error:
            raise write_error(self.folder, error, "the folder cannot be read") from error
        pattern = re.compile(f"{re.escape(self._before)}(\\d+){re.escape(self._after)}")
        numbers = [int(match[1]) for name in names if (match := pattern.fullmatch(name))]
        return sorted(number for number in numbers if self.path(number).exists())


def is_sequence(path: PathLike) -> bool:
    """Return whether a path is of numbered pictures: a % in its last part, or a slash at its end."""
    text = os.fspath(path)
    return text.endswith(("/", os.sep)) or "%" in os.path.basename(text)


def is_film(path: PathLike) -> bool:
    """Return whether a path stands for many pictures: a film, or numbered pictures."""
    return os.path.splitext(os.fspath(path))[1].lower() in FILMS or is_sequence(path)


class Sequence:
    """A `Sink` that writes one picture per frame, from number 0.

    names: see `Numbered`. count: number of pictures that will be written. transparent: PNG with an alpha
    channel. replace: whether pictures of these names may be overwritten. The folder is made if it is missing.

    Raises FormatError if such pictures exist and replace is False, or if pictures of an older, longer
    sequence would be left; UnsupportedError for another suffix than those of pictures.
    """

    def __init__(
        self, names: Numbered, count: int, *, transparent: bool = False, replace: bool = False
    ) -> None:
        check_picture(Path(names.name), transparent=transparent)
        existing = names.existing()
        if existing and not replace:
            raise FormatError(
                f"{_range_text(names, existing)} in this folder already; choose another folder",
                path=names.folder,
            ).with_remedies(Remedy("replace", "or have them replaced with {}", "True"))
        if beyond := [number for number in existing if number >= count]:
            raise FormatError(
                f"{_range_text(names, beyond)} left from a longer sequence, and would follow the {count} new "
                "pictures; delete them, or choose another folder",
                path=names.folder,
            )
        self.stopped = False
        self._names, self._transparent = names, transparent
        try:
            names.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise write_error(names.folder, error, "the folder cannot be made") from error

    def write(self, pixels: UInt8, number: int) -> None:
        """Write a picture, uint8 (H, W, 4), as that of frame `number`."""
        write_picture(self._names.path(number), pixels, transparent=self._transparent)

    def finish(self, count: int) -> Path:
        """Return the folder of the pictures."""
        return self._names.folder

    def abort(self) -> None:
        """Do nothing: finished pictures stay."""


def _range_text(names: Numbered, numbers: list[int]) -> str:
    first = names.path(numbers[0]).name
    if len(numbers) == 1:
        return f"{first} is"
    return f"{first} to {names.path(numbers[-1]).name} ({len(numbers)} pictures) are"
