"""Read EPF files as plane settings.

Each line has a tag and its values; `#` begins a comment. `FBM` opens the block of a plane. Masks, quantisers,
gender, coding type and ISI stay in force until they change. Rate, time code, skip and the four lists of
limits apply to the plane of their block. Only I planes carry masks, quantisers, lists, rates and time codes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from fba.arrays import Bool, UInt8
from fba.codec import FrameRate, PartSettings, PlaneSettings, RangeLists, TimeCode
from fba.codec.settings import RANGE_CODE_MAX, RANGE_UNIT
from fba.encoder_options import QUANT_MAX
from fba.errors import warn
from fba.formats.epf._tags import BODY, FACE, PARTS, TAGS, Part
from fba.formats.text._lines import Lines, content, decoded
from fba.formats.text._values import FRAME_NUMBER_MAX
from fba.limits import DEFAULT_LIMITS, Limits
from fba.recognition import recognition_hint
from fba.source import Path, open_source

SKIP_MAX = 1_000_000
"""Most frames that a plane may skip: 11 hours at 25 frames/s. More is a mistake in the file."""
PLANE_BYTES = 600
"""Memory of a plane's settings."""


@dataclass
class _Tag:
    """A tag's values, and the line (1-based) that it stands on."""

    values: list[bytes]
    line: int


@dataclass
class _State:
    """Settings of a part in force. sent: those of its last I plane."""

    types: tuple[int, ...] | None = None
    mask: Bool | None = None
    quant: int | None = None
    sent: PartSettings | None = None


@dataclass
class _Reader:
    """Reader of blocks into `planes`. frames: count of planes and of the frames that they skip."""

    lines: Lines
    states: dict[int, _State] = field(default_factory=lambda: {part.bit: _State() for part in PARTS})
    intra: bool | None = None
    gender: int = 0
    coding_type: int = 0
    planes: list[PlaneSettings] = field(default_factory=list)
    frames: int = 0

    def add_plane(self, block: dict[str, _Tag]) -> None:
        """Append the plane that a block describes. FormatError if the block contradicts itself."""
        opened = block["FBM"].line
        parts_mask = self.number(block, "FBM", 1, 3)
        if "ISI" in block:
            self.intra = bool(self.number(block, "ISI", 0, 1))
        if self.intra is None:
            raise self.lines.error(
                "the first block must contain 'ISI 1', because a stream begins with an I plane", line=opened
            )
        self.gender = self.number(block, "GDR", 0, 1) if "GDR" in block else self.gender
        self.coding_type = self.number(block, "CDM", 0, 1) if "CDM" in block else self.coding_type
        frames: dict[int, int] = {}
        settings: dict[int, PartSettings] = {}
        for part in PARTS:
            if not parts_mask & part.bit:
                stray = next((tag for tag in part.tags if tag in block), None)
                if stray:
                    raise self.lines.error(
                        f"a {part.word} tag in a block without a {part.word} (FBM {parts_mask})",
                        token=stray,
                        line=block[stray].line,
                    )
                continue
            if part.frame not in block:
                raise self.lines.error(
                    f"a block with a {part.word} needs {part.frame}, the number of the frame to code",
                    line=opened,
                )
            frames[part.bit] = self.number(block, part.frame, -FRAME_NUMBER_MAX, FRAME_NUMBER_MAX)
            settings[part.bit] = self.part(part, block, opened)
        self.planes.append(
            PlaneSettings(
                intra=self.intra,
                face_frame=frames.get(FACE),
                body_frame=frames.get(BODY),
                face=settings.get(FACE),
                body=settings.get(BODY),
                frame_rate=self.frame_rate(block),
                time_code=self.time_code(block),
                skip=self.skip(block),
            )
        )
        self.frames += 1 + self.planes[-1].skip

    def part(self, part: Part, block: dict[str, _Tag], opened: int) -> PartSettings:
        """Return the settings of a part in this plane. opened: the first line of its block."""
        state = self.states[part.bit]
        changed = [tag for tag in (part.mask, part.quant) if tag in block]
        if part.mask in block:
            types, mask = self.masks(block, part)
            if state.mask is not None and state.types == types and np.array_equal(state.mask, mask):
                changed.remove(part.mask)
            state.types, state.mask = types, mask
        if part.quant in block:
            quant = self.number(block, part.quant, 0, QUANT_MAX)
            if state.quant == quant:
                changed.remove(part.quant)
            state.quant = quant
        list_tags = [tag for tag in part.lists if tag in block]
        if not self.intra:
            if state.sent is None:
                raise self.lines.error(
                    f"a P plane (ISI 0) with a {part.word} before any I plane with one", line=opened
                )
            if list_tags:
                raise self.lines.error(
                    "limits can only be sent with an I plane (ISI 1)",
                    token=list_tags[0],
                    line=block[list_tags[0]].line,
                )
            for tag in changed:
                warn(
                    f"{self.lines.path}:{block[tag].line}: {tag} in the block of a P plane (ISI 0) "
                    "takes effect at the next I plane",
                    stacklevel=5,
                )
            return state.sent
        for tag, value in ((part.mask, state.mask), (part.quant, state.quant)):
            if value is None:
                raise self.lines.error(
                    f"an I plane with a {part.word} needs {tag}, in its block or an earlier one", line=opened
                )
        for tag in list_tags:
            if part.quant in block and block[part.quant].line > block[tag].line:
                raise self.lines.error(
                    f"{part.quant} must stand before the limits that it scales",
                    token=tag,
                    line=block[tag].line,
                )
        assert state.types is not None
        assert state.mask is not None
        assert state.quant is not None
        ranges = RangeLists(
            *(
                self.limits(block, part, tag, sign)
                for tag, sign in zip(part.lists, (1, -1, 1, -1), strict=True)
            )
        )
        state.sent = PartSettings(state.types, state.mask, state.quant, self.gender, self.coding_type, ranges)
        return state.sent

    def masks(self, block: dict[str, _Tag], part: Part) -> tuple[tuple[int, ...], Bool]:
        """Return the mask type of each group, and the mask, bool (parameters,)."""
        tag = block[part.mask]
        values = iter(self.numbers(tag, 0, 3))
        mask = np.zeros(part.count, dtype=bool)
        types: list[int] = []
        used = 0
        for number, group in enumerate(part.groups(), start=1):
            kind = next(values, None)
            bits: list[int | None] = [0] * len(group) if kind == 0 else [1] * len(group)
            if kind == 2 and part.bit == BODY:
                raise self.lines.error(
                    f"mask type 2 in group {number}: it exists for faces only; use 0, 1 or 3",
                    token="2",
                    line=tag.line,
                )
            if kind in (1, 2):
                bits = [next(values, None) for _ in group]
            if kind is None or None in bits:
                raise self.lines.error(
                    f"{part.mask} ends within group {number} of {len(part.groups())}: per group a type 0..3, "
                    "and behind type 1 or 2 a mask bit for each member",
                    line=tag.line,
                )
            used += 1 + (len(group) if kind in (1, 2) else 0)
            types.append(kind)
            for member, bit in zip(group, bits, strict=True):
                if bit not in (0, 1):
                    raise self.lines.error(
                        f"mask bits of group {number} are 0 or 1", token=str(bit), line=tag.line
                    )
                mask[member - 1] = bit
        if used != len(tag.values):
            raise self.lines.error(
                f"{part.mask} has more values than its {len(types)} groups need",
                token=tag.values[used],
                line=tag.line,
            )
        mask.flags.writeable = False
        return tuple(types), mask

    def limits(self, block: dict[str, _Tag], part: Part, name: str, sign: int) -> UInt8 | None:
        """Return the range codes of a list tag, uint8 (parameters,); None if the block lacks the tag.

        sign: +1 for maxima, -1 for minima.
        """
        if name not in block:
            return None
        tag = block[name]
        wanted = part.count - part.first + 1
        if len(tag.values) != wanted:
            raise self.lines.error(f"{name} needs {wanted} limits, found {len(tag.values)}", line=tag.line)
        largest = RANGE_CODE_MAX * RANGE_UNIT
        numbers = self.numbers(tag, -(2**31), 2**31 - 1)
        codes = np.zeros(part.count, dtype=np.uint8)
        for column, value in enumerate(numbers, start=part.first - 1):
            code = -(-sign * value // RANGE_UNIT)  # away from 0: maxima up, minima down
            if not 0 <= code <= RANGE_CODE_MAX:
                kind, bounds = ("maximum", f"0..{largest}") if sign > 0 else ("minimum", f"{-largest}..0")
                raise self.lines.error(
                    f"the {kind} of {'FAP' if part.bit == FACE else 'BAP'} {column + 1} must lie in {bounds}",
                    token=tag.values[column - part.first + 1],
                    line=tag.line,
                )
            codes[column] = code
        codes.flags.writeable = False
        return codes

    def time_tag(self, block: dict[str, _Tag], names: list[str]) -> tuple[str, list[int]] | None:
        """Return name and numbers of the first of these tags that the block has, or None.

        FormatError if two of them differ: a plane has one time for face and body.
        """
        present = [(name, self.numbers(block[name], 0, SKIP_MAX)) for name in names if name in block]
        if not present:
            return None
        if len(present) > 1 and present[0][1] != present[1][1]:
            raise self.lines.error(
                f"{names[0]} and {names[1]} of one block must agree: a plane has one time",
                line=block[names[1]].line,
            )
        return present[0]

    def frame_rate(self, block: dict[str, _Tag]) -> FrameRate | None:
        """Return the frame rate that a block sends, or None."""
        tag = self.time_tag(block, [part.rate for part in PARTS])
        if tag is None:
            return None
        values = self.fields(block, tag, ("rate", 255), ("seconds", 15), ("frequency_offset", 1))
        rate = FrameRate(*values)
        if not rate.fraction:
            raise self.lines.error("the frame rate must be more than 0", line=block[tag[0]].line)
        return rate

    def time_code(self, block: dict[str, _Tag]) -> TimeCode | None:
        """Return the time code that a block sends, or None."""
        tag = self.time_tag(block, [part.time for part in PARTS])
        if tag is None:
            return None
        hours, minutes, marker, seconds = self.fields(
            block, tag, ("hours", 31), ("minutes", 63), ("marker", 1), ("seconds", 63)
        )
        return TimeCode(hours, minutes, seconds, marker)

    def skip(self, block: dict[str, _Tag]) -> int:
        """Return the number of frames to skip after the plane."""
        tag = self.time_tag(block, [part.skip for part in PARTS])
        return 0 if tag is None else self.fields(block, tag, ("frames to skip", SKIP_MAX))[0]

    def fields(
        self, block: dict[str, _Tag], tag: tuple[str, list[int]], *wanted: tuple[str, int]
    ) -> list[int]:
        """Return the numbers of a tag. wanted: name and largest value of each.

        FormatError for another count of numbers, and for larger ones.
        """
        name, values = tag
        line = block[name].line
        if len(values) != len(wanted):
            names = " ".join(field for field, _ in wanted)
            raise self.lines.error(f"{name} needs {len(wanted)} numbers: {names}", line=line)
        for value, (what, largest) in zip(values, wanted, strict=True):
            if value > largest:
                raise self.lines.error(
                    f"{what} of {name} must lie in 0..{largest}", token=str(value), line=line
                )
        if len(wanted) > 1 and not self.intra:
            raise self.lines.error(f"{name} can only be sent with an I plane (ISI 1)", line=line)
        return values

    def number(self, block: dict[str, _Tag], name: str, low: int, high: int) -> int:
        """Return the only number of a tag; FormatError if it is not in low..high."""
        tag = block[name]
        if len(tag.values) != 1:
            raise self.lines.error(f"{name} needs one number, found {len(tag.values)}", line=tag.line)
        return self.numbers(tag, low, high)[0]

    def numbers(self, tag: _Tag, low: int, high: int) -> list[int]:
        """Return the numbers of a tag; FormatError if one is not in low..high."""
        try:
            values = [int(token) for token in tag.values]
        except ValueError:
            values = []
        if len(values) == len(tag.values) and all(low <= value <= high for value in values):
            return values
        for token in tag.values:
            if not re.fullmatch(rb"[+-]?\d{1,18}", token) or not low <= int(token) <= high:
                raise self.lines.error(f"expected an integer in {low}..{high}", token=token, line=tag.line)
        return values


def read_epf(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> list[PlaneSettings]:
    """Return the planes that an EPF file describes, in order.

    `face` and `body` of a P plane are the objects of the I plane in force. Raises FormatError with line and
    token for unknown tags, values that the syntax cannot carry, and contradictions; LimitError for more
    planes and skipped frames than allowed. Warns (FbaWarning) of a mask or quantiser in the block of a P
    plane.
    """
    file, size = open_source(path)
    with file:
        lines = Lines(file, size, path)
        reader = _Reader(lines)
        block: dict[str, _Tag] = {}
        for line in lines:
            name, *values = content(line).split() or [b""]
            if not name:
                continue
            tag = decoded(name)
            if tag not in TAGS:
                kind = recognition_hint(lines.head)
                raise lines.error(
                    f"unknown tag; an EPF line begins with FBM, FFR, ISI, FMT, ...{kind}", token=tag
                )
            if tag == "FBM":
                if block:
                    reader.add_plane(block)
                    _check_limits(reader, size, limits)
                block = {}
            elif not block:
                raise lines.error("comes before FBM, which opens the block of each plane", token=tag)
            elif tag in block:
                raise lines.error(
                    "stands twice in one block; the block of the next plane begins with FBM", token=tag
                )
            block[tag] = _Tag(values, lines.number)
        if not block:
            raise lines.error("holds no planes, only blank lines and comments")
        reader.add_plane(block)
        _check_limits(reader, size, limits)
    return reader.planes


def _check_limits(reader: _Reader, size: int, limits: Limits) -> None:
    """Raise LimitError for more planes, or more skipped frames, than allowed. size: bytes of the file."""
    where = f"{reader.lines.path}:{reader.lines.number}"
    limits.check_frames(reader.frames, f"{where}: what is to be coded, with the frames skipped,")
    limits.check_bytes(len(reader.planes) * PLANE_BYTES, f"{where}: {len(reader.planes)} planes", source=size)
