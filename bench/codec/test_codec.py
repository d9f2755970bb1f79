"""Speed and memory of the codec.

The textbook coder of `bench.codec.linear` and ours code the same symbols in the same run, compiled the
same way: the ratio is what to quote.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest

import fba
from bench.codec import linear
from fba import Animation
from fba.codec import FrameRate, PartSettings, PlaneSettings, RangeLists, encode_planes
from fba.codec._plane.arithmetic import ALPHABET_MAX, STRIDE, Counts, decode_segment, encode_segment, learn
from fba.codec.settings import RANGE_CODE_MAX
from fba.compiled import compiled
from fba.parameters import fap_steps

ROUNDS = 15
pytestmark = pytest.mark.benchmark(timer=time.process_time)  # of one core, whoever else uses the machine
LEVEL_MAX = ALPHABET_MAX // 2


@pytest.fixture(scope="module")
def wide(head_motion: tuple[Animation, str, str]) -> bytes:
    """The animation coded with the widest ranges: alphabets of 3721 symbols, as old encoders do."""
    animation, bap_steps, _ = head_motion
    assert animation.face is not None
    codes = np.full(68, RANGE_CODE_MAX, dtype=np.uint8)
    mask = animation.face.mask[0]
    types = tuple(3 if mask[np.array(group) - 1].all() else 0 for group in fba.parameters.fap_groups())
    settings = PartSettings(types, mask, ranges=RangeLists(codes, codes, codes, codes))
    planes = [
        PlaneSettings(
            intra=not position,
            face_frame=int(index),
            face=settings,
            frame_rate=FrameRate.from_fraction(animation.rate) if not position else None,
        )
        for position, index in enumerate(animation.index)
    ]
    return encode_planes(animation, planes, bap_steps=bap_steps)


def textbook_symbols(animation: Animation) -> np.ndarray:
    """The P-plane symbols of the low-level FAPs, (T - 1, 66)."""
    assert animation.face is not None
    levels = np.rint(animation.face.values[:, 2:] / fap_steps()[2:]).astype(np.int64)
    symbols = np.diff(levels, axis=0) + LEVEL_MAX
    return np.ascontiguousarray(np.clip(symbols, 0, ALPHABET_MAX - 1))


@compiled
def coded_alone(data: np.ndarray, symbols: np.ndarray, slots: np.ndarray, models: Counts) -> int:
    """Encode rows of symbols with our arithmetic coder and nothing around it, as `linear.encode` does."""
    bit = 0
    for row in range(symbols.shape[0]):
        bit = encode_segment(data, bit, slots, models, True, symbols[row])
        learn(slots, symbols[row], models)
    return bit


@compiled
def decoded_alone(data: np.ndarray, bits: int, slots: np.ndarray, models: Counts, decoded: np.ndarray) -> int:
    bit = 0
    for row in range(decoded.shape[0]):
        _, bit = decode_segment(data, bit, bits, slots, models, True, decoded[row])
        learn(slots, decoded[row], models)
    return bit


def fresh(count: int) -> Counts:
    """Models of so many parameters with alphabets of 3721 symbols, all counts 1."""
    size = np.full(count, ALPHABET_MAX, dtype=np.int64)
    usual = np.full(count, LEVEL_MAX, dtype=np.int64)
    tables = [np.zeros((count, STRIDE), dtype=np.uint16) for _ in range(2)]
    return Counts(size, usual, size.copy(), usual.copy(), *tables)


def timed(function: Callable[[], Any]) -> float:
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return median(times)


def test_decode(
    benchmark: Any, wide: bytes, head_motion: tuple[Animation, str, str], report: Callable[[str], None]
) -> None:
    """Decoding beside the textbook's coder, and beside our arithmetic coder with nothing around it.

    Why a stream is decoded at 0.5 to 0.6 times the speed of the coder alone (measured on headmotion_long,
    with `decode_run` timed from outside): 14 % of the time goes into headers of I planes, blocks, and the
    rows that blocks are joined in. In the loop over planes, 14 million symbols/s are decoded where the
    coder alone does 20: that is the price of what a plane has besides symbols (header, skip, flags, look-
    ahead for start codes) and of values, which are checked against their limits before anything is
    stored. Holding the tables of the models in local variables changed nothing, nor did divisions of
    unsigned numbers. A coder that reads words instead of bits was not tried: the 1s inserted after 22
    zeros, and the end of a segment, which is found by counting bits, would be hard to follow.
    """
    animation, bap_steps, source = head_motion
    symbols = textbook_symbols(animation)
    models = np.zeros((symbols.shape[1], ALPHABET_MAX + 1), dtype=np.int64)
    data = np.zeros(4 * symbols.size, dtype=np.uint8)
    linear.reset(models, ALPHABET_MAX)
    bits = linear.encode(data, symbols, ALPHABET_MAX, models)
    decoded = np.zeros_like(symbols)

    def textbook() -> None:
        linear.reset(models, ALPHABET_MAX)
        assert linear.decode(data, decoded, ALPHABET_MAX, models) == bits

    textbook()
    assert np.array_equal(decoded, symbols)
    slow = timed(textbook) / symbols.size
    result = benchmark.pedantic(fba.decode, (wide,), {"bap_steps": bap_steps}, rounds=ROUNDS, warmup_rounds=2)
    assert result == animation
    fast = benchmark.stats.stats.median / (66 * len(animation))
    slots = np.arange(symbols.shape[1])
    ours = np.zeros_like(symbols)

    def alone() -> None:
        assert decoded_alone(data, bits, slots, fresh(len(slots)), ours) == bits

    alone()
    assert np.array_equal(ours, symbols)
    bare = timed(alone) / symbols.size
    benchmark.extra_info.update(rate=1e-6 / fast, ratio=slow / fast, bare_ratio=slow / bare, stream=source)
    report(
        f"decode {source}: {1e-6 / fast:.1f} million symbols/s; textbook coder {1e-6 / slow:.2f}: "
        f"ratio {slow / fast:.1f}; coder alone {1e-6 / bare:.1f}: ratio {slow / bare:.1f}"
    )


def test_decode_in_javascript(
    benchmark: Any,
    wide: bytes,
    head_motion: tuple[Animation, str, str],
    report: Callable[[str], None],
    tmp_path: Path,
) -> None:
    """The decoder of docs/web.md under node, beside the one in Python on the same stream."""
    if shutil.which("node") is None:
        pytest.skip("no node here")
    animation, bap_steps, source = head_motion
    file = tmp_path / "wide.fba"
    file.write_bytes(wide)
    program = Path(__file__).parents[2] / "tools" / "web" / "measure.mjs"

    def run() -> float:
        command = ["node", program, file, bap_steps, str(ROUNDS)]
        return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    seconds = benchmark.pedantic(run, rounds=1)
    fba.decode(wide, bap_steps=bap_steps)
    python = timed(lambda: fba.decode(wide, bap_steps=bap_steps))
    rate = 1e-6 * 66 * len(animation) / seconds
    benchmark.extra_info.update(rate=rate, ratio=python / seconds, stream=source)
    report(f"decode {source} in node: {rate:.1f} million symbols/s, {python / seconds:.2f} times Python's")


def test_encode(
    benchmark: Any, head_motion: tuple[Animation, str, str], wide: bytes, report: Callable[[str], None]
) -> None:
    """Encoding beside the textbook's coder, and beside our arithmetic coder with nothing around it.

    Why it runs at 0.4 times the speed of the coder alone (measured on headmotion_long, with `encode_run`
    and `fitting_ranges` timed from outside): 61 % of the time goes into the loop over planes, which
    quantises every value besides coding it; 13 % into finding ranges that fit, which make the stream a
    third as long; the rest into rows of values and runs of equal masks.
    """
    animation, bap_steps, source = head_motion
    symbols = textbook_symbols(animation)
    models = np.zeros((symbols.shape[1], ALPHABET_MAX + 1), dtype=np.int64)

    def textbook() -> None:
        linear.reset(models, ALPHABET_MAX)
        linear.encode(np.zeros(4 * symbols.size, dtype=np.uint8), symbols, ALPHABET_MAX, models)

    textbook()
    slow = timed(textbook) / symbols.size
    options = fba.EncoderOptions(bap_steps=bap_steps)
    data = benchmark.pedantic(fba.encode, (animation, options), rounds=ROUNDS, warmup_rounds=2)
    assert fba.decode(data, bap_steps=bap_steps) == animation
    fast = benchmark.stats.stats.median / (66 * len(animation))
    slots = np.arange(symbols.shape[1])
    buffer = np.zeros(4 * symbols.size, dtype=np.uint8)

    def alone() -> None:
        buffer[:] = 0
        coded_alone(buffer, symbols, slots, fresh(len(slots)))

    alone()
    bare = timed(alone) / symbols.size
    benchmark.extra_info.update(rate=1e-6 / fast, ratio=slow / fast, bare_ratio=slow / bare, stream=source)
    report(
        f"encode {source}: {1e-6 / fast:.1f} million symbols/s; textbook coder {1e-6 / slow:.2f}: "
        f"ratio {slow / fast:.1f}; coder alone {1e-6 / bare:.1f}: ratio {slow / bare:.1f}; "
        f"{len(data)} bytes with fitted ranges, {len(wide)} with the widest"
    )


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="peak memory is read from /proc")
@pytest.mark.parametrize("way", ["one-shot", "streaming"])
def test_memory_of_an_hour(benchmark: Any, way: str, report: Callable[[str], None]) -> None:
    """Peak memory of a process that decodes an hour of 68 FAPs at 25 Hz."""
    script = textwrap.dedent(
        f"""
        import re, sys
        from pathlib import Path
        import fba

        def peak():  # of this process alone; getrusage would count the one that started it
            return int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text()).group(1))

        data = sys.stdin.buffer.read()
        fba.decode(data[: 1 << 12], on_error="salvage")  # compiles
        before = peak()
        if {way == "one-shot"}:
            frames = len(fba.decode(data))
        else:
            decoder, frames = fba.Decoder(), 0
            for start in range(0, len(data), 4096):
                frames += len(decoder.push(data[start : start + 4096]))
            frames += len(decoder.finish())
        after = peak()
        print(frames, before, after)
        """
    )
    from bench.conftest import synthetic  # pytest puts the project's root on the path

    data = fba.encode(synthetic(90_000))
    command = [sys.executable, "-W", "ignore", "-c", script]
    subprocess.run(command, input=data, capture_output=True, check=True)  # what it compiles takes memory, too
    run = benchmark.pedantic(
        subprocess.run, (command,), {"input": data, "capture_output": True, "check": True}
    )
    frames, before, after = map(int, run.stdout.split())
    assert frames == 90_000
    benchmark.extra_info.update(peak=after / 1024, before=before / 1024)
    report(
        f"an hour of 68 FAPs at 25 Hz ({len(data)} bytes), {way}: peak {after / 1024:.0f} MB, "
        f"of which {before / 1024:.0f} MB are Python, NumPy and numba"
    )


def test_frame_by_frame(
    benchmark: Any, head_motion: tuple[Animation, str, str], report: Callable[[str], None]
) -> None:
    """One frame a call, as live streams need it: an encoder and a decoder that get a frame at a time.

    The frames have arrays of their own, as those of a camera have, not slices of a decoded stream.
    """
    animation, bap_steps, source = head_motion
    assert animation.face is not None
    frames = [
        fba.Frame(frame.index, frame.rate, fba.FaceTrack(frame.face.values.copy(), frame.face.mask.copy()))
        for frame in animation
        if frame.face is not None
    ]
    options = fba.EncoderOptions(bap_steps=bap_steps, clamp=True)

    def encode() -> list[bytes]:
        encoder = fba.Encoder(options)
        return [*(encoder.push(frame) for frame in frames), encoder.finish()]

    pieces = encode()

    def decode() -> int:
        decoder = fba.Decoder(bap_steps=bap_steps)
        return sum(len(decoder.push(piece)) for piece in pieces) + len(decoder.finish())

    assert benchmark.pedantic(decode, rounds=ROUNDS, warmup_rounds=1) == len(frames)
    decoded = len(frames) / benchmark.stats.stats.median
    encoded = len(frames) / timed(encode)
    benchmark.extra_info.update(encoded=encoded, decoded=decoded)
    report(f"one frame a call, {source}: {encoded:,.0f} frames/s encoded, {decoded:,.0f} decoded")


def test_byte_by_byte(benchmark: Any, report: Callable[[str], None]) -> None:
    """A stream of I planes that comes a byte at a time: the header of a plane is read once, not once a byte.

    The segment is tried again with every byte, so that no frame waits for the next one; that costs about 0.1
    microseconds a symbol, which is what large planes take more.
    """
    per_byte: dict[int, float] = {}
    for count in (4, 66):
        mask = np.zeros((60, 68), dtype=bool)
        mask[:, 2 : 2 + count] = True
        animation = Animation(25, np.arange(60), fba.FaceTrack(np.zeros(mask.shape, dtype=np.int32), mask))
        data = fba.encode(animation, fba.EncoderOptions(intra_period=0.04, start_codes=True))

        def push(data: bytes = data) -> int:
            decoder = fba.Decoder()
            return sum(len(decoder.push(data[at : at + 1])) for at in range(len(data))) + len(
                decoder.finish()
            )

        if count == 66:
            assert benchmark.pedantic(push, rounds=ROUNDS, warmup_rounds=1) == 60
            per_byte[count] = benchmark.stats.stats.median / len(data)
        else:
            push()
            per_byte[count] = timed(push) / len(data)
    ratio = per_byte[66] / per_byte[4]
    benchmark.extra_info.update(microseconds=1e6 * per_byte[66], ratio=ratio)
    report(
        f"I planes a byte at a time: {1e6 * per_byte[4]:.0f} us a byte for 4 FAPs, "
        f"{1e6 * per_byte[66]:.0f} us for 66 with all ranges: ratio {ratio:.2f}"
    )


@pytest.mark.parametrize("kind", ["empty planes", "parts by turns", "I planes", "objects", "start codes"])
@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_hostile_streams(benchmark: Any, kind: str, report: Callable[[str], None]) -> None:
    """Streams of planes that hold nothing: time for 100 kB, and growth when a stream is twice as long."""
    face = "00001" + "100" * 10 + "000000" + "01"
    body = "00001" + "100" * 24 + "000000" + "01"
    rate = "1" + f"{25:08b}" + "00000" + "00"
    first = {"parts by turns": f"111{rate}{face}{body}"}.get(kind, f"101{rate}{face}")
    piece = {
        "empty planes": "001001",
        "parts by turns": "001001" + "010001",
        "I planes": f"101000{face}",
        "objects": f"{0x1BA:032b}101000{face}",
        "start codes": f"{0x1BB:032b}001001",
    }[kind]
    if kind in ("objects", "start codes"):
        piece += "0" + "1" * ((-len(piece) - 1) % 8)

    def stream(size: int) -> bytes:
        start = first + ("0" + "1" * ((-len(first) - 1) % 8) if len(piece) % 8 == 0 else "")
        bits = np.frombuffer((start + piece * (8 * size // len(piece))).encode(), dtype=np.uint8) - ord("0")
        return b"\0\0\1\xba" + np.packbits(bits).tobytes()

    def decode(data: bytes) -> int:
        return len(fba.decode(data, on_error="salvage"))

    half, whole = stream(50_000), stream(100_000)
    decode(half)
    shorter = (
        timed(lambda: decode(half)) if kind in ("empty planes", "parts by turns") else _once(decode, half)
    )
    benchmark.pedantic(decode, (whole,), rounds=3)
    took = benchmark.stats.stats.median
    benchmark.extra_info.update(seconds=took, growth=took / shorter)
    report(f"100 kB of {kind}: {took:.2f} s; {took / shorter:.1f} times as long as 50 kB")


def _once(function: Callable[[bytes], Any], data: bytes) -> float:
    start = time.process_time()
    function(data)
    return time.process_time() - start
