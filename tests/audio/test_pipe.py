"""Sound through pipes: headers that lie, all kinds of samples, pieces of any size, ends anywhere."""

import io
import struct

import numpy as np
import pytest

from fba.arrays import Int16
from fba.audio import read_pipe
from fba.errors import FormatError

TONE = np.asarray(8000 * np.sin(2 * np.pi * 440 * np.arange(16000) / 16000), dtype="<i2")


class Slow(io.BytesIO):
    """A pipe that gives a few bytes at a time, an odd number."""

    def read(self, size: int | None = -1, /) -> bytes:
        return super().read(min(size or 0, 333))


def wave(
    data: bytes = TONE.tobytes(), *, code: int = 1, bits: int = 16, rate: int = 16000, channels: int = 1,
    size: int | None = None, before: bytes = b"",
) -> bytes:  # fmt: skip
    block = channels * bits // 8
    form = struct.pack("<4sIHHIIHH", b"fmt ", 16, code, channels, rate, 0, block % 65536, bits)
    length = len(data) if size is None else size
    return b"RIFF" + b"\xff" * 4 + b"WAVE" + before + form + struct.pack("<4sI", b"data", length) + data


def read(data: bytes, raw_rate: int | None = None) -> Int16:
    return np.concatenate(list(read_pipe(Slow(data), 16000, raw_rate)))


def bits24() -> bytes:
    return (TONE.astype("<i4") * 256).view("u1").reshape(-1, 4)[:, :3].tobytes()


@pytest.mark.parametrize(
    ("data", "settings", "off"),
    [
        (TONE.tobytes(), {}, 0),
        (((TONE >> 8) + 128).astype("u1").tobytes(), {"bits": 8}, 256),
        (bits24(), {"bits": 24}, 0),
        ((TONE.astype("<i4") << 16).tobytes(), {"bits": 32}, 0),
        ((TONE / 32768).astype("<f4").tobytes(), {"bits": 32, "code": 3}, 0),
        ((TONE / 32768).astype("<f8").tobytes(), {"bits": 64, "code": 3}, 0),
        (np.repeat(TONE, 3).tobytes(), {"channels": 3}, 0),
    ],
)
def test_samples_of_all_kinds_are_the_same(data: bytes, settings: dict[str, int], off: int) -> None:
    assert np.abs(read(wave(data, **settings)).astype(int) - TONE).max() <= off  # type: ignore[arg-type]


@pytest.mark.parametrize("size", [0, 4, 0x7FFFFFFF, 0xFFFFFFFF])
def test_the_length_in_a_header_does_not_count(size: int) -> None:
    assert np.array_equal(read(wave(size=size)), TONE)


def test_other_chunks_and_long_formats_are_read() -> None:
    long = struct.pack(
        "<4sIHHIIHHHHIH14s", b"fmt ", 40, 0xFFFE, 1, 16000, 32000, 2, 16, 22, 16, 4, 1, b"\0" * 14
    )
    head = b"RIFF" + bytes(4) + b"WAVE" + struct.pack("<4sI", b"LIST", 3) + b"abc\0" + long
    assert np.array_equal(read(head + struct.pack("<4sI", b"data", 0) + TONE.tobytes()), TONE)


def test_raw_samples_and_an_odd_byte() -> None:
    assert np.array_equal(read(TONE.tobytes() + b"x", 16000), TONE)
    assert np.array_equal(read(wave(), 8000), TONE), "the header of a WAV counts"


@pytest.mark.parametrize(
    ("rate", "late"),
    [(8000, 0.012), (11025, 0.08), (22050, 0.04), (44100, 0.02), (44101, 0.02), (96000, 0.012)],
)
def test_resampling_holds_little_back(rate: int, late: float) -> None:
    noise = np.random.default_rng(1).integers(-9000, 9000, rate).astype("<i2")
    pieces, made = read_pipe(io.BytesIO(noise.tobytes()), 16000, rate), 0
    for number, piece in enumerate(pieces, 1):
        made += len(piece)
        heard = min(12 + (number - 1) * 4096, 2 * rate) / 2 / rate
        assert made / 16000 > heard - late - 0.001
    assert made / 16000 == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "the sound is empty: nothing came"),
        (b"hello, this is a text", r"begins with b'hell'.*--pcm 16000"),
        (b"OggS" + bytes(99), "the sound is Ogg.*ffmpeg -i SOURCE -f wav -"),
        (b"ID3\x04" + bytes(99), "the sound is MP3"),
        (wave()[:30], "cut off before its sound"),
        (wave(rate=0), "claims 0 samples a second"),
        (wave(rate=4_000_000_000), "claims 4000000000 samples a second"),
        (wave(code=7, bits=8), "format 7 with 8 bits in 1 channels"),
        (wave(channels=0), "in 0 channels"),
        (wave(channels=65535), "in 65535 channels"),
        (b"RIFF0000WAVEdata" + bytes(40), "no chunk fmt before data"),
        (b"RIFF0000WAVEfmt \x04\0\0\0" + bytes(40), "chunk fmt has 4 bytes; 16 are needed"),
        (wave(before=b"LIST\xff\xff\xff\x7f"), "2147483647 bytes before its sound"),
    ],
)
def test_what_is_no_sound_is_refused(data: bytes, said: str) -> None:
    with pytest.raises(FormatError, match=said):
        read(data)


def test_floats_that_are_no_numbers_are_silence() -> None:
    strange = np.array([np.nan, np.inf, -np.inf, 0.5, 1e30], dtype="<f4")
    assert read(wave(strange.tobytes(), code=3, bits=32)).tolist() == [0, 32767, -32768, 16384, 32767]
