"""FAPs that a stream takes back: mask type 2 after they were sent, from the track and from coded planes."""

import numpy as np
import pytest

import fba
from fba.animation import Animation, FaceTrack
from fba.face import Definitions, Resolver, resolve
from fba.face.interpolation._node import Function, Link, Term
from fba.face.interpolation.table import InterpolationTable
from fba.parameters import faps

OPEN_JAW, CORNER_L, CORNER_R, CORNER_L_O, HEAD_PITCH = (n - 1 for n in (3, 6, 7, 53, 48))
JOY = 1


def track(
    frames: list[dict[int, int]],
    asked: list[set[int]],
    expression: list[tuple[int, ...] | None] | None = None,
) -> FaceTrack:
    """Frames as {column: value}, and the columns that each asks to have interpolated."""
    values, mask = np.zeros((len(frames), 68), dtype=int), np.zeros((len(frames), 68), dtype=bool)
    interpolated = np.zeros_like(mask)
    fields = np.zeros((len(frames), 6), dtype=int)
    for t, (frame, columns) in enumerate(zip(frames, asked, strict=True)):
        for column, value in frame.items():
            values[t, column], mask[t, column] = value, True
        interpolated[t, list(columns)] = True
    for t, entry in enumerate(expression or []):
        if entry is not None:
            fields[t], mask[t, 1] = entry, True
    return FaceTrack(values, mask, None, fields, interpolated)  # type: ignore[arg-type]


class Face:
    fit = None
    definitions = Definitions(
        np.zeros((15, 68)), np.where(np.arange(68) == CORNER_L, 630, 0) * np.arange(7)[:, None]
    )


def test_a_fap_taken_back_follows_its_mate_until_it_is_kept_again() -> None:
    shown = resolve(
        track(
            [{CORNER_L: 10, CORNER_R: 20}, {CORNER_R: 30}, {CORNER_R: 40}, {CORNER_R: 50}, {CORNER_L: 60}],
            [set(), set(), {CORNER_L}, set(), set()],
        )
    )
    assert shown[:, CORNER_L].tolist() == [10, 10, 40, 10, 60]
    assert shown[:, CORNER_L_O].tolist() == [10, 10, 20 + 20, 10, 60]


def test_a_frame_that_says_nothing_changes_nothing() -> None:
    pieces = track([{CORNER_L: 10, CORNER_R: 20}, {CORNER_R: 40}, {}, {}], [set(), {CORNER_L}, set(), set()])
    assert resolve(pieces)[:, CORNER_L].tolist() == [10, 40, 40, 40]
    resolver = Resolver()
    shown = [float(resolver.push(pieces[t : t + 1])[0, CORNER_L]) for t in range(4)]
    assert shown == [10, 40, 40, 40]


def test_the_table_serves_what_was_taken_back() -> None:
    class Fitted:
        definitions = Definitions.default()
        fit = InterpolationTable(
            [Link(("open_jaw",), {"stretch_l_cornerlip": Function([Term(2, {"open_jaw": 1})])})]
        )

    shown = resolve(
        track([{OPEN_JAW: 4, CORNER_L: 1}, {}, {OPEN_JAW: 5}], [set(), set(), {CORNER_L}]), Fitted
    )
    assert shown[:, CORNER_L].tolist() == [1, 1, 10]


def test_an_expression_shows_on_what_was_taken_back() -> None:
    frames, asked = [{CORNER_L: 5}, {HEAD_PITCH: 3}, {HEAD_PITCH: 3}], [set(), set(), {CORNER_L}]
    shown = resolve(track(frames, asked, [(JOY, 63, 0, 0, 0, 0), None, None]), Face)
    assert shown[:, CORNER_L].tolist() == [5, 5, 630]


def test_what_nothing_tells_stays_as_it_was_sent() -> None:
    frames, asked = [{HEAD_PITCH: 900}, {OPEN_JAW: 1}], [set(), {HEAD_PITCH, CORNER_L}]
    for expression in (None, [(JOY, 63, 0, 0, 0, 0), None]):
        shown = resolve(track(frames, asked, expression), Face)
        assert shown[:, HEAD_PITCH].tolist() == [900, 900]


def test_the_track_checks_and_carries_it() -> None:
    whole = track([{OPEN_JAW: 1}, {}], [{OPEN_JAW, CORNER_L}, {CORNER_L}])
    assert whole.interpolated[:, [OPEN_JAW, CORNER_L]].tolist() == [[False, True], [False, True]]
    part = whole[1:].interpolated
    assert part.any(axis=0).nonzero()[0].tolist() == [CORNER_L]
    assert track([{}], [set()]).interpolated is None
    for wrong, message in (
        (np.zeros((1, 68), bool), "shape"),
        (np.zeros((2, 68), int), "must be bool"),
    ):
        with pytest.raises(ValueError, match=message):
            FaceTrack(whole.values, whole.mask, None, None, wrong)  # type: ignore[arg-type]


def test_joining_and_resampling_keep_it() -> None:
    asking = Animation(25, np.arange(2), track([{OPEN_JAW: 1}, {OPEN_JAW: 3}], [{CORNER_L}, {CORNER_R}]))
    plain = Animation(25, np.arange(1), track([{OPEN_JAW: 1}], [set()]))
    joined = Animation.concatenate([plain, asking]).face
    assert joined.interpolated[:, CORNER_L].tolist() == [False, True, False]
    finer = asking.resample(50).face
    assert finer.interpolated[:, CORNER_L].tolist() == [True, True, False]


def test_a_stream_carries_it_both_ways() -> None:
    lips = range(OPEN_JAW, 18)  # all of group 2
    frames = [dict.fromkeys(lips, 32), {CORNER_R: 60}, {CORNER_R: 90}, dict.fromkeys(lips, 8)]
    asked = [set(), set(lips) - {CORNER_R}, set(lips) - {CORNER_R}, set()]
    source = Animation(25, np.arange(4), track(frames, asked))
    data = fba.encode(source)
    got = fba.decode(data)
    assert got == source
    assert np.array_equal(got.face.interpolated, source.face.interpolated)  # type: ignore[arg-type]
    assert resolve(got.face)[:, CORNER_L].tolist() == [32, 60, 90, 8]
    decoder = fba.Decoder()
    pushed = [f.face for chunk in (data[:40], data[40:]) for f in decoder.push(chunk)]
    pushed += [f.face for f in decoder.finish()]
    assert [f.interpolated is not None for f in pushed if f is not None] == [False, True, True, False]
    assert fba.encode(got) == data


def test_a_group_says_it_only_for_all_of_its_unsent_faps() -> None:
    source = Animation(25, np.arange(1), track([{CORNER_R: 6}], [{CORNER_L}]))
    got = fba.decode(fba.encode(source)).face
    assert got.interpolated is None


def test_the_option_unsent_asks_for_interpolation() -> None:
    source = Animation(25, np.arange(1), track([{CORNER_R: 6}], [set()]))
    got = fba.decode(fba.encode(source, fba.EncoderOptions(unsent="interpolate"))).face
    assert np.flatnonzero(got.interpolated[0]).tolist() == [c for c in range(2, 18) if c != CORNER_R]


def test_a_whole_group_may_be_asked_for() -> None:
    source = Animation(
        25,
        np.arange(2),
        track([dict.fromkeys(range(2, 18), 7), {HEAD_PITCH: 170}], [set(), set(range(2, 18))]),
    )
    got = fba.decode(fba.encode(source)).face
    assert np.flatnonzero(got.interpolated[1]).tolist() == list(range(2, 18))


def test_a_recorded_stream_says_which_faps_are_left_to_the_reader(shared) -> None:  # type: ignore[no-untyped-def]
    """Its right-hand FAPs are masked out: in groups of mask type 2 asked for, in those of type 1 kept."""
    path = shared / "vectors" / "generated" / "synth_face_masks.fba"
    decoder = fba.Decoder()
    seen = set()
    for frame in decoder.push(path.read_bytes()) + decoder.finish():
        assert frame.face is not None
        types = frame.plane.settings.face.mask_types
        seen |= set(types)
        asked = {n for n, f in enumerate(faps()) if types[f.group - 1] == 2 and not frame.face.mask[0, n]}
        found = frame.face.interpolated
        assert (set(np.flatnonzero(found[0]).tolist()) if found is not None else set()) == asked
    assert seen == {0, 1, 2, 3}
