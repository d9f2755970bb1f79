"""Streams as planes: joined they are the stream, and a decoder may begin wherever one says so."""

from dataclasses import replace

import numpy as np
import pytest

import fba
from fba import BodyTrack
from fba.codec import Decoder, encode_animation, write_opening
from fba.errors import BitstreamError, FbaError
from fba.serving import Plane, PlaneSplitter, split_stream
from fba_conformance.suite.index import read_vectors
from joinable_streams import FRAMES, JOINABLE, assert_same, performance
from tools.fuzz._engine import mutated
from tools.fuzz.corpus import read_corpus
from tools.fuzz.targets import find_target

pytestmark = pytest.mark.filterwarnings("ignore::fba.FbaWarning")


def decode_from(planes: list[Plane], start: int, ending: bytes, frames: list[fba.Frame]) -> list[int]:
    """Decode what a viewer gets who begins at a plane, and compare it; return the frames of each message."""
    decoder, decoded, counts = Decoder(), list[fba.Frame](), list[int]()
    for plane in planes[start:]:
        if plane.fresh and decoded:
            return counts
        new = decoder.push(plane.data if decoded or counts else plane.opening)
        counts.append(len(new))
        decoded += new
    decoded += decoder.push(ending) + decoder.finish()
    for frame, other in zip(decoded, frames[start:], strict=True):
        assert_same(frame, other)
    return counts


@pytest.mark.parametrize("size", [1, 7, 1 << 16])
def test_a_viewer_may_begin_at_every_plane_that_opens(size: int) -> None:
    data = encode_animation(performance(), JOINABLE)[0]
    splitter = PlaneSplitter("visage")
    planes = [one for at in range(0, len(data), size) for one in splitter.push(data[at : at + size])]
    planes += splitter.finish()
    assert len(planes) == splitter.planes == FRAMES
    assert [plane.time for plane in planes] == [at / 25 for at in range(FRAMES)]
    openings = [number for number, plane in enumerate(planes) if plane.opening]
    assert openings == [0, 25, 50]  # I planes without time codes are between them
    assert [plane.fresh for plane in planes] == [True] + [False] * (FRAMES - 1)
    frames = Decoder(bap_steps="visage").push(data)
    for start in openings:
        counts = decode_from(planes, start, splitter.ending, frames)
        assert counts == [1] * (FRAMES - start)  # each message completes a frame
    joined = b"".join([planes[0].opening, *(plane.data for plane in planes[1:]), splitter.ending])
    opening = write_opening("visage")
    assert joined.startswith(opening)
    assert data.startswith(joined[len(opening) :])  # all but the mark
    whole = fba.decode(joined)
    np.testing.assert_array_equal(whole.body.values, np.concatenate([one.body.values for one in frames]))


def test_all_valid_vectors() -> None:
    """Where a plane is short, a decoder waits for the first bytes of the next."""
    for vector in read_vectors():
        data, table = vector.data(), vector.bap_steps
        if vector.name.startswith("valid/"):
            decoder = Decoder(bap_steps=table)
            frames = decoder.push(data) + decoder.finish()
            planes, ending = split_stream(data, table)
            assert len(planes) <= len(frames)  # several planes may end in the same byte
            openings = [number for number, plane in enumerate(planes) if plane.opening]
            for start in openings[: 3 if len(planes) == len(frames) else 1]:
                decode_from(planes, start, ending, frames)


def test_an_i_plane_that_leaves_something_in_force_opens_nothing() -> None:
    """A body that only the first of the I planes carries: the others would lack it."""
    whole = performance()
    data = encode_animation(whole, JOINABLE)[0]
    shown = np.array(whole.body.mask)
    shown[10:] = False
    faces = replace(whole, body=BodyTrack(whole.body.values, shown))
    for animation, expected in ((whole, {0, 25, 50}), (faces, {0})):
        data = encode_animation(animation, JOINABLE)[0]
        planes, ending = split_stream(data, "visage")
        openings = {number for number, plane in enumerate(planes) if plane.opening}
        assert openings >= expected
        frames = Decoder(bap_steps="visage").push(data)
        for start in openings:
            decode_from(planes, start, ending, frames)


def test_damage_begins_anew() -> None:
    data = bytearray(encode_animation(performance(body=False), JOINABLE)[0])
    at = split_stream(bytes(data))[0]
    before = sum(len(plane.data) for plane in at[:24])
    data[before : before + 20] = b"\xff" * 20
    planes, _ = split_stream(bytes(data))
    fresh = [number for number, plane in enumerate(planes) if plane.fresh]
    assert len(fresh) >= 2
    assert planes[fresh[-1]].opening
    assert planes[fresh[-1]].time == 1
    decoder = Decoder()
    decoded = decoder.push(planes[fresh[-1]].opening)
    for plane in planes[fresh[-1] + 1 :]:
        decoded += decoder.push(plane.data)
    clean = encode_animation(performance(body=False), JOINABLE)[0]
    for frame, other in zip(decoded, Decoder().push(clean)[25:], strict=True):
        assert_same(frame, other)


def test_two_objects_in_a_row() -> None:
    data = encode_animation(performance(body=False), JOINABLE)[0]
    planes, _ = split_stream(data + data)
    assert [number for number, plane in enumerate(planes) if plane.fresh] == [0, FRAMES]
    assert planes[FRAMES].opening == planes[0].opening


def test_no_stream() -> None:
    with pytest.raises(BitstreamError, match="no FBA object start code"):
        split_stream(b"hello, world")
    with pytest.raises(BitstreamError):
        split_stream(b"")


def test_mutated_streams_raise_nothing_else() -> None:
    target = find_target("stream")
    corpus = read_corpus(target)
    for number in range(150):
        data = mutated(target, corpus, 27, number)[0]
        try:
            planes, _ = split_stream(data)
        except FbaError:
            continue
        assert all(plane.data for plane in planes)
