"""Lines, comments and the one-line header of ASCII FAP, BAP and EPF files.

Such files come from many programs and machines, with line ends of all kinds, tabs, byte order marks,
Latin-1 names and comments anywhere. They are read block by block. A line that is longer than these formats
need is an error, so that a file without line ends does not fill the memory.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, BinaryIO

from fba.errors import FormatError, Remedy
from fba.formats.text.frame_rates import parse_rate
from fba.recognition import HEAD_BYTES, recognition_hint
from fba.source import Path

if TYPE_CHECKING:
    from fba.formats.text._layout import Layout

BLOCK_BYTES = 1 << 20
"""Bytes that are read at once."""
MAX_LINE_BYTES = 1 << 16
"""The longest valid line has 297 numbers: 8 KiB even if each is a float with all its digits."""

_MARKS = ((b"\xff\xfe", "UTF-16"), (b"\xfe\xff", "UTF-16"), (b"\x00\x00\xfe\xff", "UTF-32"))
UTF8_MARK = b"\xef\xbb\xbf"
_VERSION = re.compile(rb"\d{1,3}(\.\d{1,3})?")
_MASK_BITS = frozenset((b"0", b"1"))
BODY_COLUMNS = 100
"""Masks of BAPs have more columns than this, those of FAPs fewer, in files of odd widths too."""
_MIN_MASK_BITS = 60
"""Fewest 0s and 1s in a line that make it a mask, not a header."""

GIVE_RATE = Remedy("source_rate", "give one with {}", "25")


class Lines:
    """Iterator over the lines of a text file, without line ends. `number` is that of the last line, 1-based.

    Raises FormatError for NUL bytes, UTF-16, and lines beyond `MAX_LINE_BYTES`.
    """

    def __init__(self, file: BinaryIO, size: int, path: Path) -> None:
        self.number = 0
        self.path = path
        self.head = b""  # the first bytes of the file, once the first line has been read
        self._lines = self._split(file, size)

    def __iter__(self) -> Iterator[bytes]:
        return self._lines

    def ends_here(self) -> bool:
        """Whether only blank lines and comments follow; skips them."""
        return not any(content(line) for line in self)

    def error(self, message: str, token: bytes | str | None = None, line: int | None = None) -> FormatError:
        """Return a FormatError that names the current line, or the given one."""
        text = decoded(token) if isinstance(token, bytes) else token
        return FormatError(message, path=self.path, line=line or self.number or None, token=text)

    def _split(self, file: BinaryIO, size: int) -> Iterator[bytes]:
        """Yield the lines of the first `size` bytes of a file."""
        rest = b""
        first = True
        while size > 0:
            try:
                block = file.read(min(BLOCK_BYTES, size))
            except OSError as error:
                raise self.error(f"cannot be read: {error.strerror or error}") from error
            if not block:
                break
            size -= len(block)
            if first:
                first = False
                self.head = block[:HEAD_BYTES]
                for mark, encoding in _MARKS:
                    if block.startswith(mark):
                        raise self.error(f"is {encoding} text; save it as UTF-8 or ASCII")
                block = block.removeprefix(UTF8_MARK)
                if not block:  # nothing but the mark
                    continue
            if b"\0" in block:
                line_number = self.number + (rest + block[: block.index(b"\0")]).count(b"\n") + 1
                raise self.error(
                    f"holds NUL bytes: binary data or a damaged file, not text{recognition_hint(self.head)}",
                    line=line_number,
                )
            data = rest + block
            lines = data.splitlines()
            # the last line may go on in the next block, and a final CR may be half of a CR LF
            rest = b"" if data.endswith(b"\n") else lines.pop() + (b"\r" if data.endswith(b"\r") else b"")
            for line in lines:
                self.number += 1
                self._check(line)
                yield line
            self._check(rest, 1)
        if rest:
            self.number += 1
            yield rest.removesuffix(b"\r")

    def _check(self, line: bytes, ahead: int = 0) -> None:
        """Raise FormatError for a line that is too long. ahead: its number minus the current line's."""
        if len(line) > MAX_LINE_BYTES + 1:
            raise self.error(
                f"a line of more than {MAX_LINE_BYTES} bytes: not a text file of this kind, "
                "or its line breaks are missing",
                line=self.number + ahead,
            )


def content(line: bytes) -> bytes:
    """Return the line without comment and surrounding blanks."""
    return line.partition(b"#")[0].strip()


def decoded(text: bytes) -> str:
    """Return text decoded as UTF-8, else as Latin-1, in which any bytes are valid."""
    try:
        return text.decode()
    except UnicodeDecodeError:
        return text.decode("latin-1")


def is_mask(tokens: list[bytes]) -> bool:
    """Whether these are the bits of a mask line, of any width."""
    return len(tokens) >= _MIN_MASK_BITS and _MASK_BITS.issuperset(tokens)


@dataclass(frozen=True)
class Header:
    """Header line of a FAP or BAP file. rate: frames per second. frames: the stated number, or None."""

    version: str
    name: str
    rate: Fraction
    frames: int | None


def is_header(tokens: list[bytes]) -> bool:
    """Whether a line can be a header: `<version> <name, with blanks> <rate> <frames>`."""
    return len(tokens) >= 3 and bool(_VERSION.fullmatch(tokens[0])) and not is_mask(tokens)


def parse_header(line: bytes, lines: Lines, rate: Fraction | None = None) -> Header:
    """Return the header in a line. rate: replaces that of the header. Raises FormatError."""
    tokens = line.split()
    if not is_header(tokens):
        what = "expected a header `<version> <name> <frame rate> <number of frames>`"
        raise lines.error(what + recognition_hint(lines.head), token=line.strip())
    try:
        frames = int(float(tokens[-1]))  # some programs write 107.0
    except (ValueError, OverflowError):
        raise lines.error("the header must end in the number of frames", token=tokens[-1]) from None
    if rate is None:
        try:
            rate = parse_rate(decoded(tokens[-2]))
        except FormatError as error:
            reason = str(error).partition(" (found")[0]
            raise lines.error(reason, token=tokens[-2]).with_remedies(GIVE_RATE) from None
    name = decoded(b" ".join(tokens[1:-2]))
    return Header(decoded(tokens[0]), name, rate, frames if frames >= 0 else None)


def sniff_layout(head: bytes, layout: Layout) -> bool:
    """Whether a file with this beginning has this layout: by its mask width, else by its version."""
    version, width = sniff_columns(head)
    if not width:
        return version in layout.versions
    known = [w for count in layout.widths for w in (count, count + 1)]
    same_part = (width >= BODY_COLUMNS) == (layout.columns >= BODY_COLUMNS)
    return width in known or (version in layout.versions and same_part)


def sniff_columns(head: bytes) -> tuple[str, int]:
    """Return the version ("" without a header) and the width of the first mask (0 without one).

    head: the beginning of a FAP or BAP file. ("", 0) for files of other kinds.
    """
    if b"\0" in head:
        return "", 0
    version = ""
    for line in head.removeprefix(UTF8_MARK).splitlines():
        if not content(line):
            continue
        tokens = line.split()
        if is_mask(content(line).split()):
            return version, len(content(line).split())
        if version or not is_header(tokens):
            return "", 0  # neither kind has such a second line
        version = decoded(tokens[0])
        if not _is_number(tokens[-1]) or len(tokens) < 3:
            return "", 0
    return version, 0


def _is_number(text: bytes) -> bool:
    return bool(re.fullmatch(rb"[0-9.]{1,40}", text))
