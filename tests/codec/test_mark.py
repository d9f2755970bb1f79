"""The mark behind the end of a stream, which names its table of BAP steps."""

import warnings

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, Decoder, EncoderOptions, FaceTrack, FbaWarning
from fba.codec import marked_table, probe_stream, verify_stream, write_opening
from fba.codec._stream.mark import find_marks
from fba_conformance.trace import decode_values, trace

MARK = b"\0\0\1\xb2fba bap_steps=visage;"
STEP = 170
"""Units of l_shoulder_flexion in the steps of "visage"; "iso" has 64."""
SHOULDER = 31


def body(frames: int = 6) -> Animation:
    values = np.zeros((frames, 296), dtype=np.int32)
    values[:, SHOULDER] = STEP * np.arange(frames)
    return Animation(
        25, range(frames), None, BodyTrack(values, values.any(axis=0) | np.zeros((frames, 1), bool))
    )  # type: ignore[arg-type]


def stream(table: str = "visage", *, mark: bool = True, **options: int) -> bytes:
    given = EncoderOptions(bap_steps=table, mark=mark, checksums=False, **options)  # type: ignore[arg-type]
    return fba.encode(body(), given)


def shoulder(animation: Animation) -> list[int]:
    return animation.body.values[:, SHOULDER].tolist()


RIGHT = [STEP * frame for frame in range(6)]


def test_the_mark_stands_behind_the_end_and_changes_nothing_else() -> None:
    plain = stream(mark=False)
    assert plain.endswith(b"\0\0\1\xb1")
    assert stream() == plain + MARK
    assert fba.encode(body(), EncoderOptions(bap_steps="visage")).startswith(plain + MARK)
    assert stream("iso", clamp=True).endswith(b"fba bap_steps=iso;")


def test_faces_and_unquantised_bodies_need_no_mark() -> None:
    values, mask = np.zeros((3, 68), np.int32), np.zeros((3, 68), bool)
    mask[:, 2] = True
    face = Animation(25, range(3), FaceTrack(values, mask))  # type: ignore[arg-type]
    without = EncoderOptions(checksums=False)
    assert fba.encode(face, without) == fba.encode(face, EncoderOptions(mark=False))
    assert not marked_table(stream(bap_quant=0))  # unquantised: the same under every table


def test_decoders_use_the_table_of_the_mark() -> None:
    data = stream()
    with warnings.catch_warnings(action="error"):
        assert shoulder(fba.decode(data)) == RIGHT
        assert fba.decode(data) == fba.decode(stream(mark=False), bap_steps="visage")
        assert probe_stream(data).bap_steps == "visage"
        assert verify_stream(data).digest == verify_stream(stream(mark=False), bap_steps="visage").digest
        assert verify_stream(data).intact
    assert shoulder(fba.decode(stream(mark=False))) != RIGHT
    assert probe_stream(stream(mark=False)).bap_steps is None


def test_joined_streams_each_use_their_mark() -> None:
    plain, iso = stream(mark=False), stream("iso", mark=True)
    unmarked = shoulder(fba.decode(plain))
    for parts, wanted in (
        ((stream(), iso), RIGHT + shoulder(fba.decode(iso))),
        ((iso, stream()), shoulder(fba.decode(iso)) + RIGHT),
        ((plain, stream()), unmarked + RIGHT),
        ((stream(), plain), RIGHT + unmarked),
    ):
        assert shoulder(fba.decode(b"".join(parts))) == wanted
    assert [mark.table for mark in find_marks(stream() + iso)] == ["visage", "iso"]
    assert marked_table(stream() + iso) is None


def test_a_mark_applies_only_to_the_object_before_it() -> None:
    """The second object has user data, but no mark: it is not "visage", as the first."""
    data = stream() + stream(mark=False) + b"\0\0\1\xb2somebody's words"
    with warnings.catch_warnings(action="error"):
        found = fba.decode(data)
    assert shoulder(found) == RIGHT + shoulder(fba.decode(stream(mark=False)))
    assert probe_stream(data).bap_steps is None


@pytest.mark.parametrize("size", [1, 7, 100])
def test_a_decoder_with_the_wrong_table_warns_at_the_end(size: int) -> None:
    data, decoder = stream(), Decoder()
    with warnings.catch_warnings(record=True, action="always") as caught:
        frames = [f for start in range(0, len(data), size) for f in decoder.push(data[start : start + size])]
        frames += decoder.finish()
    said = "the stream says behind its end that it was made with the BAP steps 'visage'; "
    assert [str(one.message) for one in caught] == [said + "it was decoded with 'iso'"]
    assert (len(frames), decoder.mark, decoder.ended, decoder.damage) == (6, "visage", True, [])
    told = Decoder(bap_steps="visage")
    with warnings.catch_warnings(action="error"):
        told.push(data)
        told.finish()
    assert told.mark == "visage"


def test_a_given_table_overrides_the_mark() -> None:
    with pytest.warns(FbaWarning, match="made with the BAP steps 'visage'"):
        decoded = fba.decode(stream(), bap_steps="iso")
    assert decoded == fba.decode(stream(mark=False), bap_steps="iso")


def test_salvaging_uses_the_mark() -> None:
    options = EncoderOptions(bap_steps="visage", checksums=False, start_codes=True, intra_period=0.2)
    data = bytearray(fba.encode(body(40), options))
    data[3] = 0  # the object start code is lost
    with pytest.warns(FbaWarning, match="the object start code 00 00 01 ba is missing"):
        found = fba.decode(bytes(data), on_error="salvage")
    assert set(shoulder(found)) <= {STEP * frame for frame in range(40)}
    assert max(shoulder(found)) == STEP * 39


@pytest.mark.parametrize("cut", range(1, len(MARK) - 3))
def test_a_mark_that_was_cut_off_gives_a_warning(cut: int) -> None:
    data = stream()[:-cut]
    assert marked_table(data) is None
    with pytest.warns(FbaWarning, match="a mark of the stream was cut off or is damaged"):
        assert fba.decode(data) == fba.decode(stream(mark=False))


def test_an_unknown_table_is_named() -> None:
    data = stream(mark=False) + MARK.replace(b"visage", b"better")
    with pytest.warns(FbaWarning, match="made with the BAP steps 'better', which are not known here"):
        assert fba.decode(data) == fba.decode(stream(mark=False))


def test_other_user_data_are_not_a_mark() -> None:
    plain = stream(mark=False)
    with warnings.catch_warnings(action="error"):
        assert fba.decode(plain + b"\0\0\1\xb2somebody's words") == fba.decode(plain)
    with pytest.warns(FbaWarning, match="bytes follow the end"):
        assert fba.decode(plain + b"?" + MARK) == fba.decode(plain)


def fed(data: bytes, size: int, **options: str) -> tuple[list[int], Decoder]:
    decoder = Decoder(**options)  # type: ignore[arg-type]
    frames = [f for start in range(0, len(data), size) for f in decoder.push(data[start : start + size])]
    return [int(f.body.values[0, SHOULDER]) for f in frames + decoder.finish()], decoder  # type: ignore[union-attr]


OPENING = bytes.fromhex("000001b064000001b2") + b"fba bap_steps=visage;" + bytes.fromhex("000001b523")


@pytest.mark.parametrize("size", [1, 3, 7, 1000])
def test_a_mark_before_the_object_counts_from_the_first_plane_on(size: int) -> None:
    assert write_opening("visage") == OPENING
    with warnings.catch_warnings(action="error"):
        for behind in (b"", MARK):
            data = OPENING + stream(mark=False) + behind
            assert fed(data, size)[0] == RIGHT
            assert fed(data, size)[1].mark == "visage"
            assert shoulder(fba.decode(data)) == RIGHT
            assert marked_table(data) == probe_stream(data).bap_steps == "visage"
            assert verify_stream(data).intact
            found = decode_values(data)
            assert [one["bap"][SHOULDER + 1] for one in found] == RIGHT


def test_streams_in_a_pipe_use_the_table_before_them() -> None:
    other = write_opening("iso") + stream("iso", mark=False)
    iso = shoulder(fba.decode(stream("iso", mark=False)))
    with warnings.catch_warnings(action="error"):
        assert fed(OPENING + stream() + other + OPENING + stream(), 5)[0] == RIGHT + iso + RIGHT


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (OPENING + stream("iso"), "behind its end that it was made with the BAP steps 'iso'"),
        (OPENING[:30] + MARK.replace(b"visage", b"iso") + OPENING[30:] + stream(), "and then 'iso'"),
        (OPENING.replace(b"visage", b"better") + stream(mark=False), "'better', which are not known"),
        (stream()[:-26] + b"\xb0" + MARK, "the end code before it is damaged"),
        (stream(mark=False) + MARK + b"colour=red;", "cut off or is damaged"),
    ],
)  # fmt: skip
def test_contradictory_or_damaged_marks_give_warnings(data: bytes, said: str) -> None:
    for read in (lambda: fed(data, 1), lambda: fed(data, 50), lambda: fba.decode(data)):
        with warnings.catch_warnings(record=True, action="always") as caught:
            read()
        assert any(said in str(one.message) for one in caught)


def test_the_second_decoder_reads_nothing_behind_the_end() -> None:
    """Which is what the first one of another maker does: the mark leaves its values as they are."""
    assert decode_values(stream(), bap_steps="visage") == decode_values(
        stream(mark=False), bap_steps="visage"
    )
    names = [(element.name, element.value) for element in trace(stream(), bap_steps="visage")]
    assert names[-2:] == [("user_data_start_code", 0x1B2), ("user_data", "fba bap_steps=visage;")]


def test_files_contain_their_table(tmp_path: object) -> None:
    path = f"{tmp_path}/a.fba"
    for options, marked in (({"bap_steps": "visage"}, "visage"), ({}, "iso"), ({"mark": False}, None),
                            ({"bap_steps": "visage", "mark": False}, None)):  # fmt: skip
        fba.write(path, body(), **options)
        assert fba.probe(path).bap_steps == marked
    fba.write(path, body(), bap_steps="visage")
    assert shoulder(fba.read(path)) == RIGHT
