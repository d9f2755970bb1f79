"""Write EPF files, the inverse of `fba.formats.epf.epf.read_epf`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from fba.atomic import atomic
from fba.codec import PartSettings, PlaneSettings
from fba.codec.settings import RANGE_CODE_MAX, RANGE_UNIT
from fba.errors import FormatError, UnsupportedError, warn
from fba.formats.epf._tags import BODY, PARTS, Part
from fba.source import Path


def write_epf(path: Path, planes: Iterable[PlaneSettings]) -> None:
    """Write the EPF file with which an encoder makes the same planes again.

    `read_epf` returns equal settings, except for plane start codes, which no tag carries (FbaWarning).
    Raises FormatError for settings that contradict themselves or if writing fails, UnsupportedError if face
    and body of a plane differ in gender or coding type, which share a tag.
    """
    writer = _Writer(path)
    with atomic(path) as file:
        for number, plane in enumerate(planes):
            file.write("".join(f"{line}\n" for line in writer.block(number, plane)).encode())
        if not writer.planes:
            raise FormatError("there are no planes to write", path=path)
    if writer.start_codes:
        warn(
            f"{path}: {writer.start_codes} planes have a start code before them, which an EPF file "
            "cannot store; with the option start_codes, the encoder writes new ones",
            stacklevel=2,
        )


class _Writer:
    """Formats planes as blocks.

    planes, start_codes: their counts so far. in_force: part -> settings of its last I plane. shared: values
    in force of the tags that face and body share.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.planes = 0
        self.start_codes = 0
        self.in_force: dict[int, PartSettings] = {}
        self.shared = {"GDR": 0, "CDM": 0}

    def block(self, number: int, plane: PlaneSettings) -> Iterator[str]:
        """Yield the lines of a plane's block."""
        where = f"plane {number}: "
        present = [
            (part, settings, frame)
            for part, settings, frame in zip(
                PARTS, (plane.face, plane.body), (plane.face_frame, plane.body_frame), strict=True
            )
            if settings is not None
        ]
        if not present:
            raise FormatError(f"{where}has neither a face nor a body", path=self.path)
        self.planes += 1
        self.start_codes += plane.start_code
        yield f"FBM {sum(part.bit for part, _, _ in present)}"
        for part, _, frame in present:
            if frame is None:
                raise FormatError(f"{where}has a {part.word}, but no {part.word}_frame", path=self.path)
            yield f"{part.frame} {frame}"
        yield f"ISI {int(plane.intra)}"
        first = present[0][0]
        if plane.frame_rate is not None:
            rate = plane.frame_rate
            yield f"{first.rate} {rate.frame_rate} {rate.seconds} {rate.frequency_offset}"
        if plane.time_code is not None:
            time = plane.time_code
            yield f"{first.time} {time.hours} {time.minutes} {time.marker} {time.seconds}"
        if plane.skip:
            yield f"{first.skip} {plane.skip}"
        if plane.intra:
            yield from self._shared(where, [settings for _, settings, _ in present])
        for part, settings, _ in present:
            if plane.intra:
                yield from self._part(where, part, settings)
                self.in_force[part.bit] = settings
            elif part.bit not in self.in_force or not _same(self.in_force[part.bit], settings):
                raise FormatError(
                    f"{where}a P plane keeps the {part.word} settings of the last I plane, but these differ",
                    path=self.path,
                )

    def _shared(self, where: str, settings: list[PartSettings]) -> Iterator[str]:
        """Yield the shared tags that change. where: the plane, for errors."""
        for tag, values in (
            ("GDR", {part.gender for part in settings}),
            ("CDM", {part.coding_type for part in settings}),
        ):
            if len(values) > 1:
                what = "suggested_gender" if tag == "GDR" else "object_coding_type"
                raise UnsupportedError(
                    f"{self.path}: {where}face and body differ in {what}, but an EPF file has only one tag "
                    "for both",
                    what=f"EPF with two values of {what}",
                )
            value = values.pop()
            if value != self.shared[tag]:
                self.shared[tag] = value
                yield f"{tag} {value}"

    def _part(self, where: str, part: Part, settings: PartSettings) -> Iterator[str]:
        """Yield mask, quantiser and range lists of a part."""
        groups = part.groups()
        if len(settings.mask_types) != len(groups) or len(settings.mask) != part.count:
            raise FormatError(
                f"{where}the {part.word} needs {len(groups)} mask types and {part.count} mask bits",
                path=self.path,
            )
        words: list[str] = []
        for number, (kind, group) in enumerate(zip(settings.mask_types, groups, strict=True), start=1):
            bits = [int(settings.mask[member - 1]) for member in group]
            if not 0 <= kind <= 3 or (kind == 2 and part.bit == BODY):
                raise FormatError(
                    f"{where}{part.word} group {number} has mask type {kind}; expected "
                    f"{'0, 1 or 3' if part.bit == BODY else '0 to 3'}",
                    path=self.path,
                )
            if (kind == 0 and any(bits)) or (kind == 3 and not all(bits)):
                raise FormatError(
                    f"{where}mask type {kind} of {part.word} group {number} contradicts its mask",
                    path=self.path,
                )
            words += [str(kind), *(map(str, bits) if kind in (1, 2) else ())]
        yield f"{part.mask} {' '.join(words)}"
        yield f"{part.quant} {settings.quant}"
        for tag, codes, sign in zip(part.lists, settings.ranges, (1, -1, 1, -1), strict=True):
            if codes is None:
                continue
            if len(codes) != part.count or int(np.max(codes)) > RANGE_CODE_MAX:
                raise FormatError(
                    f"{where}{tag} needs {part.count} range codes of at most {RANGE_CODE_MAX}", path=self.path
                )
            limits = sign * RANGE_UNIT * codes[part.first - 1 :].astype(np.int64)
            yield f"{tag} {' '.join(map(str, limits.tolist()))}"


def _same(one: PartSettings, other: PartSettings) -> bool:
    """Whether a P plane may have these settings; range lists belong to the I plane that sends them."""
    return one is other or (
        (one.mask_types, one.quant, one.gender, one.coding_type)
        == (other.mask_types, other.quant, other.gender, other.coding_type)
        and np.array_equal(one.mask, other.mask)
    )
