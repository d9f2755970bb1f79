"""Streams for a head that computes most FAPs: what they send, what the head shows, and how far it is off."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from fba import Animation, EncoderOptions, FaceTrack
from fba.codec import decode
from fba.errors import ModelError, OptionError
from fba.face import FaceModel, Function, InterpolationTable, Link, Term, resolve
from fba.parameters import faps
from fba.planning import encode_planned
from fba.planning.fit_streams import encode_with_fit

JAW, LIP, CORNER, R_CORNER, STILL = 3, 4, 6, 7, 5
NAMES = [one.name for one in faps()]


def face(**values: np.ndarray) -> Animation:
    """Frames that send these FAPs, given as f3=..."""
    count = len(next(iter(values.values())))
    track, mask = np.zeros((count, 68), dtype=np.int32), np.zeros((count, 68), dtype=bool)
    for name, each in values.items():
        column = int(name[1:]) - 1
        track[:, column], mask[:, column] = each, True
    return Animation(Fraction(25), np.arange(count), FaceTrack(track, mask))


@pytest.fixture(scope="module")
def head() -> FaceModel:
    """A head whose lip is half the jaw, and which needs FAP 5 for it, too."""
    half = Function([Term(0.5, {NAMES[JAW - 1]: 1}), Term(0.25, {NAMES[STILL - 1]: 1})])
    same = Function([Term(1.0, {NAMES[CORNER - 1]: 1})])
    table = InterpolationTable(
        [
            Link([NAMES[JAW - 1], NAMES[STILL - 1]], {NAMES[LIP - 1]: half}),
            Link([NAMES[CORNER - 1]], {NAMES[R_CORNER - 1]: same}),
        ]
    )
    return replace(FaceModel.default(), fit=table)


def walk(seed: int, count: int = 80) -> np.ndarray:
    return np.cumsum(np.random.default_rng(seed).integers(-8, 9, count)) * 8


def test_what_the_head_computes_is_not_sent(head: FaceModel) -> None:
    jaw, corner = walk(1), walk(2)
    given = face(f3=jaw, f4=jaw // 2, f5=0 * jaw, f6=corner, f7=corner, f51=jaw // 2)
    made = encode_with_fit(given, head)
    # FAP 5 does not move, but without it the head would not compute the lip. Outer lips are copies.
    assert made.sent == (JAW, STILL, CORNER)
    assert made.added == ()
    sent = decode(made.data).face
    assert set((np.flatnonzero(sent.mask.any(axis=0)) + 1).tolist()) == set(made.sent)
    assert np.array_equal(resolve(sent, head), resolve(given.face, head))
    assert made.errors.largest == 0.0
    assert sent.interpolated[:, LIP - 1].all()
    assert sent.interpolated[:, R_CORNER - 1].all()


def test_faps_with_too_large_errors_are_sent(head: FaceModel) -> None:
    """The lip is 50 units off: 50 / 1024 of the distance from nose to mouth, about 1 mm."""
    jaw = walk(1)
    given = face(f3=jaw, f4=jaw // 2 + 50, f5=0 * jaw)
    loose = encode_with_fit(given, head, most_off=0.01)
    assert loose.added == ()
    assert LIP not in loose.sent
    assert 0.5 < loose.errors.largest < 2.0
    strict = encode_with_fit(given, head, most_off=loose.errors.largest / 2000)
    assert strict.added == (LIP,)
    assert strict.errors.largest < loose.errors.largest / 2


def test_streams_are_smaller_than_those_that_send_all(head: FaceModel) -> None:
    jaw, corner = walk(3), walk(4)
    given = face(f3=jaw, f4=jaw // 2, f5=walk(5), f6=corner, f7=corner)
    compact, _ = encode_planned(given, preset="compact")
    assert len(encode_with_fit(given, head).data) < len(compact)


def test_the_errors_are_those_of_the_decoded_stream(head: FaceModel) -> None:
    given = face(f3=walk(6), f5=walk(7))
    fine, coarse = (encode_with_fit(given, head, EncoderOptions(fap_quant=quant)) for quant in (1, 8))
    assert fine.errors.largest == 0.0
    assert 0.1 < coarse.errors.largest < 2.0


@pytest.mark.parametrize(
    ("made", "error", "message"),
    [
        (lambda head: encode_with_fit(face(f3=walk(1)), FaceModel.default()), ModelError, "has no interp"),
        (
            lambda head: encode_with_fit(Animation(Fraction(25), np.arange(0), FaceTrack.empty(0)), head),
            OptionError,
            "no face",
        ),
        (lambda head: encode_with_fit(face(f3=walk(1)), head, most_off=0.0), ValueError, "positive"),
    ],
)
def test_mistakes(head: FaceModel, made, error: type[Exception], message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(error, match=message):
        made(head)
