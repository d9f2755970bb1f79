"""Learning a FIT: what FAPs follow from is found, and errors are those of streams not learned from."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fba.errors import FbaError, ModelError
from fba.face import FaceModel, InterpolationTable, resolve
from fba.face.deform._deformer import Deformer
from fba.face.deform.displacements import vertex_distances
from fba.face.interpolation._node import TERMS_MAX, Function, Link, Term
from fba.face.learning import learn_fit, send_sources
from fba.face.learning._regression import fit_coefficients, make_table, measure
from fba.parameters import fap_numbers, faps
from fba.tracks import FaceTrack
from small_face import small_face

JAW, T_LIP, CORNER, R_CORNER, LID, R_LID, B_LID, GAZE, BROW, R_BROW, CHEEK, PITCH = (
    3, 4, 6, 7, 19, 20, 21, 23, 31, 32, 41, 48,
)  # fmt: skip
LENGTH = 60


def track(**values: np.ndarray) -> FaceTrack:
    """A track that sends these FAPs, given as f3=..."""
    first = next(iter(values.values()))
    result = np.zeros((len(first), 68), dtype=np.int32)
    mask = np.zeros(result.shape, dtype=bool)
    for name, each in values.items():
        column = int(name[1:]) - 1
        result[:, column], mask[:, column] = np.rint(each), True
    return FaceTrack(result, mask)


def performer(seed: int, *, sign: float = 1.0, length: int = LENGTH) -> FaceTrack:
    """Lips that follow jaw and corners, a cheek the brow (or against it), gaze that goes with the jaw.

    Mates and outer lips are not sent: they are the same.
    """
    rng = np.random.default_rng(seed)
    jaw, corner, brow, lid, pitch = rng.normal(size=(5, length)) * [[300], [150], [200], [250], [20_000]]
    return track(
        f3=jaw, f4=0.5 * jaw - 0.25 * corner, f6=corner, f19=lid, f21=0.25 * lid,
        f23=jaw, f31=brow, f41=sign * 0.3 * brow, f48=pitch, f63=0 * jaw,
    )  # fmt: skip


@pytest.fixture(scope="module")
def learnt() -> object:
    return learn_fit([performer(seed) for seed in range(3)], count=6)


def function_of(table: InterpolationTable, fap: int) -> dict[str, float]:
    """The coefficients of a FAP that is a sum."""
    name = faps()[fap - 1].name
    (function,) = [link.functions[name] for link in table.links if name in link.functions]
    assert not function.denominator
    assert all(list(term.powers.values()) == [1] for term in function.numerator)
    return {next(iter(term.powers)): term.coefficient for term in function.numerator}


def test_what_the_others_follow_from_is_found(learnt) -> None:  # type: ignore[no-untyped-def]
    assert learnt.sent[0] == PITCH
    assert set(learnt.sent) == {PITCH, JAW, CORNER, BROW, LID, GAZE}
    mates = {R_CORNER, R_LID, B_LID + 1, GAZE + 1, R_BROW, CHEEK + 1}
    outer_lips = {51, 53, 54}
    assert set(learnt.computed) == {T_LIP, B_LID, CHEEK} | mates | outer_lips
    assert (learnt.frames, learnt.streams) == (3 * LENGTH, 3)
    lip = function_of(learnt.table, T_LIP)
    assert lip["open_jaw"] == pytest.approx(0.5, abs=0.005)
    assert lip["stretch_l_cornerlip"] == pytest.approx(-0.25, abs=0.005)
    assert function_of(learnt.table, CHEEK)["raise_l_i_eyebrow"] == pytest.approx(0.3, abs=0.003)
    assert learnt.held_out.millimetres.largest < 0.2
    assert learnt.held_out.explained > 0.999
    assert [one.fap for one in learnt.held_out.faps] == list(learnt.computed)


def test_a_fap_that_equals_one_that_is_sent_becomes_exactly_that(learnt) -> None:  # type: ignore[no-untyped-def]
    assert function_of(learnt.table, R_CORNER) == {"stretch_l_cornerlip": 1.0}
    assert function_of(learnt.table, R_LID) == {"close_t_l_eyelid": 1.0}


def test_eyes_are_computed_from_eyes_and_nothing_from_the_head(learnt) -> None:  # type: ignore[no-untyped-def]
    eyes, face = learnt.table.links
    assert set(eyes.source) <= {"close_t_l_eyelid", "yaw_l_eyeball"}
    assert not {"close_t_l_eyelid", "yaw_l_eyeball", "head_pitch"} & set(face.source)


def test_no_more_faps_are_sent_than_asked_for() -> None:
    result = learn_fit([performer(seed) for seed in range(3)], count=3)
    assert len(result.sent) == 3
    assert result.sent[0] == PITCH
    assert {LID, GAZE} & set(result.sent)


def test_what_never_moves_is_left_out(learnt) -> None:  # type: ignore[no-untyped-def]
    assert 63 not in learnt.computed
    assert 63 not in learnt.sent


def cheek_error(streams: list[FaceTrack]) -> float:
    """Return the largest error of the cheek, in its steps."""
    faps_off = learn_fit(streams, count=5).held_out.faps
    return {one.fap: one for one in faps_off}[CHEEK].steps.largest


def with_own_cheek(made: FaceTrack) -> FaceTrack:
    """Return a track with a cheek that does not tell where the brow is, so that the brow is sent."""
    values = made.values.copy()
    values[:, CHEEK - 1] += np.random.default_rng(9).integers(-9, 10, len(values))
    return FaceTrack(values, made.mask)


def test_errors_are_those_of_streams_that_were_not_learned_from() -> None:
    """From two streams, the cheek of the third is learned the wrong way: it is off by twice its motion."""
    same, turned = (with_own_cheek(performer(3, sign=sign)) for sign in (1.0, -1.0))
    others = [with_own_cheek(performer(1)), with_own_cheek(performer(2))]
    moved = np.abs(turned.values[:, CHEEK - 1]).max() / faps()[CHEEK - 1].step
    assert cheek_error([*others, same]) < 0.5 * moved
    assert cheek_error([*others, turned]) == pytest.approx(2 * moved, rel=0.25)


def test_a_single_stream_is_held_out_by_fifths() -> None:
    """A cheek that turns round in the last fifth is learned the other way from the first four."""
    one, other = with_own_cheek(performer(1, length=80)), with_own_cheek(performer(2, sign=-1.0, length=20))
    both = FaceTrack(np.concatenate([one.values, other.values]), np.concatenate([one.mask, other.mask]))
    moved = np.abs(other.values[:, CHEEK - 1]).max() / faps()[CHEEK - 1].step
    assert cheek_error([both]) == pytest.approx(2 * moved, rel=0.25)
    assert learn_fit([both], count=5).streams == 1


def test_a_tolerance_takes_as_many_faps_as_it_needs() -> None:
    streams = [with_own_cheek(performer(seed)) for seed in range(3)]
    fine, coarse = learn_fit(streams, tolerance=0.1), learn_fit(streams, tolerance=1.5)
    assert fine.held_out.millimetres.percentile_99 <= 0.1
    assert 0.1 < coarse.held_out.millimetres.percentile_99 <= 1.5
    assert len(coarse.sent) < len(fine.sent)
    fewer = learn_fit(streams, count=len(coarse.sent) - 1)
    assert fewer.held_out.millimetres.percentile_99 > 1.5


def test_a_function_has_ten_terms_at_most() -> None:
    rng = np.random.default_rng(5)
    sent = [30, 32, 34, 38, 40, 2, 4, 5, 11, 13, 15, 16, 17, 60]
    values = np.zeros((200, 68), dtype=np.int32)
    values[:, sent] = rng.normal(size=(200, 14)) * 1000
    values[:, T_LIP - 1] = values[:, sent] @ np.arange(1, 15) / 10
    coefficients = fit_coefficients(measure(values), sent)
    assert np.flatnonzero(coefficients[:, T_LIP - 1]).tolist() == sorted(sent[-TERMS_MAX:])
    assert coefficients[60, T_LIP - 1] == pytest.approx(1.4, abs=0.3)
    make_table(coefficients)  # which refuses more


def test_all_forms_of_the_table_show_the_same(tmp_path: Path, learnt) -> None:  # type: ignore[no-untyped-def]
    head = replace(small_face(), fit=learnt.table)
    head.save(tmp_path / "head.glb")
    forms = [
        FaceModel.load(tmp_path / "head.glb"),
        replace(head, fit=InterpolationTable.from_node(json.loads(json.dumps(learnt.table.to_node())))),
        replace(head, fit=InterpolationTable.from_dict(json.loads(json.dumps(learnt.table.to_dict())))),
    ]
    node = learnt.table.to_node()["numeratorCoefs"]
    assert np.array_equal(np.float32(node), node)  # as 32 bits they are the same
    sent = send_sources(performer(9), learnt.table)
    shown = resolve(sent, head)
    assert shown[:, T_LIP - 1].any()
    for form in forms:
        assert np.array_equal(resolve(sent, form), shown)


def test_only_what_the_table_starts_from_is_sent(learnt) -> None:  # type: ignore[no-untyped-def]
    values = {"f3": np.array([100, 200]), "f63": np.array([5, 5]), "f33": np.array([9, 7]),
              "f34": np.array([0, 0]), "f4": np.array([50, 100])}  # fmt: skip
    sent = send_sources(track(**values), learnt.table)
    mask = set((np.flatnonzero(sent.mask.all(axis=0)) + 1).tolist())
    # Sources as 0, what no link gives and moves, and the 0 that the player would take from its mate.
    assert {JAW, CORNER, BROW, LID} <= mask
    assert {63, 33, 34} <= mask
    assert not mask & set(learnt.computed)
    head = replace(FaceModel.default(), fit=learnt.table)
    assert resolve(sent, head)[:, T_LIP - 1] == pytest.approx([50, 100], abs=1)
    assert not resolve(sent, head)[:, 33].any()


def test_tracks_that_define_visemes_stay_as_they_are(learnt) -> None:  # type: ignore[no-untyped-def]
    made = performer(1)
    mask, viseme = made.mask.copy(), np.zeros((LENGTH, 4), dtype=np.int16)
    mask[:, 0], viseme[3] = True, (1, 0, 63, 1)
    defining = FaceTrack(made.values, mask, viseme)
    assert send_sources(defining, learnt.table) is defining


@pytest.mark.parametrize(
    ("tracks", "count", "message"),
    [
        ([FaceTrack.empty(9)], 10, "nothing to learn from"),
        ([track(f3=np.zeros(9))], 10, "nothing to learn from"),
        ([performer(1, length=6)], 6, "6 different poses, but to send 6 FAPs takes at least 7"),
        ([performer(1)], 2, "2 FAPs to send are too few.*take 3; send"),
        ([track(f3=np.arange(40), f14=np.arange(40) ** 2)], 10, "2 FAPs are all that move"),
    ],
)
def test_what_cannot_be_learned_is_said(tracks: list[FaceTrack], count: int, message: str) -> None:
    with pytest.raises(FbaError, match=message):
        learn_fit(tracks, count=count)


def test_a_model_that_shows_nothing_of_it_is_refused() -> None:
    blank = replace(small_face(), tables=())
    with pytest.raises(ModelError, match="shows none of the FAPs that the streams move"):
        learn_fit([performer(1)], blank)


def test_a_tolerance_that_equal_faps_break_is_refused() -> None:
    rng = np.random.default_rng(3)
    values = rng.normal(size=(3, 40)) * 200
    one = track(f3=values[0], f6=values[1], f7=values[1])
    other = track(f3=values[0], f6=values[1], f7=values[2])
    with pytest.raises(FbaError, match=r"more than 0\.01 mm off.*equal others in some streams"):
        learn_fit([one, one, other], tolerance=0.01)


@pytest.mark.parametrize("wrong", [{"count": 0}, {"tolerance": 0.0}, {"tolerance": float("nan")}])
def test_counts_and_tolerances_are_positive(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="must be positive and finite"):
        learn_fit([performer(1)], **wrong)  # type: ignore[arg-type]


def test_a_wide_value_gives_no_infinite_one() -> None:
    """A source beyond what was learned gives a finite value, or none: FAPs have 32 bits."""
    name = faps()[T_LIP - 1].name
    table = InterpolationTable([Link(["open_jaw"], {name: Function([Term(3.0, {"open_jaw": 1})])})])
    far = track(f3=np.array([2**31 - 1, 10]))
    shown = resolve(send_sources(far, table), replace(FaceModel.default(), fit=table))
    assert shown[:, fap_numbers()[name] - 1].tolist() == [0.0, 30.0]


def test_distances_are_those_of_the_vertex_furthest_off() -> None:
    head = FaceModel.default()
    poses = np.zeros((3, 68))
    poses[1, JAW - 1] = 200
    poses[2, PITCH - 1] = 5000
    deformer = Deformer(head)
    expected = np.linalg.norm(deformer.local(poses[1]) - deformer.local(poses[0]), axis=1).max()
    found = vertex_distances(deformer, poses, np.zeros((3, 68)))
    assert found[0] == 0.0
    assert found[1] == pytest.approx(expected, rel=1e-5)
    assert found[2] == 0.0  # the head turns, and nothing in it moves
