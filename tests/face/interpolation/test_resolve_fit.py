"""What a face with an interpolation table shows, whole or in pieces; FAPs that a stream takes back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fba
import hand_tracks
from fba.animation import Animation, FaceTrack
from fba.face import Definitions, Resolver, resolve
from fba.face.interpolation._node import Function, Link, Term
from fba.face.interpolation.table import InterpolationTable
from fba.parameters import fap_numbers, faps

JOY = 1


def scaled(name: str, factor: float) -> Function:
    return Function([Term(factor, {name: 1})])


class Face:
    """A face as `resolve` sees it."""

    def __init__(self, *links: Link, definitions: Definitions | None = None) -> None:
        self.fit = InterpolationTable(links)
        self.definitions = definitions or Definitions.default()


def track(
    *frames: dict[str, int],
    viseme: list[tuple[int, ...] | None] | None = None,
    expression: list[tuple[int, ...] | None] | None = None,
) -> FaceTrack:
    """Frames as {name: value}; None where no viseme or expression is sent."""
    numbered = [{fap_numbers()[name]: value for name, value in frame.items()} for frame in frames]
    return hand_tracks.track(numbered, viseme, expression)


def shown(name: str, faps: np.ndarray) -> list[float]:
    """What one FAP shows over time."""
    column: list[float] = faps[:, fap_numbers()[name] - 1].tolist()
    return column


CORNERS = Link(("open_jaw",), {"stretch_l_cornerlip": scaled("open_jaw", -0.25)})


def test_the_table_comes_before_mates_and_mates_follow_it() -> None:
    # the right corner alone would be the left one's mate; the table gives the left one -0.25 x 400
    faps = resolve(track({"open_jaw": 400}), Face(CORNERS))
    assert shown("stretch_l_cornerlip", faps) == [-100]
    assert shown("stretch_r_cornerlip", faps) == [-100]  # copied from what the table gave
    assert shown("stretch_l_cornerlip_o", faps) == [-100]
    both = resolve(track({"open_jaw": 400, "stretch_r_cornerlip": 60}), Face(CORNERS))
    assert (shown("stretch_l_cornerlip", both), shown("stretch_r_cornerlip", both)) == ([-100], [60])


def test_a_fap_that_is_sent_is_no_longer_interpolated() -> None:
    faps = resolve(
        track({"open_jaw": 400}, {"open_jaw": 200}, {"stretch_l_cornerlip": 7}, {"open_jaw": 80}),
        Face(CORNERS),
    )
    assert shown("stretch_l_cornerlip", faps) == [-100, -50, 7, 7]


def test_kept_values_feed_the_table() -> None:
    both = Link(
        ("lower_t_midlip", "raise_b_midlip"),
        {"depress_chin": Function([Term(1, {"lower_t_midlip": 1, "raise_b_midlip": 1})])},
    )
    faps = resolve(
        track({"lower_t_midlip": 3}, {"raise_b_midlip": 5}, {}, {"lower_t_midlip": -2}), Face(both)
    )
    assert shown("depress_chin", faps) == [0, 15, 15, -10]


def test_a_vanishing_denominator_leaves_the_mate() -> None:
    inverse = Link(
        ("open_jaw",), {"raise_l_cornerlip": Function([Term(100)], [Term(1, {"open_jaw": 1}), Term(-1)])}
    )
    faps = resolve(
        track({"open_jaw": 11, "raise_r_cornerlip": 33}, {"open_jaw": 1}, {"open_jaw": -9}), Face(inverse)
    )
    assert shown("raise_l_cornerlip", faps) == [10, 33, -10]


def test_what_the_table_gives_stands_over_visemes_and_expressions() -> None:
    expressions = np.zeros((7, 68))
    expressions[JOY, [5, 17]] = 500, 70  # the left corner and the chin
    face = Face(CORNERS, definitions=Definitions(np.zeros((15, 68)), expressions))
    faps = resolve(track({"open_jaw": 400}, expression=[(JOY, 63, 0, 0, 0, 0)]), face)
    assert (shown("stretch_l_cornerlip", faps), shown("depress_chin", faps)) == ([-100], [70])
    # init_face: the expression is the new neutral face, and FAPs come on top
    faps = resolve(track({"open_jaw": 400}, expression=[(JOY, 63, 0, 0, 1, 0)]), face)
    assert (shown("stretch_l_cornerlip", faps), shown("depress_chin", faps)) == ([400], [70])


def test_what_the_table_makes_of_an_expression_is_not_added_to_it_again() -> None:
    smile = Link(
        ("expression",),
        {
            "stretch_l_cornerlip": Function(
                [Term(2, {"expression_intensity1": 1}, ("expression_select1", JOY))]
            )
        },
    )
    further = Link(("stretch_l_cornerlip",), {"lift_l_cheek": scaled("stretch_l_cornerlip", 3)})
    expressions = np.full((7, 68), 1000.0)
    face = Face(smile, further, definitions=Definitions(np.zeros((15, 68)), expressions))
    faps = resolve(track({"open_jaw": 5}, expression=[(JOY, 63, 0, 0, 1, 0)]), face)
    assert shown("stretch_l_cornerlip", faps) == [126]
    assert shown("stretch_r_cornerlip", faps) == [126]
    assert shown("lift_r_cheek", faps) == [378]
    assert shown("open_jaw", faps) == [1005]
    # before any expression was sent, the link has no source
    faps = resolve(track({}, {}, expression=[None, (JOY, 10, 0, 0, 0, 0)]), face)
    assert shown("stretch_l_cornerlip", faps) == [0, 20]


def test_a_table_survives_copying_the_resolver() -> None:
    resolver = Resolver(Face(CORNERS))
    resolver.push(track({"open_jaw": 400}))
    twin = resolver.copy()
    resolver.push(track({"stretch_l_cornerlip": 1}))
    assert shown("stretch_l_cornerlip", twin.push(track({}))) == [-100]
    assert shown("stretch_l_cornerlip", resolver.push(track({}))) == [1]


def everything() -> Face:
    """Links of all kinds: chains, alternatives, functions without value, high-level sources."""
    return Face(
        Link(
            ("raise_l_i_eyebrow", "raise_l_o_eyebrow"),
            {"raise_l_m_eyebrow": scaled("raise_l_i_eyebrow", 0.5)},
        ),
        Link(("raise_l_i_eyebrow",), {"raise_l_m_eyebrow": scaled("raise_l_i_eyebrow", 0.25)}),
        Link(("raise_l_m_eyebrow",), {"squeeze_l_eyebrow": scaled("raise_l_m_eyebrow", -1)}),
        Link(
            ("open_jaw",),
            {
                "depress_chin": Function([Term(9, {"open_jaw": 2})], [Term(1, {"open_jaw": 1}), Term(-3)]),
                "push_b_lip": scaled("open_jaw", 0.5),
            },
        ),
        Link(
            ("viseme", "push_b_lip"),
            {"push_t_lip": Function([Term(1, {"push_b_lip": 1, "viseme_blend": 1}, ("viseme_select1", 2))])},
        ),
        Link(("expression",), {"lift_l_cheek": scaled("expression_intensity1", 2)}),
    )


@st.composite
def tracks(draw: st.DrawFn) -> FaceTrack:
    count = draw(st.integers(1, 60))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    mask = rng.random((count, 68)) < draw(st.sampled_from([0.0, 0.02, 0.3, 1.0]))
    values = np.where(mask, rng.integers(-6, 6, (count, 68)), 0)
    values[:, :2] = 0
    viseme = np.stack([rng.integers(0, high, count) for high in (4, 4, 64, 2)], axis=1)
    expression = np.stack([rng.integers(0, high, count) for high in (3, 64, 3, 64, 2, 2)], axis=1)
    interpolated = rng.random((count, 68)) < draw(st.sampled_from([0.0, 0.0, 0.05, 0.5]))
    return FaceTrack(values, mask, viseme, expression, interpolated)


@given(tracks(), st.data())
@settings(max_examples=80)
def test_pieces_give_what_the_whole_gives(whole: FaceTrack, data: st.DataObject) -> None:
    face = everything()
    borders = sorted(data.draw(st.lists(st.integers(0, len(whole)), max_size=6)))
    resolver = Resolver(face)
    pieces = [
        resolver.push(whole[a:b])
        for a, b in zip([0, *borders], [*borders, len(whole)], strict=True)
        if data.draw(st.booleans()) or b > a
    ]
    expected = resolve(whole, face)
    np.testing.assert_array_equal(np.concatenate(pieces), expected)
    assert np.isfinite(expected).all()


@given(tracks())
@settings(max_examples=40)
def test_sent_values_show_as_they_are(whole: FaceTrack) -> None:
    faps = resolve(whole, everything())
    plain = (whole.mask[:, 2:]) & ~(np.maximum.accumulate(whole.expression[:, 4:5], axis=0) == 1)
    assert (faps[:, 2:] == whole.values[:, 2:])[plain].all()


def test_an_hour_is_resolved_in_bounded_steps() -> None:
    """Blocks of any length: the border of the internal blocks shows nowhere."""
    from fba.face._resolve import RESOLVED_AT_ONCE

    count = RESOLVED_AT_ONCE + 3
    values, mask = np.zeros((count, 68), dtype=int), np.zeros((count, 68), dtype=bool)
    values[:, 2], mask[0, 2], mask[RESOLVED_AT_ONCE + 1, 2] = 0, True, True
    values[0, 2], values[RESOLVED_AT_ONCE + 1, 2] = 40, 80
    faps = resolve(FaceTrack(values, mask), Face(CORNERS))
    assert shown("stretch_l_cornerlip", faps) == pytest.approx([-10] * (RESOLVED_AT_ONCE + 1) + [-20] * 2)


OPEN_JAW, CORNER_L, CORNER_R, CORNER_L_O, HEAD_PITCH = (n - 1 for n in (3, 6, 7, 53, 48))


def taken_back(
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


class JoyfulFace:
    fit = None
    definitions = Definitions(
        np.zeros((15, 68)), np.where(np.arange(68) == CORNER_L, 630, 0) * np.arange(7)[:, None]
    )


def test_a_fap_taken_back_follows_its_mate_until_it_is_kept_again() -> None:
    shown = resolve(
        taken_back(
            [{CORNER_L: 10, CORNER_R: 20}, {CORNER_R: 30}, {CORNER_R: 40}, {CORNER_R: 50}, {CORNER_L: 60}],
            [set(), set(), {CORNER_L}, set(), set()],
        )
    )
    assert shown[:, CORNER_L].tolist() == [10, 10, 40, 10, 60]
    assert shown[:, CORNER_L_O].tolist() == [10, 10, 20 + 20, 10, 60]


def test_a_frame_that_says_nothing_changes_nothing() -> None:
    pieces = taken_back(
        [{CORNER_L: 10, CORNER_R: 20}, {CORNER_R: 40}, {}, {}], [set(), {CORNER_L}, set(), set()]
    )
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
        taken_back([{OPEN_JAW: 4, CORNER_L: 1}, {}, {OPEN_JAW: 5}], [set(), set(), {CORNER_L}]), Fitted
    )
    assert shown[:, CORNER_L].tolist() == [1, 1, 10]


def test_an_expression_shows_on_what_was_taken_back() -> None:
    frames, asked = [{CORNER_L: 5}, {HEAD_PITCH: 3}, {HEAD_PITCH: 3}], [set(), set(), {CORNER_L}]
    shown = resolve(taken_back(frames, asked, [(JOY, 63, 0, 0, 0, 0), None, None]), JoyfulFace)
    assert shown[:, CORNER_L].tolist() == [5, 5, 630]


def test_what_nothing_tells_stays_as_it_was_sent() -> None:
    frames, asked = [{HEAD_PITCH: 900}, {OPEN_JAW: 1}], [set(), {HEAD_PITCH, CORNER_L}]
    for expression in (None, [(JOY, 63, 0, 0, 0, 0), None]):
        shown = resolve(taken_back(frames, asked, expression), JoyfulFace)
        assert shown[:, HEAD_PITCH].tolist() == [900, 900]


def test_the_track_checks_and_carries_it() -> None:
    whole = taken_back([{OPEN_JAW: 1}, {}], [{OPEN_JAW, CORNER_L}, {CORNER_L}])
    assert whole.interpolated[:, [OPEN_JAW, CORNER_L]].tolist() == [[False, True], [False, True]]
    part = whole[1:].interpolated
    assert part.any(axis=0).nonzero()[0].tolist() == [CORNER_L]
    assert taken_back([{}], [set()]).interpolated is None
    for wrong, message in (
        (np.zeros((1, 68), bool), "shape"),
        (np.zeros((2, 68), int), "must be bool"),
    ):
        with pytest.raises(ValueError, match=message):
            FaceTrack(whole.values, whole.mask, None, None, wrong)  # type: ignore[arg-type]


def test_joining_and_resampling_keep_it() -> None:
    asking = Animation(25, np.arange(2), taken_back([{OPEN_JAW: 1}, {OPEN_JAW: 3}], [{CORNER_L}, {CORNER_R}]))
    plain = Animation(25, np.arange(1), taken_back([{OPEN_JAW: 1}], [set()]))
    joined = Animation.concatenate([plain, asking]).face
    assert joined.interpolated[:, CORNER_L].tolist() == [False, True, False]
    finer = asking.resample(50).face
    assert finer.interpolated[:, CORNER_L].tolist() == [True, True, False]


def test_a_stream_carries_it_both_ways() -> None:
    lips = range(OPEN_JAW, 18)  # all of group 2
    frames = [dict.fromkeys(lips, 32), {CORNER_R: 60}, {CORNER_R: 90}, dict.fromkeys(lips, 8)]
    asked = [set(), set(lips) - {CORNER_R}, set(lips) - {CORNER_R}, set()]
    source = Animation(25, np.arange(4), taken_back(frames, asked))
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
    source = Animation(25, np.arange(1), taken_back([{CORNER_R: 6}], [{CORNER_L}]))
    got = fba.decode(fba.encode(source)).face
    assert got.interpolated is None


def test_the_option_unsent_asks_for_interpolation() -> None:
    source = Animation(25, np.arange(1), taken_back([{CORNER_R: 6}], [set()]))
    got = fba.decode(fba.encode(source, fba.EncoderOptions(unsent="interpolate"))).face
    assert np.flatnonzero(got.interpolated[0]).tolist() == [c for c in range(2, 18) if c != CORNER_R]


def test_a_whole_group_may_be_asked_for() -> None:
    source = Animation(
        25,
        np.arange(2),
        taken_back([dict.fromkeys(range(2, 18), 7), {HEAD_PITCH: 170}], [set(), set(range(2, 18))]),
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
