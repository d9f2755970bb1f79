"""Read recordings of what Live Link Face sends: datagrams of its version 6, one after another.

A datagram has the device's id and the subject's name, each after its length, a frame's number and part, the
rate as a fraction, and 61 numbers; those are left out where no face is seen. All numbers are big-endian. The
ids, which name somebody's telephone, are not kept.
"""

from __future__ import annotations

import struct
from fractions import Fraction
from pathlib import Path as FilePath
from typing import NamedTuple

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64, Int64
from fba.capture.blendshapes import ShapeMotion
from fba.capture.blendshapes.shape_table import ARKIT_ORDER
from fba.errors import FormatError, Remedy, UnsupportedError
from fba.formats.face_tables._shape_rows import check_weights, find_lacks, find_swap, to_animation
from fba.formats.face_tables._tables import named
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, read_whole

VERSION = 6
VALUES = 61
MOST_TEXT = 255
TIME = struct.Struct(">ifii")
DAY = 86_400.0
NOON = DAY / 2
LARGEST_RATE = 1000
PACKET_BYTES = 700
"""Memory of a datagram while it is read."""


class _Packet(NamedTuple):
    """seconds: time of day. values: 61 numbers, NaN where no face is seen."""

    sender: tuple[bytes, bytes]
    seconds: float
    rate: Fraction
    values: Float64


def sniff(head: bytes, suffix: str) -> bool:
    """Whether a file begins with a datagram of Live Link Face, of any version."""
    return _version_of(head) != ""


def read(
    path: Path,
    *,
    rate: Fraction | int | str | None = None,
    swap: str = "auto",
    face: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Return a captured face as FAPs, at `rate` or at the rate that the datagrams name.

    The options are those of `read_face`, and `fba.capture.from_blendshapes` says how it is done. Warns
    (FbaWarning) of what was repaired. Raises FormatError, UnsupportedError, LimitError, OptionError.
    """
    return to_animation(read_face(path, swap=swap, face=face, limits=limits), rate, path, limits, warn=4)


def read_face(
    path: Path, *, swap: str = "auto", face: str | None = None, limits: Limits = DEFAULT_LIMITS
) -> ShapeMotion:
    """Return weights, head and eyes as they were sent.

    swap: as for tables, see `livelink_csv.read_face`. face: the name of the subject, where several telephones
    sent. Datagrams out of order are put in order, doubled ones count once. Raises FormatError,
    UnsupportedError for other versions, LimitError, OptionError.
    """
    data = read_whole(path)
    limits.check_bytes(len(data) // 60 * PACKET_BYTES, f"{path}: the recording", source=len(data))
    packets, findings = _read_packets(data, path)
    packets = _choose(packets, face, path)
    rate = packets[-1].rate
    if any(packet.rate != rate for packet in packets):
        raise FormatError("the rate changes in the recording; cut it there", path=path)
    times, order = _order(packets, findings)
    limits.check_frames(len(order), f"{path}: the recording")
    values = np.array([packets[number].values for number in order])
    weights = values[:, : len(ARKIT_ORDER)]
    check_weights(weights, ARKIT_ORDER, path)
    yaw, pitch, roll, left_yaw, left_pitch, _, right_yaw, right_pitch, _ = values[:, len(ARKIT_ORDER) :].T
    findings += find_lacks(ARKIT_ORDER, weights, times - times[0], rate)
    motion = ShapeMotion(
        ARKIT_ORDER, weights, times - times[0], rate,
        head=np.stack([-pitch, yaw, roll], axis=1),  # up and left are positive there
        eyes=np.stack([-left_yaw, -right_yaw, left_pitch, right_pitch], axis=1),  # right and down
        start=float(times[0]), name=FilePath(path).stem, findings=tuple(findings),
    )  # fmt: skip
    return find_swap(motion, swap, expected=False)


def _read_packets(data: bytes, path: Path) -> tuple[list[_Packet], list[str]]:
    """Return all datagrams, and what was odd. Raises FormatError with the place of what is none."""
    packets: list[_Packet] = []
    findings = []
    missing = np.full(VALUES, np.nan)
    position = 0
    while position < len(data):
        start = position
        if data[position] != VERSION:
            _refuse(data, position, path)
        texts = []
        position += 1
        for _ in range(2):
            length = int.from_bytes(data[position : position + 4], "big")
            if len(data) >= position + 4 and not 0 < length <= MOST_TEXT:
                _refuse(data, start, path)
            texts.append(data[position + 4 : position + 4 + length])
            position += 4 + length
        end = position + TIME.size
        with_face = len(data) > end and data[end] != VERSION
        if with_face and data[end] != VALUES:
            raise UnsupportedError(
                f"{path}: byte {end}: a datagram with {data[end]} values; expected {VALUES}",
                what="other datagrams of Live Link Face",
            )
        stop = end + (1 + 4 * VALUES if with_face else 0)
        if len(data) < stop or len(data) < end:
            findings.append("the last datagram is incomplete; it is left out")
            break
        frame, part, over, under = TIME.unpack_from(data, position)
        if not (over > 0 and under > 0 and over <= LARGEST_RATE * under and frame >= 0 and 0 <= part < 2):
            raise FormatError(
                f"byte {position}: frame {frame} and {part:g}, {over}/{under} frames/s: no time", path=path
            )
        rate = Fraction(over, under)
        values = missing
        if with_face:
            with np.errstate(invalid="ignore"):  # NaNs that signal
                values = np.frombuffer(data, ">f4", VALUES, end + 1).astype(np.float64)
            if not np.isfinite(values).all():
                values = missing
        packets.append(_Packet((texts[0], texts[1]), (frame + part) / float(rate), rate, values))
        position = stop
    if not packets:
        raise FormatError("holds no complete datagram of Live Link Face", path=path)
    return packets, findings


def _refuse(data: bytes, position: int, path: Path) -> None:
    """Raise the error for bytes that do not begin a datagram of version 6."""
    version = _version_of(data[position : position + 600])
    if version and version != str(VERSION):
        raise UnsupportedError(
            f"{path}: byte {position}: a datagram of Live Link Face's version {version}; only version "
            f"{VERSION} is read, which the app sends in its ARKit mode",
            what=f"Live Link Face, version {version}",
        )
    raise FormatError(
        f"byte {position}: no datagram of Live Link Face begins here; cut off what comes before or after",
        path=path,
        token=data[position : position + 8].hex(" "),
    )


def _version_of(head: bytes) -> str:
    """Return the version of the datagram that begins here; "" if there is none."""
    for version, length, start in (
        (head[:1], head[1:5], 5),
        (head[:2], head[2:4], 4),  # the other mode of the app, for MetaHumans
    ):
        number, count = int.from_bytes(version, "big"), int.from_bytes(length, "big")
        text = head[start : start + count]
        if not (0 < number < 10 and 0 < count <= MOST_TEXT and len(text) == count):
            continue
        if len(version) == len(head[:1]) and head[:1] == b"\0":
            continue
        if text.decode("utf-8", errors="replace").isprintable():
            return str(number) if start == 5 else f"{number} of the MetaHuman mode"
    return ""


def _choose(packets: list[_Packet], face: str | None, path: Path) -> list[_Packet]:
    """Return the datagrams of one sender; FormatError where it is not clear which."""
    subjects: dict[str, set[tuple[bytes, bytes]]] = {}
    for packet in packets:
        subjects.setdefault(packet.sender[1].decode("utf-8", errors="replace"), set()).add(packet.sender)
    if face is not None:
        if face not in subjects:
            raise FormatError(f"has no face {face!r}; there are {named(sorted(subjects))}", path=path)
        packets = [one for one in packets if one.sender[1].decode("utf-8", errors="replace") == face]
        subjects = {face: subjects[face]}
    if len(subjects) > 1:
        raise FormatError(f"has several faces: {named(sorted(subjects))}", path=path).with_remedies(
            Remedy("face", "choose one with {}", repr(min(subjects)))
        )
    if len(next(iter(subjects.values()))) > 1:
        raise FormatError("several telephones sent a face of one name; name them apart", path=path)
    return packets


def _order(packets: list[_Packet], findings: list[str]) -> tuple[Float64, Int64]:
    """Return times (T,), increasing, and the numbers (T,) of their datagrams."""
    times = np.array([packet.seconds for packet in packets])
    if np.ptp(times) > NOON:  # midnight
        times = np.where(times < NOON, times + DAY, times)
    order = np.argsort(times, kind="stable")
    late = int((np.diff(times) < 0).sum())
    if late:
        findings.append(f"{late} datagrams are out of order; they are put in order")
    first = np.append(True, np.diff(times[order]) > 0)
    if not first.all():
        findings.append(f"{int((~first).sum())} datagrams come twice; they count once")
    order = order[first]
    return times[order], order.astype(np.int64)
