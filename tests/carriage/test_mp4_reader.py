"""MP4 files of other programs, in all forms of their boxes, and damaged, contradictory and hostile ones."""

import re
import struct
from pathlib import Path
from typing import Any

import pytest

import fba
from fba import FbaError, FbaWarning, FormatError, LimitError, UnsupportedError
from fba.carriage.mp4 import list_tracks, read_mp4, split_samples
from fba.codec import encode_animation, read_planes
from joinable_streams import JOINABLE, performance
from mp4_files import CONFIGURATION, Track, box, esds, fragmented_file, full, numbers, whole_file

STREAM = encode_animation(performance(body=False), JOINABLE)[0]
SAMPLES = split_samples(STREAM)
PLANES = SAMPLES.planes[:60]
SYNC = [number for number, sync in enumerate(SAMPLES.sync[:60].tolist(), 1) if sync]
PLAIN = CONFIGURATION + b"".join(PLANES) + b"\0\0\1\xb1"
SOUND = Track(
    [b"sound"] * 3,
    number=2,
    handler=b"soun",
    entry=b"mp4a",
    described=esds(b"\x11\x90", object_type=64),
    sync=None,
)


def track(**changed: Any) -> Track:
    return Track(PLANES, sync=SYNC, **changed)


FORMS = {
    "usual": whole_file(track()),
    "tables behind the data": whole_file(track(), moov_last=True),
    "64-bit size": whole_file(track(), data="long"),
    "size to the end": whole_file(track(), data="rest"),
    "co64": whole_file(track(wide=True)),
    "stz2, 16 bits": whole_file(track(sizes="16")),
    "64-bit times": whole_file(track(version=1, edits=[(100, -1), (50, 0)])),
    "chunks of several sizes": whole_file(track(chunks=(1, 3, 7, 2))),
    "one chunk": whole_file(track(chunks=(1000,))),
    "sound before": whole_file(SOUND, track()),
    "sound behind": whole_file(track(), SOUND),
    "unknown boxes": whole_file(
        track(), padding=box(b"free", b"moov") + box(b"uuid", bytes(20)) + box(b"wide")
    ),
    "lengths of four bytes": whole_file(track(described=esds(digits=4))),
    "lengths of two bytes": whole_file(track(described=esds(digits=2))),
    "descriptor with all fields": whole_file(track(described=esds(flags=0xE0))),
    "boxes around esds": whole_file(
        track(described=box(b"pasp", bytes(8)) + esds() + box(b"btrt", bytes(12)))
    ),
    "mp4s": whole_file(track(entry=b"mp4s")),
    "no sync table": whole_file(Track(PLANES, sync=None)),
    "fragments": fragmented_file(track(), [20, 25]),
    "fragments, offsets in the file": fragmented_file(track(), [20, 25], base="file"),
    "fragments, old offsets": fragmented_file(track(), [20], base="old"),
    "fragments behind others": fragmented_file(track(), [20], base="old", other=True),
    "fragments with flags of the first": fragmented_file(track(), [25], flags="first"),
    "fragments with sound": fragmented_file(track(), [25], other=True),
    "zeros at the end": whole_file(track()) + bytes(5),
}


@pytest.mark.parametrize("form", FORMS)
def test_forms(form: str) -> None:
    read = read_mp4(FORMS[form])
    assert read.stream == PLAIN
    assert read.planes == 60
    assert read.track.is_fba
    assert fba.decode(read.stream) == read_planes(STREAM).animation[:60]


def test_sizes_of_few_bits() -> None:
    small = split_samples(encode_animation(performance(body=False)[:30], JOINABLE)[0]).planes
    assert max(map(len, small)) < 256
    assert read_mp4(whole_file(Track(small, sizes="8"))).planes == 30
    data = whole_file(Track([b"\0\0\1\xbb\xff" * 3] * 5, sizes="4"))
    assert read_mp4(data).stream.count(b"\0\0\1\xbb\xff" * 15) == 1


def test_samples_of_one_size() -> None:
    sample = PLANES[0]
    data = whole_file(Track([sample] * 3, chunks=(3,)))
    at = data.index(b"stsz") - 4
    count = full(b"stsz", 0, 0, numbers(len(sample), 3)) + box(b"free", bytes(4))
    assert read_mp4(data[:at] + count + data[at + len(count) :]).stream.count(sample * 3) == 1


def test_a_configuration_without_the_code_of_the_object() -> None:
    for configuration in (CONFIGURATION[:10], b""):
        data = whole_file(track(described=esds(configuration)))
        assert fba.decode(read_mp4(data).stream) == fba.decode(PLAIN)
    with_object = [CONFIGURATION[-4:] + PLANES[0], *PLANES[1:]]
    data = whole_file(Track(with_object, described=esds(CONFIGURATION[:10])))
    assert fba.decode(read_mp4(data).stream) == fba.decode(PLAIN)
    with_identifier = CONFIGURATION[:9] + b"\x89\x40" + CONFIGURATION[10:]
    assert list_tracks(whole_file(track(described=esds(with_identifier))))[0].is_fba


def test_video_is_no_stream() -> None:
    for described in (esds(b"\0\0\1\xb0\1\0\0\1\xb5\x09\0\0\1\0\0\0\1\x20\0"), esds(object_type=0x6C), b""):
        with pytest.raises(
            FormatError, match="has no FBA track; its tracks: 1: video mp4v; 2: sound AAC, 48000 Hz, 1 cha"
        ):
            read_mp4(whole_file(track(described=described), SOUND))
    with pytest.raises(FormatError, match="no FBA track; its tracks: 1: video avc1"):
        read_mp4(whole_file(track(entry=b"avc1")))


def test_of_several_streams_one_is_chosen() -> None:
    other = Track([PLANES[0]], number=7)
    data = whole_file(track(), SOUND, other)
    with pytest.raises(FormatError, match=r"several FBA tracks: 1, 7; choose one with track=1"):
        read_mp4(data)
    assert (read_mp4(data, track=1).planes, read_mp4(data, track=7).planes) == (60, 1)
    for number in (2, 3):
        with pytest.raises(FormatError, match=f"no FBA track {number}; those with FBA: 1, 7"):
            read_mp4(data, track=number)


def test_edit_lists_say_when_the_first_sample_is_due() -> None:
    for edits, start in (
        ([(500, -1), (9, 0)], 0.5),
        ([(9, 5)], -0.2),
        ([(250, -1), (250, -1), (9, 25)], -0.5),
        ([(40, -1)], 0.04),
    ):
        assert float(read_mp4(whole_file(track(edits=edits))).track.start) == start


def change(data: bytes, kind: bytes, offset: int, content: bytes, *, last: bool = False) -> bytes:
    """Other bytes at an offset in the content of the first, or last, box of a kind."""
    at = (data.rindex(kind) if last else data.index(kind)) + 4 + offset
    return data[:at] + content + data[at + len(content) :]


MANY = b"\xff" * 4
USUAL, FRAGMENTS = FORMS["usual"], FORMS["fragments"]
WRONG = {
    "counts of sizes": (change(USUAL, b"stsz", 8, MANY), "'stsz' at byte .* announces 4294967295 entries"),
    "constant size": (change(USUAL, b"stsz", 4, MANY), "sample 1 of 60 .* has 4294967295 bytes"),
    "a large sample": (change(USUAL, b"stsz", 12, MANY), "sample 1 of 60 .* has 4294967295 bytes"),
    "counts of times": (change(USUAL, b"stts", 4, MANY), "'stts' at byte .* announces 4294967295 entries"),
    "times of other samples": (change(USUAL, b"stts", 8, MANY), "durations of 4294967354 samples, and"),
    "counts of chunks": (change(USUAL, b"stco", 4, MANY), "'stco' at byte .* announces"),
    "chunks beyond the file": (change(USUAL, b"stco", 8, MANY), "sample 1 of 60 .* was cut off"),
    "runs of chunks": (change(USUAL, b"stsc", 4, MANY), "'stsc' at byte .* announces"),
    "samples of a chunk": (change(USUAL, b"stsc", 12, MANY), "hold 4294967351 samples, and the track has 60"),
    "no first chunk": (change(USUAL, b"stsc", 8, numbers(2)), "do not cover the 15 chunks in order"),
    "sync samples": (change(USUAL, b"stss", 8, MANY), "names sample 4294967295, and the track has 60"),
    "counts of sync samples": (change(USUAL, b"stss", 4, MANY), "'stss' at byte .* announces"),
    "time scale": (change(USUAL, b"mdhd", 12, bytes(4)), "its time scale is 0"),
    "box too large": (change(USUAL, b"stbl", -8, MANY), "'stbl' at byte .* announces 4294967295 bytes, and"),
    "box too small": (change(USUAL, b"minf", -8, numbers(3)), "fewer than its own header"),
    "no sizes": (change(USUAL, b"stsz", -4, b"free"), "has no box 'stsz'"),
    "no chunks": (change(USUAL, b"stco", -4, b"free"), "has no box 'co64'"),
    "no times": (change(USUAL, b"stts", -4, b"free"), "has no box 'stts'"),
    "no description": (change(USUAL, b"moov", -4, b"free"), "has no box 'moov', .*'ftyp', 'free', 'mdat'"),
    "descriptor": (change(USUAL, b"esds", 5, b"\x7f"), "descriptor 3 announces 127 bytes, and"),
    "descriptors": (change(USUAL, b"esds", 4, b"\x09"), "no descriptor 3, which is needed"),
    "edits": (change(FORMS["64-bit times"], b"elst", 4, MANY), "announces 4294967295 edits"),
    "samples of a fragment": (change(FRAGMENTS, b"trun", 4, MANY), "'trun' at byte .* announces"),
    "place of a fragment": (change(FRAGMENTS, b"trun", 8, b"\x7f\xff\xff\xff"), "sample 1 of 60"),
    "place before the file": (change(FRAGMENTS, b"trun", 8, b"\x80\0\0\0"), "sample 1 of 60"),
    "sizes in a fragment": (change(FRAGMENTS, b"trun", 16, MANY), "sample 1 of 60"),
    "width of sizes": (change(FORMS["stz2, 16 bits"], b"stz2", 7, b"\7"), "sizes have 7 bits, and 4, 8"),
}  # fmt: skip


@pytest.mark.parametrize("fault", WRONG)
def test_contradictions(fault: str, tmp_path: Path) -> None:
    data, finding = WRONG[fault]
    path = tmp_path / "a.mp4"
    path.write_bytes(data)
    with pytest.raises(FbaError, match=f"{re.escape(str(path))}.*{finding}"):
        fba.read(path)


def test_counts_without_bytes_take_no_memory() -> None:
    """A run in a fragment, and a table of equal samples, may announce samples that have no bytes."""
    head = FRAGMENTS[: FRAGMENTS.index(b"moof") - 4]
    run = full(b"trun", 0, 0, numbers(0xFFFFFFFF))
    moof = box(
        b"moof", full(b"mfhd", 0, 0, numbers(1)), box(b"traf", full(b"tfhd", 0, 0x20000, numbers(1)), run)
    )
    with pytest.raises(LimitError, match="the track has 4294967295 frames"):
        read_mp4(head + moof)
    with pytest.raises(LimitError, match="the track has 4294967295 frames"):
        read_mp4(change(USUAL, b"stsz", 4, numbers(1, 0xFFFFFFFF)))
    run = full(b"trun", 0, 0, numbers(400_000))
    moof = box(
        b"moof", full(b"mfhd", 0, 0, numbers(1)), box(b"traf", full(b"tfhd", 0, 0x20000, numbers(1)), run)
    )
    with pytest.raises(LimitError, match="the list of samples takes 160000000 bytes"):
        read_mp4(head + moof * 20)


def test_overlapping_chunks_give_no_more_bytes_than_the_file() -> None:
    large = [b"\0\0\1\xbb" + bytes(1000)] * 40
    data = whole_file(Track(large, chunks=(1,)))
    first = data.index(large[0])
    at = data.index(b"stco") + 12
    folded = data[:at] + numbers(*[first] * 40) + data[at + 160 :]
    assert read_mp4(folded).stream.count(large[0]) == 40
    with pytest.raises(FormatError, match=r"have 40160 bytes, and the MP4 file has .*: they overlap"):
        read_mp4(folded[: first + 1004])


def test_many_small_samples_have_limits() -> None:
    data = whole_file(Track([b"x"] * 20))
    many = change(data + bytes(3_000_000), b"stsz", 4, numbers(1, 2_000_000))
    with pytest.raises(LimitError, match="the list of samples takes 400000000 bytes"):
        read_mp4(many)


def test_several_entries_are_not_supported() -> None:
    with pytest.raises(UnsupportedError, match="changes its configuration on the way"):
        read_mp4(change(USUAL, b"stsc", 16, numbers(2)))
    with pytest.raises(UnsupportedError, match="changes its configuration on the way"):
        read_mp4(change(FRAGMENTS, b"trex", 8, numbers(2)))


@pytest.mark.parametrize("form", ["usual", "tables behind the data", "fragments", "size to the end"])
def test_cut_files(form: str) -> None:
    data = FORMS[form]
    for stop in [*range(1, 200, 7), *range(200, len(data), 61)]:
        try:
            read = read_mp4(data[:stop])
        except FbaError:
            continue
        assert form == "fragments"  # which may end behind each
        assert read.planes in (20, 25)


def test_cut_files_are_read_as_far_as_they_go() -> None:
    data = whole_file(track())
    with pytest.warns(
        FbaWarning, match=r"sample 6\d? of 60|sample \d+ of 60 .* the \d+ samples before it are read"
    ):
        read = read_mp4(data[:-100], salvage=True)
    assert 40 < read.planes < 60
    assert fba.decode(read.stream) == fba.decode(PLAIN)[: read.planes]
    with pytest.raises(FormatError, match="it was cut off, or is damaged"):
        read_mp4(data[: data.index(PLANES[0])], salvage=True)


def test_a_track_without_samples() -> None:
    with pytest.raises(FormatError, match="has no samples"):
        read_mp4(whole_file(Track([], sync=None)))


def test_boxes_without_end_are_not_followed() -> None:
    with pytest.raises(FormatError, match="more than 1000000 boxes"):
        read_mp4(struct.pack(">I4s", 8, b"free") * 1_000_001)
