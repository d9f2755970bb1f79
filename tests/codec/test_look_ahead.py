"""Streams that readers with any kind of look-ahead for start codes read alike."""

import numpy as np
import pytest

from fba import Animation, Encoder, EncoderOptions, FaceTrack, decode, encode
from fba.parameters import FAP_COUNT, faps
from tools.look_ahead import compare, planes_read


def face(values: dict[int, list[int]], *, viseme: bool = False) -> Animation:
    """A face that sends these FAPs, in steps of their tables, and in frame 0 a viseme."""
    count = len(next(iter(values.values())))
    array = np.zeros((count, FAP_COUNT), dtype=np.int32)
    mask = np.zeros((count, FAP_COUNT), dtype=bool)
    for number, levels in values.items():
        array[:, number - 1] = [level * faps()[number - 1].step for level in levels]
        mask[:, number - 1] = not viseme
    mask[0, 0] = viseme
    return Animation(25, np.arange(count), FaceTrack(array, mask), None)


def test_a_plane_whose_zeros_look_like_a_start_code_gets_one() -> None:
    """The plane began at bit 5 of a byte; its header and 22 zeros in its segment made 00 00 01."""
    jump = face({3: [0, 600], 4: [0, 600], 5: [0, 600]})
    data = encode(jump, EncoderOptions(mark=False))
    assert [piece[0] for piece in data.split(b"\0\0\1")[1:]] == [0xBA, 0xBB, 0xB1]
    assert len(list(planes_read(data, byte_aligned=True))) == 2
    assert decode(data).face == jump.face


def test_a_last_plane_of_six_bits_is_seen() -> None:
    """Without a start code before it, it lay in one byte with the alignment before the end code."""
    quiet = face({3: [0, 0, 0]}, viseme=True)
    data = encode(quiet)
    for byte_aligned in (False, True):
        assert len(list(planes_read(data, byte_aligned=byte_aligned))) == 3
    assert len(decode(data)) == 3


def test_a_plane_may_still_be_moved_when_its_first_byte_could_leave() -> None:
    """What the encoder hands out frame by frame is what it hands out at once."""
    quiet = face({3: [0] * 40}, viseme=True)

    for count in range(2, 40):
        part = quiet[:count]
        encoder = Encoder()
        live = b"".join([*(encoder.push(frame) for frame in part), encoder.finish()])
        again = Encoder()
        assert live == again.push_animation(part) + again.finish()
        assert len(list(planes_read(live, byte_aligned=True))) == count


def test_planes_without_content_take_six_bits() -> None:
    """The guard writes a start code before the last of them at most, not before each."""
    longer, shorter = (len(encode(face({3: [0] * count}, viseme=True))) for count in (401, 201))
    assert abs(longer - shorter - 200 * 6 / 8) <= 5


@pytest.mark.parametrize("start_codes", [False, True])
def test_an_i_plane_of_zeros_is_guarded_as_well(start_codes: bool) -> None:
    options = EncoderOptions(fap_quant=0, intra_period=0.04, start_codes=start_codes)
    for count in range(2, 12):
        many = face({67: [0] * count, 68: [0] * count})
        data = encode(many, options)
        assert len(list(planes_read(data, byte_aligned=True))) == count


def test_random_streams_are_read_alike() -> None:
    """`python -m tools.look_ahead` compares as many as one likes."""
    _, planes, differing = compare(500, seed=20)
    assert planes >= 500
    assert differing == []
