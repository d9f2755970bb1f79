"""Small streams: an hour of FAPs, and frames that come one by one at a bit rate."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import fba
from bench.conftest import synthetic
from fba import Animation, FaceTrack
from fba.capture import from_blendshapes
from fba.capture.live import widest_faces
from fba.codec import Encoder, EncoderOptions
from fba.formats.face_tables import livelink_udp
from fba.planning import LiveEncoder, Tolerance, encode_planned, encode_within_tolerance
from fba.planning.rate import RateEncoder
from tools.captures import face_files

HOUR = 90_000
"""Frames at 25 Hz."""
FRAMES = 1200


@pytest.fixture(scope="module")
def hour() -> Animation:
    """An hour of 66 FAPs at 25 Hz, of which right sides and outer lips move as left sides and inner lips."""
    made = synthetic(HOUR)
    assert made.face is not None
    values = made.face.values.copy()
    for one in fba.parameters.faps():
        if one.lip_mate and one.group == 8:
            values[:, one.number - 1] = values[:, one.lip_mate - 1]
    return Animation(25, made.index, FaceTrack(values, made.face.mask))


def seconds_of(function: Callable[[], Any]) -> float:
    """Return the processor time that a function takes."""
    begin = time.process_time()
    function()
    return time.process_time() - begin


def test_an_hour_compact(benchmark: Any, hour: Animation, report: Callable[[str], None]) -> None:
    """The preset of captures, beside the plain encoder, which it contains."""
    encode_planned(hour[:500], preset="compact")
    fba.encode(hour[:500])
    plain = seconds_of(lambda: fba.encode(hour))
    seconds: list[float] = []

    def encode() -> None:
        seconds.append(seconds_of(lambda: encode_planned(hour, preset="compact")))

    benchmark.pedantic(encode, rounds=3)
    took = statistics.median(seconds)
    benchmark.extra_info.update(seconds=took, ratio=took / plain)
    report(f"an hour of FAPs, compact: {took:.1f} s of processor, {took / plain:.1f} times the plain encoder")


def test_an_hour_within_a_tolerance(benchmark: Any, hour: Animation, report: Callable[[str], None]) -> None:
    """Half a millimetre on the built-in head, measured on the decoded stream."""
    encode_within_tolerance(hour[:200], Tolerance())
    plain = seconds_of(lambda: fba.encode(hour))
    seconds: list[float] = []

    def encode() -> None:
        seconds.append(seconds_of(lambda: encode_within_tolerance(hour, Tolerance())))

    benchmark.pedantic(encode, rounds=1)
    took = seconds[0]
    benchmark.extra_info.update(seconds=took, ratio=took / plain)
    report(
        f"an hour of FAPs within 0.5 mm: {took:.0f} s of processor, {took / plain:.0f} times the plain "
        "encoder"
    )


@pytest.mark.parametrize("bit_rate", [1500, 20_000])
def test_a_frame_at_a_bit_rate(
    benchmark: Any, tmp_path: Any, bit_rate: int, report: Callable[[str], None]
) -> None:
    """One frame a call: twenty seconds of Live Link Face at 60 Hz, in which all shapes and angles move.

    At 1500 bit/s most frames are left out; at 20 kbit/s each has a plane.
    """
    path = tmp_path / "a.udp"
    weights = face_files.face_weights(FRAMES) | face_files.face_angles(FRAMES)
    path.write_bytes(b"".join(face_files.livelink_udp(weights)))
    animation = from_blendshapes(livelink_udp.read_face(path, swap="no"), Fraction(60))
    assert animation.face is not None
    frames = [
        fba.Frame(frame.index, frame.rate, FaceTrack(frame.face.values.copy(), frame.face.mask.copy()))
        for frame in animation
        if frame.face is not None
    ]
    times: list[float] = []

    def encode() -> RateEncoder:
        times.clear()
        encoder = RateEncoder(bit_rate, 1.5, EncoderOptions(clamp=True))
        encoder.expect(widest_faces())
        for frame in frames:
            begin = time.process_time()
            encoder.push(frame)
            times.append(time.process_time() - begin)
        encoder.finish()
        return encoder

    encode()
    encoder = benchmark.pedantic(encode, rounds=3)
    median, slow = 1000 * statistics.median(times[1:]), 1000 * float(np.percentile(times[1:], 99))
    every = 1 / statistics.fmean(times)
    benchmark.extra_info.update(median=median, slow=slow, rate=every)
    report(
        f"{bit_rate} bit/s: {median:.2f} ms a frame, {slow:.2f} ms in 99 % of them, the first (an I plane) "
        f"{1000 * times[0]:.0f} ms; {every:,.0f} frames/s; {encoder.statistics.left_out} of {len(frames)} "
        "left out"
    )


def test_a_frame_that_keeps_what_is_shown(
    benchmark: Any, hour: Animation, report: Callable[[str], None]
) -> None:
    """One frame a call, with nothing known before, beside the plain encoder in the same way."""
    options = EncoderOptions(clamp=True)
    frames = list(hour[:2000])

    def seconds_a_frame(encoder: Encoder | LiveEncoder) -> float:
        begin = time.process_time()
        for frame in frames:
            encoder.push(frame)
        encoder.finish()
        return (time.process_time() - begin) / len(frames)

    seconds_a_frame(LiveEncoder(options))
    plain = seconds_a_frame(Encoder(options))
    took = benchmark.pedantic(lambda: seconds_a_frame(LiveEncoder(options)), rounds=3)
    benchmark.extra_info.update(seconds=took, ratio=took / plain)
    report(f"{1 / took:,.0f} frames/s of FAPs as they are shown, {took / plain:.1f} times the plain encoder")
