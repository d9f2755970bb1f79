"""Read the frames of FAP and BAP files: pairs of lines, a mask and `<frame number> <values>`.

NumPy parses the numbers of many lines at once. If that fails, the lines are parsed one by one, so that the
error names the line and the token.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.arrays import Bool, Int32, Int64
from fba.errors import FormatError, Remedy, warn
from fba.formats.text._layout import Layout
from fba.formats.text._lines import GIVE_RATE, Header, Lines, content, is_header, is_mask, parse_header
from fba.formats.text._values import FRAME_NUMBER_MAX, Row, ValueParser
from fba.formats.text.frame_rates import parse_rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, open_source

BATCH_LINES = 2048
"""Most lines that are parsed at once."""
BATCH_BYTES = 1 << 20
"""Most bytes that are parsed at once."""
CACHED_MASKS = 4096
"""Most mask lines that are cached: a file whose masks are all spelt differently must not fill the memory."""
SALVAGE = Remedy("salvage", "{} reads the frames before it", "True")


@dataclass(frozen=True, eq=False)
class Frames:
    """Content of a FAP or BAP file. index: int64 (T,); mask: bool (T, columns); slots: int32 (T, slots)."""

    header: Header
    index: Int64
    mask: Bool
    slots: Int32


def read_frames(
    path: Path,
    layout: Layout,
    *,
    source_rate: str | float | Fraction | None = None,
    name: str | None = None,
    salvage: bool = False,
    angle_scale: Fraction | float = 1,
    limits: Limits = DEFAULT_LIMITS,
) -> Frames:
    """Return the header and all frames of a file.

    The options are those of `fba.formats.text.fap.read_fap`. Raises FormatError; warns with FbaWarning.
    """
    rate = None if source_rate is None else parse_rate(source_rate)
    try:
        scale = float(angle_scale)
    except (TypeError, ValueError, OverflowError):
        scale = 0.0
    if not np.isfinite(scale) or not scale:
        raise FormatError(f"angle_scale must be a number other than 0, not {str(angle_scale)[:40]}")
    file, size = open_source(path)
    with file:
        lines = Lines(file, size, path)
        reader = _Reader(lines, layout, scale)
        header, first_mask = _read_header(lines, layout, rate, name)
        try:
            reader.read(first_mask)
            reader.flush()
        except FormatError as error:
            reader.flush(salvage=True)
            if not salvage or not reader.count:
                raise
            warn(f"{error.finding}; salvaged the {reader.count} frames before the damage", stacklevel=3)
    limits.check_frames(reader.count, f"{path}: the file")
    return reader.frames(header)


def _read_header(
    lines: Lines, layout: Layout, rate: Fraction | None, name: str | None
) -> tuple[Header, bytes | None]:
    """Return the header and None; without a header, one made from the options, and the first mask line."""
    for line in lines:
        body = content(line)
        if not body:
            continue
        tokens = body.split()
        if is_mask(tokens):
            if rate is None:
                raise lines.error(
                    "the file begins with frames: it has no header, so its frame rate is unknown"
                ).with_remedies(GIVE_RATE)
            return Header("", name or "", rate, None), line
        # a name may contain "#": cut the comment off only if the line is no header with it
        try:
            header = parse_header(line, lines, rate)
        except FormatError:
            if b"#" not in line:
                raise
            header = parse_header(body, lines, rate)
        if header.version not in layout.versions:
            warn(
                f"{lines.path}:{lines.number}: {layout.kind} version {header.version} is unknown "
                f"(known: {', '.join(layout.versions)}); read like version {layout.version}",
                stacklevel=4,
            )
        return header if name is None else Header(header.version, name, header.rate, header.frames), None
    raise lines.error("holds no data, only blank lines and comments")


class _Reader:
    """Reader of a file, batch by batch. count: of the frames parsed so far."""

    def __init__(self, lines: Lines, layout: Layout, angle_scale: float) -> None:
        self.lines = lines
        self.layout = layout
        self.values = ValueParser(layout, angle_scale)
        self.count = 0
        self._masks: dict[bytes, int] = {}
        self._bits: list[Bool] = []  # distinct masks, each (columns,)
        # for each mask, bool (1 + slots,): the numbers on its frame lines, the frame number first
        self._present: list[Bool] = []
        self._tokens: list[int] = []  # their count
        self._extra: list[bool] = []  # whether the superfluous column of the mask is 1
        self._pending: list[Row] = []
        self._blocks: list[tuple[Int64, Int32, Int64, Int64]] = []  # numbers, slots, masks, lines

    def read(self, first_mask: bytes | None) -> None:
        """Read all lines; the last batch stays pending until `flush`. first_mask: a mask read already."""
        mask = None if first_mask is None else self._mask_id(first_mask)
        pending_bytes = 0
        masks, tokens = self._masks, self._tokens
        for line in self.lines:
            if mask is None:
                mask = masks.get(line)
                if mask is None and content(line):
                    mask = self._mask_id(line)
                continue
            body = line.partition(b"#")[0] if b"#" in line else line
            count = len(body.split())
            if not count:
                continue
            if count != tokens[mask]:
                body = self._drop_extra_value(body, mask)
            self._pending.append(Row(body, self.lines.number, mask, self._present[mask]))
            pending_bytes += len(body)
            mask = None
            if len(self._pending) >= BATCH_LINES or pending_bytes >= BATCH_BYTES:
                self.flush()
                pending_bytes = 0
        if mask is not None:
            raise self.lines.error("the last frame is cut: a mask without values").with_remedies(SALVAGE)

    def flush(self, salvage: bool = False) -> None:
        """Parse the pending lines. salvage: stop at the first damaged line instead of raising."""
        rows, self._pending = self._pending, []
        if not rows or self._parse(rows):
            return
        for row in rows:
            if self._parse([row]):
                continue
            if salvage:
                return
            message, token = self.values.find_fault(row) or ("the values cannot be read", b"")
            raise self.lines.error(message, token, row.number)

    def frames(self, header: Header) -> Frames:
        """Return the parsed frames, with increasing numbers; warns of rounded values and a wrong count."""
        layout, path = self.layout, self.lines.path
        if not self._blocks:
            if header.frames:
                raise FormatError(
                    f"the header promises {header.frames} frames, but the file has none", path=path
                )
            empty = np.zeros((0, layout.columns), dtype=bool)
            return Frames(header, np.zeros(0, np.int64), empty, np.zeros((0, layout.slots), dtype=np.int32))
        index, slots, masks, numbers = (
            np.concatenate([block[part] for block in self._blocks]) for part in range(4)
        )
        self._blocks.clear()
        if self.values.rounded:
            warn(
                f"{path}: {self.values.rounded} values are not integers, the first on line "
                f"{self.values.rounded_line}; rounded half away from zero",
                stacklevel=4,
            )
        if header.frames is not None and header.frames != len(index):
            warn(
                f"{path}: the header says {header.frames} frames, the file has {len(index)}; all are read",
                stacklevel=4,
            )
        index = _renumber(index, numbers, path)
        return Frames(header, index, np.stack(self._bits)[masks], slots)

    def _mask_id(self, line: bytes) -> int:
        """Return the position of a mask line in `_bits`; FormatError if it is no mask."""
        layout = self.layout
        tokens = content(line).split()
        wrong = next((token for token in tokens if token not in (b"0", b"1")), None)
        widths = " or ".join(map(str, layout.widths))
        if wrong is not None:
            what = f"expected a mask line of {widths} bits 0 or 1"
            if is_header(tokens):
                what += "; this looks like a second header: split joined files into one each"
            raise self.lines.error(what, token=wrong)
        # a known program adds a column at the end
        width = len(tokens) - 1 if len(tokens) - 1 in layout.widths else len(tokens)
        if width not in layout.widths:
            if len(tokens) < max(layout.widths) and self._at_end():
                what = f"the last frame is cut: {len(tokens)} of {widths} mask bits"
                raise self.lines.error(what).with_remedies(SALVAGE)
            raise self.lines.error(f"expected a mask of {widths} bits, found {len(tokens)}")
        bits = np.zeros(layout.columns, dtype=bool)
        bits[:width] = [token == b"1" for token in tokens[:width]]
        present = np.concatenate([[True], bits[layout.parameter]])
        number = len(self._bits)
        self._bits.append(bits)
        self._present.append(present)
        self._tokens.append(int(present.sum()))
        self._extra.append(len(tokens) > width and tokens[-1] == b"1")
        if len(self._masks) < CACHED_MASKS:
            self._masks[line] = number
        return number

    def _drop_extra_value(self, body: bytes, mask: int) -> bytes:
        """Return the line without the value of a superfluous mask column; FormatError for another fault."""
        tokens, wanted = body.split(), self._tokens[mask]
        if self._extra[mask] and len(tokens) == wanted + 1:
            return b" ".join(tokens[:-1])
        count = f"{len(tokens) - 1} values"
        number = self.lines.number
        if len(tokens) < wanted and self._at_end():
            raise self.lines.error(
                f"the last frame is cut: {count} of {wanted - 1}", line=number, token=tokens[-1]
            ).with_remedies(SALVAGE)
        raise self.lines.error(
            f"the mask above asks for {wanted - 1} values behind the frame number, found {count}",
            line=number,
            token=tokens[min(wanted, len(tokens) - 1)],
        )

    def _at_end(self) -> bool:
        """Whether no content follows."""
        number = self.lines.number
        try:
            return self.lines.ends_here()
        except FormatError:
            return False
        finally:
            self.lines.number = number

    def _parse(self, rows: list[Row]) -> bool:
        """Parse lines and store their frames; False, with nothing stored, if any of them has a fault."""
        parsed = self.values.parse(rows)
        if parsed is None:
            return False
        masks = np.array([row.mask for row in rows], dtype=np.int64)
        numbers = np.array([row.number for row in rows], dtype=np.int64)
        self._blocks.append((*parsed, masks, numbers))
        self.count += len(rows)
        return True


def _renumber(index: Int64, lines: Int64, path: Path) -> Int64:
    """Return frame numbers that increase: where a number does not, the frame follows the frame before.

    Such files are joined from others, or their program writes 0 for every frame. Warns with FbaWarning.
    Raises FormatError for numbers that would be too large.
    """
    steps = np.diff(index)
    repeated = steps <= 0
    if not repeated.any():
        return index
    first = int(np.argmax(repeated)) + 1
    warn(
        f"{path}:{int(lines[first])}: frame number {int(index[first])} comes after {int(index[first - 1])}; "
        f"{int(repeated.sum())} frames whose number does not increase are read as the next ones in time",
        stacklevel=5,
    )
    renumbered: Int64 = np.concatenate([index[:1], index[0] + np.cumsum(np.where(repeated, 1, steps))])
    if renumbered[-1] > FRAME_NUMBER_MAX:
        beyond = int(np.argmax(renumbered > FRAME_NUMBER_MAX))
        raise FormatError(
            f"the frame would get the number {int(renumbered[beyond])}, at most {FRAME_NUMBER_MAX} is "
            "allowed; number the frames from 0",
            path=path,
            line=int(lines[beyond]),
        )
    return renumbered
