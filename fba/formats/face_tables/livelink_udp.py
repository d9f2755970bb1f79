"""Read recordings of what Live Link Face sends: datagrams of its version 6, one after another.

A datagram has the device's id and the subject's name, each after its length, the number of the frame and its
fraction, the rate as a fraction, and 61 values, which are left out if no face is seen. All numbers are
big-endian. The ids, which name somebody's telephone, are not kept.
"""

from __future__ import annotations

import struct
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from fba.arrays import Float64, Int64, to_float64
from fba.capture import ShapeMotion
from fba.choices import Swap
from fba.errors import FormatError, Remedy, UnsupportedError
from fba.face import arkit_names
from fba.formats.face_tables._tables import named
from fba.formats.face_tables.shape_weights import check_weights, find_lacks, find_swap
from fba.formats.time_codes import DAY, NOON
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, read_whole, stem_of

VERSION = 6
VALUES = 61
"""Numbers of a face: 52 weights, and nine angles."""
MOST_TEXT = 255
TIME = struct.Struct(">ifii")
LARGEST_RATE = 1000
"""Frames per second."""
PACKET_BYTES = 700
"""Memory of a datagram while it is read."""


class Packet(NamedTuple):
    """A datagram.

    sender: the device's id and the subject's name. seconds: time of day. values: 61 numbers, NaN without a
    face.
    """

    sender: tuple[bytes, bytes]
    seconds: float
    rate: Fraction
    values: Float64


def sniff(head: bytes, suffix: str) -> bool:
    """Whether a file begins with a datagram of Live Link Face, of any version."""
    return _version_of(head) != ""


def read_face(
    path: Path, *, swap: Swap = "auto", face: str | None = None, limits: Limits = DEFAULT_LIMITS
) -> ShapeMotion:
    """Return weights, head and eyes as they were sent.

    swap: as for tables, see `_livelink_csv.read_face`. face: the name of the subject, if several telephones
    sent. Datagrams are put in order, and repeated ones count once. Raises FormatError, UnsupportedError for
    other versions, LimitError, OptionError.
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
    weights, head, eyes = divide_values(values)
    check_weights(weights, arkit_names(), path)
    findings += find_lacks(arkit_names(), weights, times - times[0], rate)
    motion = ShapeMotion(
        arkit_names(), weights, times - times[0], rate, head=head, eyes=eyes, start=float(times[0]),
        name=stem_of(path), findings=tuple(findings),
    )  # fmt: skip
    return find_swap(motion, swap, expected=False)


def _read_packets(data: bytes, path: Path) -> tuple[list[Packet], list[str]]:
    """Return all datagrams, and oddities. Raises FormatError with the place of bytes that are no datagram."""
    packets: list[Packet] = []
    findings = []
    position = 0
    while position < len(data):
        packet, position = read_packet(data, position, path)
        if packet is None:
            findings.append("the last datagram is incomplete; it is left out")
            break
        packets.append(packet)
    if not packets:
        raise FormatError("holds no complete datagram of Live Link Face", path=path)
    return packets, findings


def read_packet(data: bytes, start: int, path: Path) -> tuple[Packet | None, int]:
    """Return the datagram that begins at byte `start`, None if it is incomplete, and where the next begins.

    There is at least one byte. Raises FormatError for bytes that are no datagram, UnsupportedError for
    another version.
    """
    if data[start] != VERSION:
        _refuse(data, start, path)
    texts = []
    position = start + 1
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
        return None, len(data)
    frame, part, over, under = TIME.unpack_from(data, position)
    if not (over > 0 and under > 0 and over <= LARGEST_RATE * under and frame >= 0 and 0 <= part < 2):
        raise FormatError(
            f"byte {position}: frame {frame} and {part:g}, {over}/{under} frames/s: no time", path=path
        )
    rate = Fraction(over, under)
    values = np.full(VALUES, np.nan)
    if with_face:
        sent = to_float64(np.frombuffer(data, ">f4", VALUES, end + 1))
        values = sent if np.isfinite(sent).all() else values
    return Packet((texts[0], texts[1]), (frame + part) / float(rate), rate, values), stop


def divide_values(values: Float64) -> tuple[Float64, Float64, Float64]:
    """Return weights (T, 52), angles of the head (T, 3) and of the eyes (T, 4), as in `ShapeMotion`.

    values: (T, 61), as the app sends them.
    """
    yaw, pitch, roll, left_yaw, left_pitch, _, right_yaw, right_pitch, _ = values[:, len(arkit_names()) :].T
    head = np.stack([-pitch, yaw, roll], axis=1)  # up and left are positive there
    eyes = np.stack([-left_yaw, -right_yaw, left_pitch, right_pitch], axis=1)  # right and down
    return values[:, : len(arkit_names())], head, eyes


def join_values(motion: ShapeMotion) -> Float64:
    """Return values (T, 61) of a motion with ARKit's shapes and angles: the inverse of `divide_values`."""
    assert motion.names == arkit_names()
    assert motion.head is not None
    assert motion.eyes is not None
    pitch, yaw, roll = motion.head.T
    left_yaw, right_yaw, left_pitch, right_pitch = motion.eyes.T
    still = np.zeros(len(motion))
    angles = [yaw, -pitch, roll, -left_yaw, left_pitch, still, -right_yaw, right_pitch, still]
    values: Float64 = np.concatenate([motion.weights, np.stack(angles, axis=1)], axis=1)
    values[values == 0] = 0.0  # no "-0"
    return values


def write_packet(subject: str, device: str, seconds: float, rate: Fraction, values: Float64) -> bytes:
    """Return a datagram. seconds: time of day. values: (61,), NaN without a face."""
    texts = b"".join(len(one.encode()).to_bytes(4, "big") + one.encode() for one in (device, subject))
    frame, part = divmod(seconds * float(rate), 1)
    time = TIME.pack(int(frame), part, rate.numerator, rate.denominator)
    numbers = b"" if np.isnan(values).any() else bytes([VALUES]) + values.astype(">f4").tobytes()
    return bytes([VERSION]) + texts + time + numbers


def _refuse(data: bytes, position: int, path: Path) -> None:
    """Raise the error about bytes at which no datagram of version 6 begins."""
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
    """Return the version of the datagram that begins here; "" without a datagram."""
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


def _choose(packets: list[Packet], face: str | None, path: Path) -> list[Packet]:
    """Return the datagrams of one sender; FormatError if it is not clear which."""
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


def _order(packets: list[Packet], findings: list[str]) -> tuple[Float64, Int64]:
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
