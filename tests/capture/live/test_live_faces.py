"""Faces that arrive live: the stream is that of the same capture in a file, and what is wrong is counted."""

import io
import socket
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.capture import from_blendshapes
from fba.capture.live import widest_faces
from fba.errors import FbaError
from fba.formats.face_tables import ifacialmocap
from fba.formats.face_tables import livelink_udp as recorded
from fba.live import Capture, Summary, find_kind
from fba.live.recording import StreamPipe, StreamRecorder, stream_rate
from fba.live.sending import send
from fba.planning.rate import RateEncoder
from live_senders import at_rate, captured, vtube_objects
from tools.captures.face_files import (
    STEP,
    UDP_ORDER,
    camel,
    datagram,
    face_angles,
    face_weights,
    ifacialmocap_records,
    livelink_udp,
)

ROWS = 60
WEIGHTS, ANGLES = face_weights(ROWS), face_angles(ROWS)
SENT = livelink_udp({**WEIGHTS, **ANGLES})


def from_file(folder: Path, data: bytes, rate: int | None = None) -> fba.Animation:
    """Return the face of recorded datagrams of Live Link Face."""
    path = folder / "a.udp"
    path.write_bytes(data)
    return from_blendshapes(recorded.read_face(path, swap="no"), rate)


def divided(data: bytes) -> list[bytes]:
    """Return the datagrams of a recording."""
    result, position = [], 0
    while position < len(data):
        _, stop = recorded.read_packet(data, position, "a.udp")
        result.append(data[position:stop])
        position = stop
    return result


def check_same(live: fba.Animation | None, expected: fba.Animation, off: int = 0) -> None:
    """Two animations but for their names. off: by how much values may differ."""
    assert live.rate == expected.rate
    np.testing.assert_array_equal(live.index, expected.index)
    np.testing.assert_array_equal(live.face.mask, expected.face.mask)
    np.testing.assert_allclose(live.face.values, expected.face.values, atol=off)


@pytest.mark.parametrize("rate", [None, 25, 100])
def test_the_recorded_capture_gives_the_stream_that_its_file_gives(
    shared: Path, tmp_path: Path, rate: int | None
) -> None:
    data = (shared / "data/capture/livelink_capture.udp").read_bytes()
    live, summary = captured("livelink", at_rate(divided(data)), rate=rate and Fraction(rate))
    check_same(live, from_file(tmp_path, data, rate))
    assert (summary.received, summary.used, summary.unseen, summary.gaps) == (567, 560, 7, 1)
    assert summary.lines() == [
        "567 datagrams from 'Test_iPhone_X' (10.0.0.2): 560 used, 7 without a face",
        "a gap of 0.13 s is bridged",
    ]


def test_the_recorded_capture_is_read_back_as_from_its_file(shared: Path, tmp_path: Path) -> None:
    data = (shared / "data/capture/livelink_capture.udp").read_bytes()
    target = io.BytesIO()
    recorder = StreamRecorder([StreamPipe(target)])
    capture = Capture(find_kind("livelink"), recorder.push)
    for now, host, one in at_rate(divided(data)):
        capture.receive(one, host, now)
    capture.finish()
    recorder.finish()
    assert recorder.encoder.statistics.intra_planes == 1
    check_same(fba.decode(target.getvalue()), fba.decode(fba.encode(from_file(tmp_path, data))))
    with pytest.raises(ValueError, match="has begun"):
        recorder.encoder.expect(from_file(tmp_path, data))


def test_a_capture_at_a_bit_rate_gives_the_stream_of_its_file(shared: Path, tmp_path: Path) -> None:
    data = (shared / "data/capture/livelink_capture.udp").read_bytes()
    target = io.BytesIO()
    recorder = StreamRecorder([StreamPipe(target)], bit_rate=3000, buffer=0.8)
    capture = Capture(find_kind("livelink"), recorder.push)
    for now, host, one in at_rate(divided(data)):
        capture.receive(one, host, now)
    capture.finish()
    recorder.finish()
    stream, animation = target.getvalue(), from_file(tmp_path, data)
    encoder = RateEncoder(3000, 0.8, recorder.options)
    encoder.expect(widest_faces())
    assert encoder.push_animation(animation) + encoder.finish() == stream
    assert 8 * len(stream) <= 3000 * (float(animation.duration) + 0.8)
    assert 0.5 * len(animation) < len(fba.decode(stream, bap_steps="visage")) < len(animation)


def test_out_of_order_doubled_lost_and_without_a_face(tmp_path: Path) -> None:
    sent = [one for row, one in enumerate(SENT) if row not in (20, 21, 30)]
    sent[5] = datagram(None, 18_000 + 5 * STEP)
    sent[10], sent[11], sent[12] = sent[12], sent[10], sent[11]
    sent.insert(40, sent[39])
    late = [*sent, SENT[50]]
    live, summary = captured("livelink", at_rate(late))
    check_same(live, from_file(tmp_path, b"".join(sent)))
    assert (summary.reordered, summary.doubled, summary.unseen) == (2, 2, 1)
    passed = [*SENT[:4], *SENT[5:7], SENT[4], *SENT[7:]]  # by two, and below by three
    live, summary = captured("livelink", at_rate(passed))
    check_same(live, from_file(tmp_path, b"".join(SENT)))
    live, summary = captured("livelink", at_rate([*SENT[:4], *SENT[5:8], SENT[4], *SENT[8:]]))
    assert summary.late == 1
    assert len(live) == ROWS


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"\x05" + SENT[0][1:], "of another kind: Live Link Face, version 5"),
        (b"\0\1\0\4face" + bytes(60), "of another kind: Live Link Face, version 1 of the MetaHuman mode"),
        (SENT[0][:100], "cut short"),
        (SENT[0] + b"more", "longer than a datagram of Live Link Face"),
        (b"garbage", "not of Live Link Face"),
        (b"", "empty"),
        (SENT[0] + bytes(3000), "longer than 2048 bytes"),
        (datagram([50.0] * 61, 1.0), "with weights outside 0 to 1"),
        (datagram([0.1] * 61, 1.0, rate=900), "with more than 240 frames in a second"),
    ],
)
def test_datagrams_of_others_are_counted(data: bytes, reason: str, tmp_path: Path) -> None:
    live, summary = captured("livelink", at_rate([data, *SENT[:20], data, *SENT[20:], data]))
    check_same(live, from_file(tmp_path, b"".join(SENT)))
    assert dict(summary.refused) == {reason: 3}
    assert f"left out: 3 {reason}" in summary.lines()


def test_of_two_senders_the_first_or_the_one_that_is_named() -> None:
    other = livelink_udp({**face_weights(ROWS, seed=9), **ANGLES}, name="Bo", device="E" * 36)
    mixed = at_rate([one for pair in zip(SENT, other, strict=True) for one in pair], rate=120.0)
    said: list[str] = []
    first, summary = captured("livelink", mixed, say=said.append)
    assert first == captured("livelink", at_rate(SENT))[0]
    assert dict(summary.other_senders) == {"'Bo' (10.0.0.2)": ROWS}
    assert said == ["receiving from 'iPhone' (10.0.0.2)", "'Bo' (10.0.0.2) also sends, and is left out"]
    named, _ = captured("livelink", mixed, sender="Bo")
    assert named == captured("livelink", at_rate(other))[0]
    assert captured("livelink", mixed, sender="Cy")[0] is None
    by_address, _ = captured(
        "livelink", [*at_rate(other), *at_rate(SENT, host="10.0.0.9")], sender="10.0.0.9"
    )
    assert by_address == first


def test_a_thousand_senders_cost_no_memory() -> None:
    sent = [(0.01 * n, f"10.0.{n // 200}.{n % 200}", datagram([0.1] * 61, 1.0, name=f"n{n}"))
            for n in range(1000)]  # fmt: skip
    _, summary = captured("livelink", sent)
    assert len(summary.other_senders) <= 21
    assert dict(summary.refused) == {"of more than 32 addresses": 968}


def test_clocks_that_jump() -> None:
    stray = datagram([0.1] * 61, 40_000.0)
    live, summary = captured("livelink", at_rate([*SENT[:30], stray, *SENT[30:]]))
    assert live == captured("livelink", at_rate(SENT))[0]
    assert summary.strayed == 1
    again = livelink_udp({**WEIGHTS, **ANGLES}, start=500.0)  # the telephone was set to another time
    live, summary = captured("livelink", at_rate([*SENT, *again]))
    assert summary.jumps == 1
    assert len(live) == pytest.approx(2 * ROWS, abs=2)
    ahead = livelink_udp({**WEIGHTS, **ANGLES}, start=18_060.0)  # without a pause
    live, summary = captured("livelink", at_rate([*SENT, *ahead]))
    assert (summary.jumps, summary.gaps) == (1, 0)
    assert len(live) == pytest.approx(2 * ROWS, abs=2)
    paused = [*at_rate(SENT), *((now + 100, host, one) for now, host, one in at_rate(
        livelink_udp({**WEIGHTS, **ANGLES}, start=18_100.0)))]  # fmt: skip
    live, summary = captured("livelink", paused)
    assert (summary.jumps, summary.gaps) == (0, 1)
    assert len(live) == pytest.approx(60 * 101, abs=3)  # the face holds still meanwhile


def test_a_rate_that_no_stream_can_have() -> None:
    whole = SENT[0].replace(b"\0\0\0\x3c\0\0\0\1", b"\0\0\0\x14\0\x2a\xaa\xab")
    animation, _ = captured("livelink", at_rate([whole]))
    assert animation.rate == 1
    assert stream_rate(Fraction(60_000, 1001)) == Fraction(60_000, 1001)
    assert stream_rate(Fraction(1000, 33)) == Fraction(485, 16)
    assert stream_rate(Fraction(1000)) == 240


def test_over_midnight() -> None:
    sent = [datagram([0.1] * 61, (86_399.9 + row / 60) % 86_400) for row in range(30)]
    live, summary = captured("livelink", at_rate(sent))
    assert (len(live), summary.jumps, summary.strayed) == (30, 0, 0)


def test_the_neutral_face_of_the_first_seconds_is_subtracted() -> None:
    rows = [[0.2] * 61] * 30 + [[0.5] * 61] * 20 + [[0.1] * 52 + [0.2] * 9] * 10
    sent = [datagram(row, 18_000 + number / 60) for number, row in enumerate(rows)]
    live, summary = captured("livelink", at_rate(sent), neutral=0.4)
    plain, _ = captured("livelink", at_rate([datagram([0.3] * 61, 18_000 + n / 60) for n in range(60)]))
    assert not live.face.values[:29].any()
    np.testing.assert_allclose(live.face.values[40], plain.face.values[40], atol=1)
    assert not live.face.values[52:].any()  # no weight is less than none
    assert summary.notes == ["the median of the first 0.40 s is the neutral face, subtracted"]


@pytest.mark.parametrize("version", [1, 2])
def test_records_of_ifacialmocap(version: int, tmp_path: Path) -> None:
    head = np.stack([10 * np.sin(np.arange(ROWS) / 9 + n) for n in range(6)], axis=1)
    records = ifacialmocap_records(WEIGHTS, head, head, version=version)
    path = tmp_path / "a.txt"
    path.write_text("\n".join(records))
    sent = at_rate([record.encode() for record in records])
    live, summary = captured("ifacialmocap", [*sent, (2.0, "10.0.0.2", b"StartStreaming")])
    check_same(live, from_blendshapes(ifacialmocap.read_face(path, source_rate=60)), off=1)
    assert summary.refused == {"not records of iFacialMocap": 1}
    lost = records[10].replace("jawOpen", "jawShut").encode()
    _, summary = captured("ifacialmocap", [*sent[:10], (10 / 60, "10.0.0.2", lost), *sent[11:]])
    assert (summary.used, summary.unseen) == (ROWS - 1, 1)


def test_records_that_arrive_in_bursts_count_at_a_steady_rate() -> None:
    clock = ifacial_clock = None
    from fba.live._protocols.ifacialmocap import SteadyClock

    clock, ifacial_clock = SteadyClock(1 / 60), SteadyClock(1 / 60)
    random = np.random.default_rng(3)
    steady = [clock.time(row / 60) for row in range(200)]
    np.testing.assert_allclose(np.diff(steady), 1 / 60, atol=1e-9)
    arrived = np.maximum.accumulate(np.arange(600) / 30 + random.exponential(0.01, 600))
    times = np.array([ifacial_clock.time(float(now)) for now in arrived])
    assert np.diff(times).min() > 0
    assert np.diff(times[300:]).std() < 0.3 * np.diff(arrived[300:]).std()
    assert np.abs(times[300:] - arrived[300:]).max() < 0.06
    assert ifacial_clock.time(100.0) == 100.0  # it was away


def test_objects_of_vtube_studio() -> None:
    head = np.stack([10 * np.sin(np.arange(ROWS) / 9 + n) for n in range(3)], axis=1)
    objects = vtube_objects(WEIGHTS, head)
    unseen = objects[7].replace(b'"FaceFound": true', b'"FaceFound": false')
    bad = [
        b"{}", b"[1]", b'{"FaceFound": 1}', b"\xff\xfe", b"[" * 9000,
        objects[0].replace(b'"Timestamp"', b'"Time"'), objects[0].replace(b'"k"', b'"key"'),
    ]  # fmt: skip
    live, summary = captured("vtube", at_rate([*bad, *objects[:7], unseen, *objects[8:]]))
    seen = np.delete(np.arange(ROWS), 7)
    motion = fba.capture.ShapeMotion(
        tuple(camel(name) for name in WEIGHTS),
        np.stack(list(WEIGHTS.values()), axis=1)[seen],
        np.rint(1000 * seen / 60) / 1000,
        Fraction(60),
        head=np.radians(head[seen]),
    )
    expected = from_blendshapes(motion).face
    np.testing.assert_allclose(live.face.values, expected.values[: len(live)], atol=1)
    assert (summary.used, summary.unseen) == (ROWS - 1, 1)
    assert dict(summary.refused) == {"not objects of VTube Studio": 6, "without a time": 1}


def test_the_newest_datagram_is_shown() -> None:
    capture = Capture(find_kind("livelink"), lambda _frames: None)
    assert capture.newest() == (None, None)
    for row, data in enumerate([*SENT[:9], datagram(None, 18_000 + 9 * STEP)]):
        capture.receive(data, "10.0.0.2", row / 60)
        face, body = capture.newest()
        assert body is None
        if row == 9:
            assert face is None
            continue
        alone, _ = captured("livelink", [(0.0, "10.0.0.2", data)])
        assert face == alone.face
    nobody = Capture(find_kind("vtube"), lambda _frames: None, neutral=1.0)
    nobody.receive(vtube_objects(WEIGHTS, np.zeros((1, 3)))[0], "10.0.0.2", 0.0)
    assert nobody.newest() == (None, None)  # the neutral face is not known yet


def test_swapped_sides() -> None:
    def face(left: float, right: float) -> list[bytes]:
        values = [0.0] * 61
        values[UDP_ORDER.index("MouthLeft")], values[UDP_ORDER.index("MouthRight")] = left, right
        values[UDP_ORDER.index("JawLeft")], values[UDP_ORDER.index("JawRight")] = left, right
        return [datagram(values, 1.0)]

    one, summary = captured("livelink", at_rate(face(0.6, 0.1)), swap=True)
    other, _ = captured("livelink", at_rate(face(0.1, 0.6)))
    assert one.face == other.face
    assert summary.notes == ["mouthLeft/mouthRight and jawLeft/jawRight changed places"]
    assert one != captured("livelink", at_rate(face(0.6, 0.1)))[0]


def test_the_summary_says_everything_once() -> None:
    summary = Summary(
        sender="'Anna' (10.0.0.2)", received=90, used=70, unseen=5, doubled=1, late=2, reordered=3, strayed=4,
        jumps=2, gaps=2, longest_gap=0.5, notes=["a note"],
    )  # fmt: skip
    summary.leave_out("'Bo' (10.0.0.3)")
    summary.refuse("cut short")
    assert summary.lines() == [
        "90 datagrams from 'Anna' (10.0.0.2): 70 used, 5 without a face",
        "3 out of order, put in order, 1 doubled, 2 too late, 4 with a time that no other confirms",
        "2 gaps, 0.50 s at most, are bridged",
        "the sender's clock was set 2 times; the stream continues by ours",
        "left out: 1 cut short",
        "of other senders, left out: 'Bo' (10.0.0.3) (1)",
        "a note",
    ]
    assert summary.values()["refused"] == {"cut short": 1}


def test_a_face_is_sent_again_and_again() -> None:
    now, sent = [0.0], []

    def sleep(seconds: float) -> None:
        now[0] += seconds

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(60)
        animation, _ = captured("livelink", at_rate(SENT[:6]))
        assert animation is not None
        address = ("127.0.0.1", int(receiver.getsockname()[1]))
        count = send(animation, address, loop=True, seconds=0.2, clock=lambda: now[0], sleep=sleep)
        assert count == 12
        sent = [receiver.recv(1000) for _ in range(count)]
    assert now[0] == pytest.approx(11 / 60)
    times = [recorded.read_packet(one, 0, "a.udp")[0] for one in sent]
    assert [round(60 * one.seconds, 3) for one in times if one is not None] == list(range(12))
    with pytest.raises(FbaError, match="cannot be sent to"):
        send(animation, ("127.0.0.1", 0))
