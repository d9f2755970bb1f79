"""Live streams with nothing known before: what is shown comes back, and little is sent."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, EncoderOptions, FaceTrack
from fba.codec import Encoder, quantise
from fba.face import resolve
from fba.parameters import bap_steps, baps
from fba.planning import LiveEncoder
from fba.tracks import hold
from made_motion import made_animation, made_options


def encoded(animation: Animation, options: EncoderOptions | None = None) -> tuple[bytes, LiveEncoder]:
    encoder = LiveEncoder(options)
    data = b"".join(encoder.push(frame) for frame in animation)
    return data + encoder.finish(), encoder


def assert_same_shown(data: bytes, animation: Animation, options: EncoderOptions) -> None:
    """The decoded stream shows the quantised animation, frame by frame."""
    decoded, expected = fba.decode(data, bap_steps=options.bap_steps), quantise(animation, options)
    assert np.array_equal(decoded.index - decoded.index[0], animation.index - animation.index[0])
    if expected.face is not None:
        assert decoded.face is not None
        assert np.array_equal(resolve(decoded.face), resolve(expected.face))
    if expected.body is not None:
        assert decoded.body is not None
        start = np.zeros(296, dtype=np.int32)
        values = [hold(body.values, body.mask, start) for body in (decoded.body, expected.body)]
        assert np.array_equal(*values)


def face_of(values: dict[int, object], length: int = 40) -> Animation:
    """Return a face that sends all low-level FAPs, with these values by number, and 0 else."""
    track = np.zeros((length, 68), dtype=np.int32)
    for number, one in values.items():
        track[:, number - 1] = one
    mask = np.broadcast_to(np.arange(68) >= 2, track.shape)
    return Animation(25, np.arange(length), FaceTrack(track, mask))


def sent_at(data: bytes) -> list[set[int]]:
    """Return the numbers of the FAPs that each frame sends."""
    face = fba.decode(data).face
    return [set((np.flatnonzero(row) + 1).tolist()) for row in face.mask]


@pytest.mark.parametrize("seed", range(24))
def test_all_shown_values_come_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    options = made_options(rng)
    animation = made_animation(seed)
    assert_same_shown(encoded(animation, options)[0], animation, options)


@pytest.mark.parametrize("seed", [3, 12, 15, 26, 30])
def test_visemes_and_expressions_that_come_late_show_the_same(seed: int) -> None:
    animation = made_animation(seed)
    face = animation.face
    mask, viseme, expression = face.mask.copy(), face.viseme.copy(), face.expression.copy()
    mask[:50, :2], viseme[:50], expression[:50] = False, 0, 0
    late = replace(animation, face=FaceTrack(face.values, mask, viseme, expression, face.interpolated))
    assert_same_shown(encoded(late)[0], late, EncoderOptions())


def test_a_plane_leaves_when_the_next_frame_comes() -> None:
    animation = face_of({19: np.arange(40) * 7, 20: np.arange(40) * 7})
    encoder = LiveEncoder()
    data = b""
    for count, frame in enumerate(animation):
        data += encoder.push(frame)
        assert encoder.statistics.planes == count
        if count:
            assert len(fba.decode(data + encoder.ending())) == count
    assert fba.decode(data + encoder.finish()) is not None
    assert encoder.statistics.planes == 40


def test_mates_are_sent_from_the_frame_at_which_they_differ() -> None:
    left = np.arange(40) % 9
    right = np.where(np.arange(40) < 20, left, -left)
    data, encoder = encoded(face_of({19: left, 20: right}))
    sent = sent_at(data)
    parted = int(np.flatnonzero(left != right)[0])
    assert sent[parted - 1] in ({19}, {20})
    assert all(one == {19, 20} for one in sent[parted:])
    assert encoder.statistics.intra_planes == 2


def test_what_is_0_is_not_sent_before_it_moves() -> None:
    moves = np.maximum(np.arange(40) - 29, 0)
    data, encoder = encoded(face_of({3: np.arange(40) * 4, 49: moves * 170}))
    assert sent_at(data) == [{3}] * 30 + [{3, 49}] * 10
    assert encoder.statistics.intra_planes == 2


def test_ranges_become_twice_as_wide_as_changes_beyond_them() -> None:
    values = np.full(60, 5)
    values[20:] += 100  # more than 60 at once: an I plane
    values[30:] += 190  # less than twice that: none
    values[40:] -= 200  # nor down
    _, encoder = encoded(face_of({19: values, 20: values}, 60))
    assert encoder.statistics.intra_planes == 2


@pytest.mark.parametrize("start", [0, 12])
def test_a_face_with_expressions_is_sent_as_it_comes(start: int) -> None:
    animation = face_of({19: np.arange(40), 20: np.arange(40)})
    mask = animation.face.mask.copy()
    mask[:, 31:] = False  # an expression shows there, and not where 0 was sent
    mask[10:, 30] = False  # FAP 31 keeps its 0
    mask[start:, 1] = True
    expression = np.zeros((40, 6), dtype=np.int16)
    expression[start:, :2] = 3, 40
    face = FaceTrack(animation.face.values, mask, animation.face.viseme, expression)
    animation = Animation(25, animation.index, face)
    assert_same_shown(encoded(animation)[0], animation, EncoderOptions())


def test_a_warning_says_what_cannot_be_kept() -> None:
    animation = face_of({19: 5, 20: 5}, 3)
    mask = np.array(animation.face.mask)
    mask[2, 4:] = False
    mask[2, 0] = True
    viseme = np.zeros((3, 4), dtype=np.int16)
    viseme[2] = 1, 0, 63, 1
    with pytest.warns(fba.FbaWarning, match="redefines itself"):
        encoded(Animation(25, np.arange(3), FaceTrack(animation.face.values, mask, viseme)))


def test_parts_may_come_and_go() -> None:
    rng = np.random.default_rng(3)
    values = np.zeros((40, 296), dtype=np.int32)
    values[:, 30:60] = np.cumsum(rng.integers(-9, 10, (40, 30)), axis=0) * 100
    face = face_of({19: np.arange(40), 20: np.arange(40)}).face
    both = Animation(25, np.arange(40), face, BodyTrack(values, np.ones_like(values, dtype=bool)))
    encoder = LiveEncoder()
    data = encoder.push_animation(both[:20])
    data += encoder.push_animation(Animation(25, np.arange(20, 30), both[20:30].face))
    data += encoder.push_animation(both[30:]) + encoder.finish()
    decoded = fba.decode(data)
    assert decoded.face is not None
    assert face is not None
    assert np.array_equal(resolve(decoded.face), resolve(face))
    shown = hold(decoded.body.values, decoded.body.mask, np.zeros(296, dtype=np.int32))
    expected = quantise(both, EncoderOptions()).body
    assert np.array_equal(shown[:20], expected.values[:20])
    assert np.array_equal(shown[30:], expected.values[30:])


def test_a_body_may_walk_further_than_i_planes_reach() -> None:
    away = next(one for one in baps() if one.unit != "1e-5 rad")
    step = int(bap_steps("iso")[away.number - 1])
    values = np.zeros((90, 296), dtype=np.int32)
    values[:, away.number - 1] = np.arange(90) * 50 * step  # I planes carry 1860 steps
    values[60:, 40] = 20 * bap_steps("iso")[40]
    body = BodyTrack(values, np.ones(values.shape, dtype=bool))
    options = EncoderOptions(clamp=True)
    animation = Animation(25, np.arange(90), body=body)
    data, encoder = encoded(animation, options)
    assert not encoder.statistics.clamped
    assert_same_shown(data, animation, options)


def test_frames_in_a_wrong_order_and_none() -> None:
    animation = face_of({19: 5, 20: 5}, 3)
    encoder = LiveEncoder()
    encoder.push_animation(animation[1:2])
    with pytest.raises(ValueError, match="frame index 0 comes after 1"):
        encoder.push_animation(animation[:1])
    with pytest.raises(ValueError, match="25 frames/s, this frame 30"):
        encoder.push_animation(Animation(30, animation.index[2:], animation[2:].face))
    with pytest.raises(ValueError, match="no frame to encode"):
        LiveEncoder().finish()
    assert len(fba.decode(encoded(animation[:1])[0])) == 1


def test_real_faces_take_less_than_deflate(shared: Path) -> None:
    options = EncoderOptions(bap_steps="visage", clamp=True)
    live = fixed = seconds = 0.0
    for path in sorted((shared / "vectors/real").glob("yes_*.fba")):
        with warnings.catch_warnings(action="ignore"):
            animation = fba.decode(path.read_bytes(), bap_steps="visage")
        face = Animation(animation.rate, animation.index, animation.face)
        data, _ = encoded(face, options)
        assert_same_shown(data, face, options)
        encoder = Encoder(options)
        fixed += len(encoder.push_animation(face) + encoder.finish())
        live, seconds = live + len(data), seconds + float(face.duration)
    assert 3 * live < fixed
    assert 8 * live < 3600 * seconds
