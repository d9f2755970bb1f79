"""MP4 files with a stream: what is written is read as the same, at exact times, with and without sound."""

import struct
import warnings
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fba
from fba import Animation, BitstreamError, EncoderOptions, FaceTrack, FbaWarning, UnsupportedError
from fba.carriage._boxes import top_boxes
from fba.carriage.mp4 import SoundTrack, list_tracks, read_mp4, split_samples, write_mp4
from fba.codec import (
    encode_animation,
    encode_planes,
    marked_table,
    probe_stream,
    read_planes,
    recode,
    verify_stream,
)
from fba.limits import Limits
from joinable_streams import JOINABLE, performance
from tools.fuzz.small_streams import small_streams

STREAMS = small_streams()
SOUND = SoundTrack(
    "aac",
    bytes.fromhex("1190"),
    48_000,
    2,
    tuple(bytes([number]) * 9 for number in range(150)),
    np.full(150, 1024),
    2112,
)


def face(*index: int, rate: Fraction | int = 25) -> Animation:
    values, mask = np.zeros((len(index), 68), dtype=np.int32), np.zeros((len(index), 68), dtype=bool)
    values[:, 2], mask[:, 2] = 4 * np.arange(len(index)) % 100, True
    return Animation(Fraction(rate), np.array(index), FaceTrack(values, mask))


def boxes(data: bytes) -> Iterator[tuple[str, int, int]]:
    """Name, begin of the content, and end of the boxes of a file."""
    for box in top_boxes(data, None):
        yield box.name, box.begin, box.end


@pytest.mark.parametrize("fragment", [None, 0.08])
@pytest.mark.parametrize("name", STREAMS)
def test_the_same_bytes_come_out_again(name: str, fragment: float | None) -> None:
    stream = STREAMS[name]
    if name == "two_objects":
        pytest.skip("see below")
    with warnings.catch_warnings(action="ignore", category=FbaWarning):  # of the one without an end code
        read = read_mp4(write_mp4(stream, fragment=fragment))
        if name in ("no_end_code", "old_start_codes"):
            assert fba.decode(read.stream) == fba.decode(stream)
        else:
            assert read.stream == stream
        assert read.planes == probe_stream(stream).frames
    assert read.fragmented == (fragment is not None)


@pytest.mark.parametrize("coded", ["all", "later", "intra", "none", "first"])
def test_streams_with_start_codes_in_any_place(coded: str) -> None:
    planes = read_planes(encode_animation(performance(), JOINABLE)[0])
    codes = np.ones(len(planes.settings), dtype=bool)
    if coded == "intra":
        codes = planes.intra
    elif coded in ("none", "first"):
        codes[:] = False
    codes[0] = coded in ("all", "first")
    stream = recode(planes, codes)
    read = read_mp4(write_mp4(stream)).stream
    if coded == "first":  # no encoder does so: it comes out with all start codes
        assert probe_stream(read).start_codes == len(codes)
        assert fba.decode(read) == fba.decode(stream)
    else:
        assert read == stream


def test_samples_are_planes_with_start_codes() -> None:
    stream = encode_animation(performance(), JOINABLE)[0]
    samples = split_samples(stream)
    planes = read_planes(stream)
    assert len(samples.planes) == len(planes.settings)
    assert samples.sync.tolist() == planes.intra.tolist()
    assert all(plane.startswith(b"\0\0\1\xbb") for plane in samples.planes)
    alone = samples.configuration + b"".join(samples.planes) + b"\0\0\1\xb1"
    assert fba.decode(alone) == fba.decode(stream)
    assert write_mp4(stream).count(b"".join(samples.planes)) == 1 or len(planes.settings) > 25


@pytest.mark.parametrize(
    "rate",
    [
        25,
        60,
        Fraction(30_000, 1001),
        Fraction(403, 16),
        Fraction(403, 16) * Fraction(1000, 1001),
        Fraction(1, 16),
    ],
)
def test_times_are_exact(rate: Fraction) -> None:
    index = np.array([0, 1, 2, 7, 8, 300])
    data = write_mp4(encode_animation(face(*index, rate=rate))[0])
    at = data.index(b"mdhd") + 16
    scale, length = struct.unpack_from(">II", data, at)
    assert Fraction(length, scale) == 301 / Fraction(rate)
    at = data.index(b"stts") + 8
    runs = struct.iter_unpack(">II", data[at + 4 : at + 4 + 8 * struct.unpack_from(">I", data, at)[0]])
    durations = [duration for count, duration in runs for _ in range(count)]
    assert [Fraction(each, scale) for each in durations] == [
        Fraction(int(step)) / Fraction(rate) for step in np.diff(np.append(index, 301))
    ]


def test_a_stream_of_one_frame_and_of_i_planes_alone() -> None:
    one = encode_animation(face(0))[0]
    assert read_mp4(write_mp4(one, fragment=2)).stream == one
    every = encode_animation(face(*range(10)), EncoderOptions(intra_period=Fraction(1, 25)))[0]
    data = write_mp4(every)
    assert b"stss" not in data  # all samples are sync samples
    assert read_mp4(data).stream == every


def test_fragments_begin_at_i_planes() -> None:
    stream = encode_animation(performance(), JOINABLE)[0]
    samples = split_samples(stream)
    seconds = samples.index / float(samples.rate)
    data = write_mp4(stream, sound=SOUND, fragment=1)
    moofs = [data[begin:end] for name, begin, end in boxes(data) if name == "moof"]
    first_track = [moof for moof in moofs if moof[moof.index(b"tfhd") + 8 :][:4] == b"\0\0\0\1"]
    assert len(first_track) == int(seconds[-1]) + 1 < len(moofs)
    sizes = {len(plane) for plane, sync in zip(samples.planes, samples.sync, strict=True) if sync}
    for moof in first_track:
        flags, _, _, _, size, first = struct.unpack_from(">6I", moof, moof.index(b"trun") + 4)
        assert (flags, size in sizes, first & 0x10000) == (0x701, True, 0)


def test_fragments_without_i_planes_are_cut_anywhere() -> None:
    stream = encode_animation(face(*range(250)))[0]
    data = write_mp4(stream, sound=SOUND, fragment=Fraction(5, 2))
    assert [name for name, _, _ in boxes(data)] == ["ftyp", "moov", *["moof", "mdat"] * 4]
    assert read_mp4(data).stream == stream


def test_sound_lies_between_planes() -> None:
    stream = encode_animation(face(*range(75)))[0]
    data = write_mp4(stream, sound=SOUND)
    planes, sound = list_tracks(data)
    assert (planes.coding, planes.is_fba, planes.seconds, planes.start) == ("FBA", True, 3, 0)
    assert (sound.coding, sound.kind, sound.rate, sound.channels) == ("AAC", "soun", 48_000, 2)
    assert sound.start == Fraction(-2112, 48_000)
    places = [data.index(packet) for packet in SOUND.packets[:120]]
    assert places == sorted(places)
    assert places[-1] - places[0] > sum(
        map(len, SOUND.packets[:120])
    )  # planes of the first second lie between


@pytest.mark.parametrize("fragment", [None, 1])
@pytest.mark.parametrize("offset", [Fraction(-1, 2), 0, 0.25])
def test_sound_may_begin_at_another_time(offset: Fraction | float, fragment: int | None) -> None:
    data = write_mp4(STREAMS["face"], sound=SOUND, sound_offset=offset, fragment=fragment)
    assert list_tracks(data)[1].start == Fraction(offset) - Fraction(2112, 48_000)
    assert read_mp4(data).stream == STREAMS["face"]


def test_opus_is_described_as_in_mp4() -> None:
    head = b"OpusHead" + struct.pack("<BBHIhB", 1, 2, 312, 44_100, 0, 0)
    sound = SoundTrack("opus", head, 48_000, 2, (b"a", b"b"), np.array([960, 960]), 312)
    data = write_mp4(STREAMS["face"], sound=sound)
    assert data.count(b"dOps" + struct.pack(">BBHIhB", 0, 2, 312, 44_100, 0, 0)) == 1
    assert list_tracks(data)[1].coding == "Opus"


def test_the_configuration_names_the_table_of_a_body() -> None:
    stream = STREAMS["named_before"]
    configuration = split_samples(stream).configuration
    assert marked_table(configuration) == "visage"
    assert b"bap_steps" not in split_samples(STREAMS["face"]).configuration
    assert split_samples(STREAMS["face"]).configuration == bytes.fromhex("000001b061000001b523000001ba")
    unquantised = split_samples(STREAMS["extension_baps"], bap_steps="visage").configuration
    assert unquantised == bytes.fromhex("000001b064000001b523000001ba")  # the same with every table


def test_a_table_that_the_stream_does_not_name() -> None:
    stream = STREAMS["body"]
    assert marked_table(stream) is None
    assert read_mp4(write_mp4(stream)).stream == stream
    named = read_mp4(write_mp4(stream, bap_steps="visage")).stream
    assert marked_table(named) == "visage"
    assert fba.decode(named) == fba.decode(stream, bap_steps="visage")


def test_checks_of_a_stream_find_flipped_bits() -> None:
    stream = encode_animation(performance(), JOINABLE)[0]
    data = bytearray(write_mp4(stream))
    assert verify_stream(read_mp4(bytes(data)).stream).intact
    assert read_mp4(bytes(data)).stream.count(b"crc32=")
    found = 0
    for at in range(len(data) - 2000, len(data), 97):
        data[at] ^= 0x10
        with warnings.catch_warnings(action="ignore", category=FbaWarning):
            found += not verify_stream(read_mp4(bytes(data)).stream).intact
        data[at] ^= 0x10
    assert found == 21


def test_objects_that_fit_into_one_track_and_others() -> None:
    first, second = (
        encode_animation(face(*index), EncoderOptions(mark=False))[0] for index in (range(5), range(7))
    )
    joined = first + second
    assert fba.decode(read_mp4(write_mp4(joined)).stream) == fba.decode(joined)
    with (
        warnings.catch_warnings(action="ignore", category=FbaWarning),  # of the second table
        pytest.raises(UnsupportedError, match="do not fit into one track; make one object of them first"),
    ):
        write_mp4(_marked_otherwise())


def _marked_otherwise() -> bytes:
    body = fba.decode(STREAMS["body"])
    return b"".join(
        encode_animation(body, EncoderOptions(bap_steps=table, bap_quant=3))[0] for table in ("iso", "visage")
    )


def test_damaged_streams_and_wrong_lengths_are_refused() -> None:
    stream = STREAMS["checked"]
    with pytest.raises(BitstreamError):
        write_mp4(stream[: len(stream) // 2])
    with pytest.raises(BitstreamError):
        write_mp4(b"\0\0\1\xba\0\0\1\xb1")
    for length in (0, -1):
        with pytest.raises(ValueError, match="a fragment must last longer"):
            write_mp4(stream, fragment=length)


def test_old_programs_ignore_what_later_ones_say_of_the_original() -> None:
    data = write_mp4(STREAMS["face"])
    at = data.index(bytes.fromhex("0d5ef9b8a1c94c5a9e0c66626121a001")) + 16
    later = data[:at] + b"\2" + data[at + 1 :]
    assert probe_stream(read_mp4(later).stream).start_codes == 5
    assert fba.decode(read_mp4(later).stream) == fba.decode(STREAMS["face"])


def test_long_streams_have_limits() -> None:
    data = write_mp4(STREAMS["face"])
    with pytest.raises(fba.LimitError, match="limit `frames`"):
        read_mp4(data, limits=Limits(frames=4))


@given(
    steps=st.lists(st.integers(1, 40), min_size=1, max_size=12),
    intra=st.sampled_from([None, Fraction(1, 25), Fraction(1, 5)]),
    start_codes=st.booleans(),
    fragment=st.sampled_from([None, 0.1, 1]),
    with_sound=st.booleans(),
)
def test_any_performance(
    steps: list[int], intra: Fraction | None, start_codes: bool, fragment: float | None, with_sound: bool
) -> None:
    animation = face(*np.cumsum(steps) - steps[0])
    stream = encode_animation(animation, EncoderOptions(intra_period=intra, start_codes=start_codes))[0]
    data = write_mp4(stream, fragment=fragment, sound=SOUND if with_sound else None)
    assert read_mp4(data).stream == stream


def test_reading_and_writing_by_name(tmp_path: Path) -> None:
    path = tmp_path / "a.fba.mp4"
    animation = face(*range(30))
    fba.write(path, animation, fragment=0.5, intra_period=Fraction(1, 5), sound=SOUND)
    assert fba.read(path) == animation
    assert (fba.probe(path).format, fba.probe(path).intra_planes) == ("mp4", 6)
    assert [track.kind for track in list_tracks(path.read_bytes())] == ["vide", "soun"]


def test_planes_without_codes_are_coded_as_planes_with_them() -> None:
    """`encode_planes` with the settings of each plane makes what `recode` makes."""
    stream = STREAMS["gaps"]
    planes = read_planes(stream)
    again = encode_planes(planes.animation, planes.settings, bap_steps=planes.bap_steps)
    assert again == recode(planes, planes.coded) == stream
