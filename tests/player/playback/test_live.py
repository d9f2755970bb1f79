"""A stream shown while it arrives: frames as soon as they are there, the last one held, damage told."""

import io
import os
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import fba
from fba.animation import Animation
from fba.body import gait
from fba.codec import (
    Decoder,
    EncoderOptions,
    FrameBuffer,
    FrameRate,
    PlaneSettings,
    encode_planes,
    write_mark,
    write_opening,
)
from fba.errors import FbaError
from fba_player.playback._timeline import Timeline
from fba_player.playback._transport import BUFFER_SECONDS, Transport
from fba_player.playback.live import LiveAnimation, LiveTimeline
from fba_player.scene.scene import Scene
from player_tracks import body_track, face_track


class Wire:
    """A pipe: what is sent is read at the other end, bit by bit."""

    def __init__(self) -> None:
        read, write = os.pipe()
        self.out = os.fdopen(read, "rb")
        self.into = os.fdopen(write, "wb", buffering=0)

    def send(self, data: bytes) -> None:
        self.into.write(data)

    def end(self) -> None:
        self.into.close()


@pytest.fixture
def wire() -> Iterator[Wire]:
    pipe = Wire()
    yield pipe
    pipe.into.close()
    until(lambda: not any(t.name == "fba live" and t.is_alive() for t in threading.enumerate()))
    pipe.out.close()


def begun(wire: Wire, data: bytes) -> LiveAnimation:
    """A stream of which this much has arrived: its first frame at least."""
    live = LiveAnimation(wire.out)
    wire.send(data)
    assert live.wait(300)
    return live


def finish(wire: Wire, live: LiveAnimation, data: bytes) -> None:
    """Send the rest, and wait until all of it is there."""
    wire.send(data)
    wire.end()
    until(lambda: not live.growing)


def until(condition: Callable[[], object]) -> None:
    """Wait for another thread, which may have to wait for a processor."""
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() - begun < 300, "nothing came"
        time.sleep(0.002)


def performance(count: int = 600, both: bool = False) -> Animation:
    faces = [{3: 4 * (t % 200), 5: -t % 90} for t in range(count)]
    bodies = [{32: 3000 * (t % 20)} for t in range(count)] if both else None
    body = body_track(bodies) if bodies is not None else None
    return Animation(Fraction(25), np.arange(count), face_track(faces), body, "live")


def stream(animation: Animation, **options: object) -> tuple[bytes, list[int]]:
    """Its bytes, and the byte at which each plane ends."""
    data = fba.encode(animation, EncoderOptions(mark=False, **options))
    decoder = Decoder()
    frames = [*decoder.push(data), *decoder.finish()]
    return data, [(frame.plane.bit + frame.plane.bits + 7) // 8 for frame in frames]


def test_frames_can_be_seen_as_soon_as_they_are_there(wire: Wire) -> None:
    animation = performance(both=True)
    data, ends = stream(animation)
    live = LiveAnimation(wire.out, name="wire")
    timeline = LiveTimeline(live)
    whole = Timeline(fba.decode(data))
    sent = 0
    for frames in (1, 2, 100, 255, 256, 257, 600):
        wire.send(data[sent : ends[frames - 1]])
        sent = ends[frames - 1]
        until(lambda least=frames - 1: len(live) >= least)  # what follows a plane tells that it is complete
        assert live.growing
        last = float(whole.time_of(frames - 2 if frames > 1 else 0))
        for at in (last, last / 2) if len(live) else ():
            np.testing.assert_array_equal(timeline.faps(at), whole.faps(at))
            np.testing.assert_array_equal(timeline.baps(at), whole.baps(at))
    finish(wire, live, data[sent:])
    assert live.snapshot() == fba.decode(data)
    assert live.message == ""
    assert (timeline.frames, timeline.duration) == (600, 24)


def test_playing_begins_with_the_first_i_plane_and_waits_for_what_is_late(wire: Wire) -> None:
    animation = performance(100)
    data, ends = stream(animation)
    live = LiveAnimation(wire.out)
    assert not live.wait(0.0)
    wire.send(data[: ends[9]])  # frames 0 to 8 or 9: more than is needed
    assert live.wait(300)
    shown = len(Decoder().push(data[: ends[9]]))
    until(lambda: len(live) == shown)
    now = [100.0]
    player = Transport(LiveTimeline(live), loop=True, clock=lambda: now[0])
    player.play()
    now[0] += 0.2
    assert player.time == pytest.approx(0.2)
    now[0] += 5.0
    edge = (shown - 1) / 25
    assert (player.time, player.waiting, player.playing) == (pytest.approx(edge), True, True)
    wire.send(data[ends[9] : ends[12]])  # a little more: not enough to go on
    until(lambda: len(live) > shown)
    now[0] += 1.0
    assert (player.time, player.waiting) == (pytest.approx(edge), True)
    wire.send(data[ends[12] : ends[30]])
    until(lambda: len(live) > 25)
    assert player.time == pytest.approx(edge)
    now[0] += 0.1
    assert (player.time, player.waiting) == (pytest.approx(edge + 0.1), False)
    player.last()  # near the newest
    assert player.behind == pytest.approx(BUFFER_SECONDS) == pytest.approx(0.25)
    player.seek(0.1)  # and back, in what has arrived
    now[0] += 0.05
    assert player.time == pytest.approx(0.15)
    finish(wire, live, data[ends[30] :])
    now[0] += 4.0
    assert player.time == pytest.approx(0.15)  # four seconds long, and now it loops
    assert not player.waiting


def test_the_planes_are_counted_as_they_arrive(wire: Wire) -> None:
    data, ends = stream(performance(), intra_period=2)
    live = LiveAnimation(wire.out)
    wire.send(data[: ends[99]])
    until(lambda: len(live) == 100)
    half = live.info()
    wire.send(data[ends[99] :])
    wire.end()
    assert live.wait_end(300)
    whole, file = live.info(), fba.codec.probe_stream(data)
    assert (half.frames, half.size) == (100, ends[99])
    assert half.plane_bits.tolist() == file.plane_bits.tolist()[:100]
    for name in ("format", "size", "rate", "frames", "duration", "start", "skipped", "intra_planes"):
        assert getattr(whole, name) == getattr(file, name), name
    np.testing.assert_array_equal(whole.plane_bits, file.plane_bits)
    np.testing.assert_array_equal(whole.plane_intra, file.plane_intra)
    np.testing.assert_array_equal(whole.frame_index, file.frame_index)


def test_lanes_show_what_has_been_said_so_far(wire: Wire) -> None:
    from fba_player.session._source import Source

    talk = performance(8)
    mask, viseme = talk.face.mask.copy(), np.zeros((8, 4), dtype=np.int16)
    mask[[0, 4], 0], viseme[0, :3], viseme[4:, :3] = True, (10, 0, 63), (1, 0, 63)
    data, ends = stream(replace(talk, face=replace(talk.face, mask=mask, viseme=viseme)))
    live = LiveAnimation(wire.out)
    wire.send(data[: ends[2] + 2])
    assert live.wait()
    source = Source(Scene(live, timeline=LiveTimeline(live)))
    assert [lane.text(0.05) for lane in source.lanes] == ["A: 100%"]
    wire.send(data[ends[2] + 2 :])
    wire.end()
    assert live.wait_end()
    assert [[lane.text(time) for time in (0.05, 0.13, 0.17)] for lane in source.lanes] == [
        ["A: 100%", "A: 100%", "p b m 100%"]
    ]


def test_paused_it_stays_where_it_is_while_more_arrives(wire: Wire) -> None:
    data, ends = stream(performance(100))
    live = begun(wire, data[: ends[20]])
    now = [0.0]
    player = Transport(LiveTimeline(live), clock=lambda: now[0])
    player.seek(0.4)
    length = player.duration
    finish(wire, live, data[ends[20] :])
    now[0] += 3.0
    assert (player.time, player.playing) == (pytest.approx(0.4), False)
    assert player.duration > length


def test_a_mark_in_what_has_arrived_loops_at_once(wire: Wire) -> None:
    data, ends = stream(performance(100))
    live = begun(wire, data[: ends[40]])
    now = [0.0]
    player = Transport(LiveTimeline(live), clock=lambda: now[0])
    player.mark_in, player.mark_out = 0.2, 0.6
    player.play()
    now[0] += 0.7
    assert player.time == pytest.approx(0.3)
    player.clear_marks()
    now[0] += 0.5
    assert player.time == pytest.approx(0.8)


def test_a_stream_that_is_cut_off_shows_what_is_there(wire: Wire) -> None:
    data, ends = stream(performance(100))
    live = LiveAnimation(wire.out)
    wire.send(data[: ends[70] - 2])
    wire.end()
    assert live.wait(300)
    until(lambda: not live.growing)
    assert 68 <= len(live) <= 71
    assert "bytes lost at byte" in live.message
    assert "ends inside" in live.details


def test_words_of_the_source_stay(wire: Wire) -> None:
    """A receiver knows which packets are lost; the decoder only sees that frames are missing."""
    data, ends = stream(performance(200), intra_period=1, start_codes=True)
    live = begun(wire, data[: ends[60]])
    live.tell("packets lost, 3 so far: the pose is held")
    wire.send(data[ends[60] + 3 :])
    wire.end()
    assert live.wait_end(300)
    assert "lost at byte" in live.details
    assert live.message == "packets lost, 3 so far: the pose is held"


def test_damage_is_stepped_over_and_told(wire: Wire) -> None:
    data, ends = stream(performance(200), intra_period=1, start_codes=True)
    broken = bytearray(data)
    broken[ends[60] + 1 : ends[60] + 12] = b"\xff" * 11
    live = LiveAnimation(wire.out)
    wire.send(bytes(broken))
    wire.end()
    assert live.wait(300)
    until(lambda: not live.growing)
    assert "lost" in live.message
    assert 100 < len(live) < 200
    assert int(live.index[-1]) > 150


@pytest.mark.parametrize("data", [b"nothing of the sort", b""])
def test_what_is_no_stream_is_an_error(wire: Wire, data: bytes) -> None:
    live = LiveAnimation(wire.out)
    wire.send(data)
    wire.end()
    with pytest.raises(FbaError, match="00 00 01 ba"):
        live.wait(300)


def test_bytes_that_were_looked_at_before_count(wire: Wire) -> None:
    animation = performance(30)
    data, _ = stream(animation)
    live = LiveAnimation(wire.out, head=data[:7])
    wire.send(data[7:])
    assert not live.wait_end(0.0)
    wire.end()
    assert live.wait_end(300)
    assert live.wait()
    assert len(live) == 30


def test_a_scene_of_a_stream_is_the_scene_of_its_file(wire: Wire) -> None:
    animation = performance(30)
    data, ends = stream(animation)
    live = LiveAnimation(wire.out, name="wire")
    wire.send(data[: ends[15]])
    assert live.wait(300)
    scene = Scene(live, timeline=LiveTimeline(live))
    assert (scene.title, scene.has_body) == ("wire", False)
    ours, theirs = scene.view_at(0.4).faces, Scene(fba.decode(data)).view_at(0.4).faces
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(one.positions, other.positions, atol=1e-6)


def test_the_camera_follows_who_walks_away_later(wire: Wire) -> None:
    steps = [{183: 0 if t < 20 else 100 * (t - 20)} for t in range(100)]  # BAP 183: forwards, mm
    data, ends = stream(Animation(Fraction(25), np.arange(100), body=body_track(steps)))
    live = begun(wire, data[: ends[19]])
    scene = Scene(live, timeline=LiveTimeline(live))
    assert scene.travel(0.5) == (0.0, 0.0, 0.0)
    finish(wire, live, data[ends[19] :])
    assert scene.travel(3.96)[2] == pytest.approx(7.9, abs=0.3)


def test_closing_ends_it_though_the_sender_goes_on(wire: Wire) -> None:
    data, ends = stream(performance(100))
    live = begun(wire, data[: ends[20]])
    live.close()
    assert not live.growing
    before = len(live)
    wire.send(data[ends[20] :])
    wire.end()
    until(lambda: not any(t.name == "fba live" and t.is_alive() for t in threading.enumerate()))
    assert len(live) - before < 100


def test_a_body_that_comes_late_is_told_but_not_shown() -> None:
    frames = FrameBuffer()
    alone, both = performance(10), performance(10, both=True)
    for animation in (alone, both):
        data = fba.encode(animation)
        decoder = Decoder()
        for block in [*decoder.push_blocks(data), *decoder.finish_blocks()]:
            frames.add(block)
        frames.fix_parts()
    now = frames.decoded()
    assert (now.body, frames.left_out) == (None, "a body")
    assert len(now.index) == 20


def test_a_rate_that_changes_keeps_the_times() -> None:
    frames = FrameBuffer()
    for rate, first in ((25, 0), (10, 4)):
        animation = Animation(Fraction(rate), np.arange(10), face=face_track([{3: 9}] * 10))
        decoder = Decoder()
        data = fba.encode(animation)
        for block in [*decoder.push_blocks(data), *decoder.finish_blocks()]:
            frames.add(replace(block, start=block.start + Fraction(first, rate)))
    now = frames.decoded()
    times = now.index / float(now.rate)
    np.testing.assert_allclose(times[:10], np.arange(10) / 25)
    assert (np.diff(times) > 0).all()
    np.testing.assert_allclose(np.diff(times[10:]), 0.1)


@pytest.mark.filterwarnings("ignore:.*the frame rate changes")
@pytest.mark.parametrize("rates", [(FrameRate(30, 0, 1), FrameRate(255, 1)), (FrameRate(25), FrameRate(30))])
def test_times_are_those_of_decode_where_the_rate_changes(
    wire: Wire, rates: tuple[FrameRate, FrameRate]
) -> None:
    animation = performance(200)
    (first,) = Decoder().push_blocks(fba.encode(animation))[:1]
    part = first.settings.face
    planes = [PlaneSettings(t % 100 == 0, face=part, face_frame=t) for t in range(200)]
    for t, rate in zip((0, 100), rates, strict=True):
        planes[t] = replace(planes[t], frame_rate=rate)
    data = encode_planes(animation, planes)
    whole = fba.decode(data)
    live = LiveAnimation(wire.out)
    for start in range(0, len(data), 7):
        wire.send(data[start : start + 7])
    wire.end()
    assert live.wait_end(300)
    assert live.snapshot() == whole
    assert live.duration == whole.duration


def test_arrays_that_somebody_looks_at_do_not_change(wire: Wire) -> None:
    animation = performance(3000)
    data, ends = stream(animation)
    live = begun(wire, data[: ends[50]])
    early = live.snapshot()
    finish(wire, live, data[ends[50] :])
    assert early == fba.decode(data)[: len(early)]
    assert not early.index.flags.writeable
    assert live.snapshot() == fba.decode(data)


def test_how_long_a_slow_stream_is_waited_for(wire: Wire, monkeypatch: pytest.MonkeyPatch) -> None:
    """Longer than a stream sent at its own speed fills the buffer in, and at most a second."""
    waits: list[float | None] = []

    def waited(self: object, condition: Callable[[], object], timeout: float | None = None) -> bool:
        waits.append(timeout)
        return bool(condition())

    data, ends = stream(performance(100))
    live = LiveAnimation(wire.out)
    wire.send(data[: ends[0]])
    until(lambda: len(live))
    monkeypatch.setattr(threading.Condition, "wait_for", waited)
    assert live.wait()
    monkeypatch.undo()
    first, patience = waits
    assert first is None
    assert patience is not None
    assert BUFFER_SECONDS < patience <= 1
    live.close()


def test_the_steps_of_a_body_are_doubted_after_four_seconds(wire: Wire) -> None:
    """A second is too little to judge by; after a minute the viewer has long seen it."""
    walk = gait.walk(rate=25, seconds=8)
    data, ends = stream(walk, bap_steps="visage")
    live = LiveAnimation(wire.out)
    wire.send(data[: ends[90]])  # 3.6 s
    until(lambda: len(live) >= 90)
    wire.send(data[ends[90] : ends[95]])
    until(lambda: len(live) >= 95)  # so a check of the first 90 has ended
    assert live.doubt == ""
    wire.send(data[ends[95] : ends[105]])
    until(lambda: live.doubt)
    assert "made with --bap-steps visage?" in live.doubt
    live.close()


def test_a_stream_that_says_its_steps_is_not_doubted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever its motion looks like."""
    monkeypatch.setattr("fba.body.plausibility.find_doubt", lambda *_: "looks wrong")
    data, _ = stream(gait.walk(rate=25, seconds=3), bap_steps="visage")
    for said, doubt in ((b"", "looks wrong"), (write_mark("visage"), "")):
        live = LiveAnimation(io.BytesIO(data + said), bap_steps="visage")
        assert live.wait_end(300)
        assert live.doubt == doubt
        live.close()


class Pieces(io.BytesIO):
    """A source that gives so many bytes at once."""

    def __init__(self, data: bytes, size: int) -> None:
        super().__init__(data)
        self.size = size

    def read1(self, size: int | None = -1, /) -> bytes:
        return super().read1(self.size)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1000, 1 << 20])
@pytest.mark.parametrize("opened", [True, False])
def test_a_marked_file_that_comes_through_a_pipe_has_the_right_steps(size: int, opened: bool) -> None:
    """Two seconds of a body, its mark behind the end: it is not judged by its first 1.25 seconds."""
    values = np.zeros((50, 296), dtype=np.int32)
    values[:, 31] = 170 * np.arange(50)
    body = fba.BodyTrack(values, np.broadcast_to(values.any(axis=0), values.shape))
    data = fba.encode(Animation(25, np.arange(50), None, body), EncoderOptions(bap_steps="visage"))
    live = LiveAnimation(Pieces(write_opening("visage") * opened + data, size), bap_steps="auto")
    assert live.wait(300)
    assert live.wait_end(300)
    assert (live.bap_steps, live.message) == ("visage", "")
    assert live.steps_explanation == "visage: the stream says so"
    assert (live.body.values == values).all()


def test_a_mark_at_the_end_that_names_other_steps_is_reported() -> None:
    data = fba.encode(performance(both=True), EncoderOptions(bap_steps="visage", clamp=True))
    with warnings.catch_warnings(record=True, action="always"):
        live = LiveAnimation(io.BytesIO(data), bap_steps="iso")
        live.wait_end(300)
    assert live.message == "BAP steps iso are wrong"
    assert live.details.endswith("play it with --bap-steps visage")
