"""What a face shows: kept values, mates, lips, visemes and expressions, by hand.

Names of shapes: spellings of ARKit's blendshapes, and FAPs.
"""

import numpy as np
import pytest

from fba.animation import FaceTrack
from fba.face import Definitions, Resolver, arkit_names, arkit_of, resolve
from fba.face.shape_names import canonical_names, fap_of
from fba.parameters import faps
from hand_tracks import track

JOY, ANGER = 1, 3
OPEN_JAW, MIDLIP, MIDLIP_O = 3, 4, 51


def simple_definitions() -> Definitions:
    visemes, expressions = np.zeros((15, 68)), np.zeros((7, 68))
    for select in range(15):
        visemes[select, OPEN_JAW - 1] = 63 * select
    for select in range(7):
        expressions[select, OPEN_JAW - 1] = 630 * select
        expressions[select, 31 - 1] = 100
    return Definitions(visemes, expressions)


class Model:
    definitions = simple_definitions()
    fit = None


def test_shape_and_type() -> None:
    shown = resolve(track([{3: 5}, {}]))
    assert shown.dtype == np.float32
    assert shown.shape == (2, 68)
    assert resolve(track([])).shape == (0, 68)


def test_values_are_kept_until_the_next_one() -> None:
    shown = resolve(track([{3: 100}, {}, {3: 50}, {}, {}]))
    assert shown[:, 2].tolist() == [100, 100, 50, 50, 50]


@pytest.mark.parametrize("fap", [f for f in faps() if f.left_right_mate], ids=lambda f: f.name)
def test_a_side_never_sent_copies_the_other(fap) -> None:  # type: ignore[no-untyped-def]
    shown = resolve(track([{}, {fap.number: 120}, {fap.left_right_mate: 7}, {}]))
    mate = fap.left_right_mate - 1
    assert shown[:, mate].tolist() == [0, 120, 7, 7]
    assert shown[:, fap.number - 1].tolist() == [0, 120, 120, 120]


@pytest.mark.parametrize("fap", [f for f in faps() if f.lip_mate], ids=lambda f: f.name)
def test_a_lip_contour_never_sent_follows_the_other(fap) -> None:  # type: ignore[no-untyped-def]
    assert resolve(track([{fap.number: -80}]))[0, fap.lip_mate - 1] == -80


def test_an_outer_lip_follows_the_inner_one_of_the_other_side_at_last() -> None:
    assert resolve(track([{6: 90}]))[0, 54 - 1] == 90  # 54's lip mate is 7, whose mate is 6


def test_mate_comes_before_lip() -> None:
    assert resolve(track([{53: 11, 7: 22}]))[0, 54 - 1] == 11


def test_viseme_formula() -> None:
    # 21/63 of 63 x 2 and 42/63 of 63 x 5
    shown = resolve(track([{}], viseme=[(2, 5, 21, 0)]), Model)
    assert shown[0, 2] == pytest.approx(126 / 3 + 315 * 2 / 3)
    assert resolve(track([{}], viseme=[(2, 5, 63, 0)]), Model)[0, 2] == 126


def test_expression_formula() -> None:
    # 630 x 1 x 21/63 + 630 x 3 x 9/63
    shown = resolve(track([{}], expression=[(JOY, 21, ANGER, 9, 0, 0)]), Model)
    assert shown[0, 2] == pytest.approx(210 + 270)
    assert (shown[0, 30], shown[0, 31]) == pytest.approx((100 * 30 / 63, 0))


def test_one_expression_twice_is_never_more_than_all_of_it() -> None:
    for second, expected in ((21, 63), (63, 63), (5, 47)):
        shown = resolve(track([{}], expression=[(JOY, 42, JOY, second, 0, 0)]), Model)
        assert shown[0, 2] == pytest.approx(630 * expected / 63)


def test_viseme_and_expression_add_up_and_are_kept() -> None:
    shown = resolve(track([{}, {}], [(1, 0, 63, 0), None], [(JOY, 63, 0, 0, 0, 0), None]), Model)
    assert shown[:, 2] == pytest.approx([63 + 630] * 2)


def test_what_was_sent_stands_over_the_expression() -> None:
    shown = resolve(track([{3: 40}], expression=[(JOY, 63, 0, 0, 0, 0)]), Model)
    assert (shown[0, 2], shown[0, 30]) == (40, 100)


def test_init_face_makes_the_expression_the_neutral_face() -> None:
    shown = resolve(track([{3: 40}], expression=[(JOY, 63, 0, 0, 1, 0)]), Model)
    assert shown[0, 2] == 670


def test_expression_def_stores_what_is_sent_with_it() -> None:
    frames = [{3: 77}, {3: 0}, {}]
    shown = resolve(
        track(frames, expression=[(JOY, 63, 0, 0, 1, 1), (ANGER, 63, 0, 0, 1, 0), (JOY, 63, 0, 0, 1, 0)]),
        Model,
    )
    # with init_face, expression and sent value add: 77 + 77, then 630 x 3 + 0, then the stored 77 + 0
    assert shown[:, 2].tolist() == [154, 1890, 77]
    assert shown[2, 30] == 0  # the redefinition has no brows


def test_viseme_def_stores_the_mouth_only() -> None:
    first = track([{3: 77, 31: 500}], viseme=[(4, 0, 63, 1)])
    second = track([{}], viseme=[(4, 0, 63, 0)], expression=[(0, 0, 0, 0, 1, 0)])
    resolver = Resolver(Model)
    resolver.push(first)
    shown = resolver.push(second)
    assert (shown[0, 2], shown[0, 30]) == (77 + 77, 500)


def test_def_without_low_level_faps_changes_nothing() -> None:
    shown = resolve(track([{}], expression=[(JOY, 63, 0, 0, 0, 1)]), Model)
    assert shown[0, 2] == 630


def test_pieces_give_what_the_whole_gives() -> None:
    rng = np.random.default_rng(11)
    count = 300
    mask = rng.random((count, 68)) < 0.1
    values = np.where(mask, rng.integers(-500, 500, (count, 68)), 0)
    values[:, :2] = 0
    most = (7, 64, 7, 64, 2, 2)
    viseme = np.stack([rng.integers(0, high, count) for high in (15, 15, 64, 2)], axis=1)
    expression = np.stack([rng.integers(0, high, count) for high in most], axis=1)
    whole = FaceTrack(values, mask, viseme, expression)
    resolver = Resolver()
    pieces = [resolver.push(whole[a:b]) for a, b in ((0, 1), (1, 57), (57, 58), (58, 300))]
    np.testing.assert_array_equal(np.concatenate(pieces), resolve(whole))


def test_first_columns_are_zero() -> None:
    shown = resolve(track([{}], viseme=[(3, 0, 63, 0)], expression=[(JOY, 63, 0, 0, 0, 0)]))
    assert not shown[:, :2].any()
    assert shown.any()


def test_built_in_definitions_say_what_their_names_say() -> None:
    number = {f.name: f.number - 1 for f in faps()}
    joy, sadness, anger, fear, disgust, surprise = Definitions.default().expressions[1:]
    assert joy[number["raise_l_cornerlip"]] > 200
    assert joy[number["stretch_r_cornerlip"]] == joy[number["stretch_l_cornerlip"]] > 100
    assert sadness[number["raise_l_i_eyebrow"]] > 0 > sadness[number["raise_r_cornerlip"]]
    assert anger[number["squeeze_l_eyebrow"]] > 0 > anger[number["raise_r_i_eyebrow"]]
    assert fear[number["raise_l_i_eyebrow"]] > 0 > fear[number["close_t_l_eyelid"]]
    assert disgust[number["raise_nose"]] > 0 > disgust[number["lower_t_midlip"]]
    assert surprise[number["open_jaw"]] > 500
    assert surprise[number["close_t_r_eyelid"]] < 0
    visemes = Definitions.default().visemes
    assert visemes.shape == (15, 68)
    assert visemes[10, number["open_jaw"]] == visemes[:, number["open_jaw"]].max()  # A: opens widest
    assert visemes[1, number["open_jaw"]] == 0  # p b m closes
    assert visemes[1:].any(axis=1).all()


def test_definitions_check_their_shape() -> None:
    with pytest.raises(ValueError, match="expressions"):
        Definitions(np.zeros((15, 68)), np.zeros((6, 68)))
    with pytest.raises(ValueError, match="finite"):
        Definitions(np.full((15, 68), np.nan), np.zeros((7, 68)))


def test_there_are_52_and_each_knows_itself() -> None:
    assert len(set(arkit_names())) == 52
    assert [arkit_of(name) for name in arkit_names()] == list(arkit_names())


@pytest.mark.parametrize(
    ("written", "shape"),
    [
        ("eyeBlink_L", "eyeBlinkLeft"),
        ("EyeBlinkLeft", "eyeBlinkLeft"),
        ("Left_Eye_Blink", "eyeBlinkLeft"),
        ("blendShape1.eyeBlink_R", "eyeBlinkRight"),
        ("Fcl_EYE_Close_L", "eyeBlinkLeft"),
        ("JAW_OPEN", "jawOpen"),
        ("mouth-open", "jawOpen"),
        ("browInnerUp", "browInnerUp"),
        ("mouth_Left", "mouthLeft"),
        ("mouthRollLower", "mouthRollLower"),
        ("viseme_PP", None),
        ("target 3", None),
        ("", None),
        ("eyes", None),
    ],
)
def test_spellings(written: str, shape: str | None) -> None:
    assert arkit_of(written) == shape


def test_faps_by_name() -> None:
    assert fap_of("open_jaw") == 3
    assert fap_of("Pull_R_Ear") == 68
    assert fap_of("viseme") is None
    assert fap_of("jawOpen") is None


def test_the_first_of_several_counts() -> None:
    assert canonical_names(["x", "eyeBlink_L", "blink_L"]) == {"eyeBlinkLeft": "eyeBlink_L"}


def test_words_before_all_names_are_left_out() -> None:
    names = ["A14_Eye_Blink_Left", "A25_Jaw_Open", "A30_Mouth_Left", "T01_Tongue_Up"]
    assert canonical_names(names) == {"eyeBlinkLeft": names[0], "jawOpen": names[1], "mouthLeft": names[2]}
    assert canonical_names(["low_mouthOpen", "half_jawOpen", "x", "y"]) == {}
    # where a name is known as it stands, none is shortened
    assert list(canonical_names(["jawOpen", "far_jawLeft", "far_jawRight", "far_x"])) == ["jawOpen"]
