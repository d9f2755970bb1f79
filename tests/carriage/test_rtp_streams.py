"""Streams over a network that loses, overtakes and doubles packets: every frame that is shown is right."""

import random
from collections import deque
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import fba
from fba.carriage._joining import PATIENCE, StreamJoiner
from fba.carriage.payloads import Unit
from fba.carriage.receiving import MOST_WAITING, DatagramReader, PacketOrder, RtpReader
from fba.carriage.rtp import RtpPacket, read_packet, write_packet
from fba.carriage.sending import DatagramWriter, units_of
from fba.codec import Decoder, EncoderOptions, TimeCode, read_plane_start, replace_time_code, time_code
from fba.errors import BitstreamError
from fba.serving import split_stream
from fba_conformance.suite.index import read_vectors
from joinable_streams import JOINABLE
from rtp_network import decoded, disturbed, frames_differ, packets_of, planes_of, received, stream

DATA = stream()
SENT = fba.decode(DATA)
VALUES = SENT.face.values
PLANES = planes_of(DATA)
SECOND = 25
"""Frames."""


@pytest.mark.parametrize("kind", ["3640", "6416"])
@pytest.mark.parametrize("planes_per_packet", [1, 4])
@pytest.mark.parametrize("body", [False, True])
def test_a_network_without_faults(kind: str, planes_per_packet: int, body: bool) -> None:
    data = stream(60, body=body)
    packets = packets_of(planes_of(data, body=body), kind=kind, planes_per_packet=planes_per_packet)
    reader = RtpReader()
    parts = received(reader, packets)
    assert decoded(parts) == fba.decode(data)
    assert reader.ended
    assert reader.table == ("visage" if body else None)
    assert reader.counts.lines() == [f"{len(packets)} packets, 60 planes"]
    decoder = Decoder()
    assert [len(decoder.push(part)) for part in parts] == [1] * 60  # none waits for the next


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_all_valid_vectors() -> None:
    """Also those whose planes begin inside a byte, that change their rate, or skip frames."""
    count = 0
    for vector in read_vectors():
        if not vector.name.startswith("valid/"):
            continue
        data = vector.data()
        table = vector.bap_steps
        whole = fba.decode(data, bap_steps=table)
        for kind in ("3640", "6416"):
            planes = split_stream(data, table)[0]
            reader = RtpReader()
            parts = received(reader, packets_of(planes, kind=kind))
            if sum(plane.fresh for plane in planes) > 1 or reader.counts.damaged:
                continue  # several objects: the first is followed
            shown = decoded(parts)
            assert len(shown) == len(whole), vector.name
            assert shown.face == whole.face, vector.name
            assert shown.body == whole.body, vector.name
            count += 1
    assert count > 100


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", ["3640", "6416"])
def test_a_tenth_of_the_packets_is_lost(seed: int, kind: str) -> None:
    """Every frame shown is right, at its time; all others are counted, and the pose is held meanwhile."""
    packets = packets_of(PLANES, kind=kind)
    arrived = disturbed(packets, seed, loss=0.1, late=0.2, doubled=0.1)
    reader = RtpReader()
    shown = decoded(received(reader, arrived))
    assert not list(frames_differ(shown, SENT))
    counts = reader.counts
    assert len(shown) == counts.planes
    assert counts.doubled
    assert counts.gaps
    assert len(shown) + counts.held + counts.late + counts.lost >= len(SENT) - 1
    gaps = np.diff(shown.index)
    assert (gaps > 1).sum() == counts.gaps
    for behind in shown.index[1:][gaps > 1]:
        assert behind % SECOND == 0  # it goes on with an I plane


def test_packets_out_of_order_cost_nothing() -> None:
    arrived = disturbed(packets_of(PLANES), 3, late=0.5, doubled=0.3)
    reader = RtpReader()
    assert decoded(received(reader, arrived)) == SENT
    assert reader.counts.reordered > 20
    assert reader.counts.doubled > 20
    assert not reader.counts.lost


def test_packets_in_order_do_not_wait() -> None:
    reader = RtpReader(delay=5.0)
    for now, data in packets_of(PLANES, finish=False):
        assert (len(reader.receive(data, "a", now)), reader.due) == (1, None)


def test_a_missing_packet_is_waited_for() -> None:
    packets = packets_of(PLANES[:10], finish=False)
    reader = RtpReader(delay=0.5)
    for number, (now, data) in enumerate(packets):
        if number != 4:
            assert bool(reader.receive(data, "a", now)) == (number < 4)
    assert reader.due == packets[5][0] + 0.5
    assert (len(reader.receive(packets[4][1], "a", 0.45)), reader.due) == (6, None)
    late = RtpReader(delay=0.1)
    for number, (now, data) in enumerate(packets):
        if number != 4:
            late.receive(data, "a", now)
    assert late.receive(packets[4][1], "a", 0.45) == []
    assert (late.counts.lost, late.counts.late, late.counts.held) == (1, 1, 5)


@pytest.mark.parametrize("at", [1, 10, 24, 26, 130])
def test_a_receiver_who_comes_late(at: int) -> None:
    reader = RtpReader()
    shown = decoded(received(reader, packets_of(PLANES)[at:]))
    first = -(-at // SECOND) * SECOND
    assert shown.index[0] == first
    np.testing.assert_array_equal(shown.face.values, VALUES[first:])
    assert reader.counts.held == first - at


def test_numbers_and_times_wrap() -> None:
    """65536 packets, and 2^32 ticks, which are 13 hours."""
    order = PacketOrder(0.1)
    numbers = [number % 65_536 for number in range(65_000, 200_000)]
    taken = 0
    for number in numbers:
        order.push(RtpPacket(96, number, 0, 1, True, b""), 0.0)
        taken += len(order.take(0.0))
    assert (taken, order.lost, order.late, order.doubled) == (len(numbers), 0, 0, 0)
    assert decoded(received(RtpReader(), packets_of(PLANES, timestamp=2**32 - 100_000))) == SENT


def test_another_sender_takes_over() -> None:
    """A restart: other numbers, times and SSRC. What follows goes on at the seconds of our clock."""
    first = packets_of(PLANES[:60], finish=False)
    for address, pause in (("a", 0.2), ("b", 3.0)):
        again = packets_of(PLANES[:60], finish=False, ssrc=9, sequence=3, timestamp=5, start=2.4 + pause)
        reader = RtpReader()
        parts = [part for now, data in first for part in reader.receive(data, "a", now)]
        parts += [part for now, data in again for part in reader.receive(data, address, now)]
        assert reader.counts.senders == 2
        assert not reader.counts.other_senders
        shown = decoded(parts)
        np.testing.assert_array_equal(shown.face.values[:60], VALUES[:60])
        np.testing.assert_array_equal(shown.face.values[60:], VALUES[:60])
        assert reader.counts.gaps == 1
        assert shown.index.tolist() == list(range(120))  # no time code can say the pause
        assert reader.counts.slipped == pytest.approx(pause, abs=0.1)


def test_a_stranger_is_left_out() -> None:
    """Packets of another address or SSRC between those of the first, which is not silent."""
    packets = packets_of(PLANES)
    stranger = packets_of(PLANES, ssrc=66, sequence=9)
    reader = RtpReader()
    parts: list[bytes] = []
    for number, (now, data) in enumerate(packets):
        parts += reader.receive(data, "a", now)
        parts += reader.receive(stranger[number][1], "b", now)
        if number % 7 == 0:
            parts += reader.receive(stranger[number][1], "a", now)  # the same address: no two in a row
    assert decoded(parts) == SENT
    assert reader.counts.senders == 1
    assert reader.counts.other_senders > len(packets)


def test_packets_of_other_kinds() -> None:
    reader = RtpReader()
    chance = random.Random(4)
    for now in range(500):
        reader.receive(chance.randbytes(chance.randrange(60)), "b", now)
        video = RtpPacket(chance.choice([26, 97]), now, 0, 5, True, b"x")
        reader.receive(write_packet(video), "b", now)
        reader.receive(write_packet(video._replace(payload_type=96)), "b", now)
    assert sum(reader.counts.refused.values()) > 1000
    assert len(reader.counts.refused) <= 21
    assert decoded(received(reader, packets_of(PLANES, start=600))) == SENT


def test_an_endless_gap_takes_bounded_memory() -> None:
    order = PacketOrder(1e9)
    order.push(RtpPacket(96, 0, 0, 1, True, b""), 0.0)
    for number in range(2, 30_000):
        order.push(RtpPacket(96, number, 0, 1, True, b""), 0.0)
        order.take(0.0)
        assert len(order._waiting) <= MOST_WAITING + 1
    assert order.lost == 1


def test_planes_that_cannot_be_decoded_are_left_out() -> None:
    """Bytes that are no plane, or more than one, never get into the stream."""
    chance = random.Random(5)
    packets = packets_of(PLANES)
    damaged = []
    for now, data in packets:
        content = bytearray(data)
        if chance.random() < 0.05 and len(content) > 30:
            for _ in range(3):
                content[chance.randrange(17, len(content))] = chance.randrange(256)
        damaged.append((now, bytes(content)))
    reader = RtpReader()
    parts = received(reader, damaged)
    shown = decoded(parts)  # no error
    assert len(shown) == reader.counts.planes == len(parts)
    assert reader.counts.damaged


def test_a_loop_goes_on_in_time() -> None:
    """The time codes of a file that is sent again are behind; those of the stream go on."""
    twice = [*PLANES[:50], *(replace(plane, time=plane.time + 2) for plane in PLANES[:50])]
    shown = decoded(received(RtpReader(), packets_of(twice)))
    assert shown.index.tolist() == list(range(100))
    np.testing.assert_array_equal(shown.face.values[50:], shown.face.values[:50])
    lossy = [one for number, one in enumerate(packets_of(twice)) if number != 48]
    shown = decoded(received(RtpReader(), lossy))
    assert shown.index.tolist() == [*range(48), *range(50, 100)]


def test_without_time_codes_a_loss_shortens_the_stream_by_less_than_two_seconds() -> None:
    """I planes every 0.4 s, which no time code can name: after `PATIENCE`, one of them goes on at once."""
    options = replace(JOINABLE, time_codes=False, intra_period=Fraction(2, 5))
    planes = planes_of(stream(200, options))
    assert sum(bool(plane.opening) for plane in planes) > 10
    packets = packets_of(planes)
    reader = RtpReader()
    parts = received(reader, [one for number, one in enumerate(packets) if number != 52])
    shown = decoded(parts)
    assert shown.index.tolist() == [*range(52), *range(100, 200)]  # 4 s: the first I plane at a whole second
    late = packets_of([replace(plane, time=plane.time + 0.12) for plane in planes[60:]])
    odd = [*packets_of(planes[:52], finish=False)]
    numbered = [write_packet(read_packet(data)._replace(sequence=(65_053 + number) % 65_536))
                for number, (_, data) in enumerate(late)]  # fmt: skip
    reader = RtpReader()
    moved = [(now, data) for (now, _), data in zip(late, numbered, strict=True)]
    shown = decoded(received(reader, odd + moved))
    assert reader.counts.slipped > 0
    assert reader.counts.gaps == 1
    assert shown.index.tolist() == list(range(len(shown)))


def test_times_of_an_i_plane_are_set() -> None:
    unit = PLANES[25].units[0]
    assert read_plane_start(unit).time_code == TimeCode(0, 0, 1)
    for code in (None, TimeCode(1, 2, 3), TimeCode(31, 59, 59)):
        other = replace_time_code(unit, code)
        assert read_plane_start(other).time_code == code
        assert replace_time_code(other, TimeCode(0, 0, 1)) == unit
    assert time_code(25, Fraction(25)) == TimeCode(0, 0, 1)
    for bad in (b"", b"\xb1", PLANES[1].units[0], b"\xff" * 40, b"\x80" + bytes(8)):
        with pytest.raises(BitstreamError):
            replace_time_code(bad, None)
    with pytest.raises(BitstreamError):
        read_plane_start(b"")


def test_units_alone_are_the_planes() -> None:
    joiner = StreamJoiner()
    parts = [joiner.add(unit, None) for plane in PLANES for unit in units_of(plane)]
    assert decoded(parts) == SENT
    assert not joiner.damaged
    assert joiner.add(Unit(b""), None) == b""
    assert joiner.ended
    assert PATIENCE == 2


def test_datagrams_without_rtp() -> None:
    for body in (False, True):
        data = stream(60, body=body)
        writer = DatagramWriter(3)
        planes = planes_of(data, body=body)
        datagrams = [one for plane in planes for one in writer.push(plane, plane.time)] + writer.finish()
        reader = DatagramReader()
        parts = [part for one in datagrams for part in reader.receive(one, "a", 0.0)]
        assert decoded(parts) == fba.decode(data)
        assert reader.ended
        joined = fba.decode(b"".join(datagrams[:-2]))  # bytes of a stream: any program may read them
        assert joined.face == decoded(parts).face
        strange = DatagramReader()
        queue = deque([b"", b"hello", bytes(100), b"\0\0\1", b"\0\0\1\xbb"])
        while queue:
            assert strange.receive(queue.popleft(), "a", 0.0) == []
        assert sum(strange.counts.refused.values()) == 5


def test_a_stream_without_i_planes_to_begin_at_cannot_be_entered() -> None:
    planes = planes_of(stream(100, EncoderOptions()))
    reader = RtpReader()
    assert received(reader, packets_of(planes)[1:]) == []
    assert reader.counts.held == 99
