"""RTP packets and their payloads, bit by bit; hostile ones are refused."""

import contextlib
import random

import pytest

from fba.carriage.payloads import (
    MOST_UNIT_BYTES,
    PayloadReader,
    SizeTable,
    Unit,
    write_size_table,
    write_start_codes,
)
from fba.carriage.rtp import FrameReader, RtpPacket, read_packet, write_frame, write_packet
from fba.carriage.sending import MOST_PAYLOAD, RtpWriter
from fba.errors import FormatError
from fba.serving import Plane

PACKET = RtpPacket(96, 65_535, 0xFFFF_FFFE, 0x1234_5678, True, b"plane")
HEADERS = bytes.fromhex("000001b061000001b523000001ba")


def test_a_packet_is_twelve_bytes_and_its_payload() -> None:
    data = write_packet(PACKET)
    assert data == bytes.fromhex("80e0fffffffffffe12345678") + b"plane"
    assert read_packet(data) == PACKET


def test_padding_extension_and_contributing_sources_are_left_out() -> None:
    head = bytes.fromhex("b2e0fffffffffffe12345678")
    extension = bytes.fromhex("bede0001aabbccdd")
    assert read_packet(head + bytes(8) + extension + b"plane" + b"\0\0\3") == PACKET


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "shorter"), ("80e0", "shorter"), ("00e0fffffffffffe12345678", "version"),
        ("c0e0fffffffffffe12345678", "version"), ("80c8fffffffffffe12345678", "RTCP"),
        ("8fe0fffffffffffe12345678aabb", "beyond"), ("90e0fffffffffffe12345678aa", "beyond"),
        ("90e0fffffffffffe12345678bedeffff", "beyond"), ("a0e0fffffffffffe1234567800", "padding of 0"),
        ("a0e0fffffffffffe12345678ff", "beyond"),
    ],
)  # fmt: skip
def test_lengths_that_lie(text: str, reason: str) -> None:
    with pytest.raises(FormatError, match=reason):
        read_packet(bytes.fromhex(text))


def test_frames_of_a_connection_come_in_any_pieces() -> None:
    packets = [b"", b"one", bytes(65_535), b"two"]
    data = b"".join(map(write_frame, packets))
    for size in (1, 7, 100_000):
        reader = FrameReader()
        pieces = [data[at : at + size] for at in range(0, len(data), size)]
        assert [one for piece in pieces for one in reader.push(piece)] == packets
    with pytest.raises(OverflowError):
        write_frame(bytes(65_536))


def test_sizes_by_rfc_3640() -> None:
    units = [Unit(b"\xb1ab", joinable=True), Unit(b"\x31c", joinable=False)]
    # 34 bits: size 3, index 0, random access; size 2, index delta 0
    payload = write_size_table(units)
    headers = (3 << 4 | 1) << 17 | 2 << 4
    assert payload == b"\0\x22" + (headers << 6).to_bytes(5, "big") + b"\xb1ab\x31c"
    assert PayloadReader().push(payload, marker=True) == units
    joined = write_size_table([Unit(b"\xb1ab", HEADERS, True)])
    assert joined[5:] == HEADERS + b"\0\0\1\xbb\xb1ab"
    assert PayloadReader().push(joined, marker=True) == [Unit(b"\xb1ab", HEADERS, True)]


def test_start_codes_by_rfc_6416() -> None:
    units = [Unit(b"\xb1ab", HEADERS, True), Unit(b"\x31c")]
    payload = write_start_codes(units)
    assert payload == HEADERS + b"\0\0\1\xbb\xb1ab" + b"\0\0\1\xbb\x31c"
    assert PayloadReader().push(payload, marker=True) == units
    behind_object = HEADERS + b"\xb1ab"  # a plane may follow the object without a start code
    assert PayloadReader().push(behind_object, marker=True) == units[:1]
    assert PayloadReader().push(b"\0\0\1\xb1", marker=True) == [Unit(b"")]


@pytest.mark.parametrize("kind", ["3640", "6416"])
def test_a_plane_that_no_packet_has_room_for_is_spread(kind: str) -> None:
    unit = bytes([0x31]) + random.Random(1).randbytes(4000).replace(b"\0", b"\1")
    plane = Plane(unit, 0.0, 25.0, b"\0\0\1\xba" + unit, units=(unit,))
    writer = RtpWriter(kind=kind, ssrc=1, sequence=2, timestamp=3)  # type: ignore[arg-type]
    packets = [read_packet(one) for one in writer.push(plane, 0.0)]
    assert [one.marker for one in packets] == [False, False, True]
    assert all(len(one.payload) <= MOST_PAYLOAD for one in packets)
    reader = PayloadReader()
    units = [unit for one in packets for unit in reader.push(one.payload, marker=one.marker)]
    assert units == [Unit(unit, HEADERS, True)]
    for missing in range(3):
        reader = PayloadReader(kind)  # type: ignore[arg-type]
        found = []
        for number, one in enumerate(packets):
            if number == missing:
                reader.lose()
                continue
            with contextlib.suppress(FormatError):
                found += reader.push(one.payload, marker=one.marker)
        assert not [one for one in found if one.data == unit]


def test_other_fields_of_a_size_table() -> None:
    table = SizeTable(
        sizelength=6, indexlength=2, indexdeltalength=2, ctsdeltalength=8, dtsdeltalength=4,
        streamstateindication=3, auxiliarydatasizelength=8,
    )  # fmt: skip
    #            size 2   index CTS 5          DTS  RAP state size 1   delta none none RAP state
    bits = "0000100010000010101101" + "000001000100010000"
    packed = int(bits.ljust(-(-len(bits) // 8) * 8, "0"), 2).to_bytes(-(-len(bits) // 8), "big")
    payload = len(bits).to_bytes(2, "big") + packed + b"\x0a\xff\xc0" + b"\xb1a\x31"
    assert PayloadReader("3640", table).push(payload, marker=True) == [
        Unit(b"\xb1a", joinable=True), Unit(b"\x31", joinable=False)
    ]  # fmt: skip
    constant = SizeTable(0, 0, 0, randomaccessindication=1, constantsize=2)
    assert PayloadReader("3640", constant).push(b"\0\2\x80" + b"\xb1a\x31b", marker=True) == [
        Unit(b"\xb1a", joinable=True), Unit(b"\x31b", joinable=False)
    ]  # fmt: skip


@pytest.mark.parametrize(
    "payload",
    [
        b"", b"\0", b"\0\x11", b"\xff\xff\0\0\0", b"\0\0\0\0", b"\0\x11\0\0\0", b"\0\x11\0\x31\x80a",
        b"\0\x10\0\x30abc", b"\0\x11\0\x32\0abc", b"\0\x22\0\x30\0\x18\0a",
        b"\xff\xff" + bytes(8192), b"\0\0\1", b"\0\0\1\xba", b"\0\0\1\xbb", b"\0\0\1\xb3" * 300,
    ],
)  # fmt: skip
def test_payloads_that_lie(payload: bytes) -> None:
    for kind in (None, "3640", "6416"):
        reader = PayloadReader(kind)  # type: ignore[arg-type]
        try:
            units = reader.push(payload, marker=True)
        except FormatError:
            continue
        assert not units  # the first part of a plane: more may come


def test_parts_do_not_grow_for_ever() -> None:
    sized = b"\0\x11" + (8000 << 11).to_bytes(3, "big") + bytes(1000)
    for kind, part in (("6416", b"\0\0\1\xbb" + bytes(1000)), ("3640", sized)):
        reader = PayloadReader(kind)  # type: ignore[arg-type]
        for _ in range(100):
            with contextlib.suppress(FormatError):
                reader.push(part, marker=False)
            assert len(reader._part) <= MOST_UNIT_BYTES
