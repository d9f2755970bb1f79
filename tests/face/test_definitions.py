"""The built-in visemes and expressions: what phonetics and measured faces say about each."""

import numpy as np
import pytest

from fba.face import EXPRESSION_NAMES, VISEME_NAMES, Definitions, FaceModel
from fba.parameters import fap_numbers, faps

VISEMES = dict(enumerate(VISEME_NAMES))
EXPRESSIONS = dict(enumerate(EXPRESSION_NAMES))
JOY, SADNESS, ANGER, FEAR, DISGUST, SURPRISE = range(1, 7)
PBM, FV, TH, TD, KG, TSH, SZ, NL, R, A, E, I, O, U = range(1, 15)  # noqa: E741 - the vowel
OPENED = [v for v in range(2, 15) if v != FV]


def viseme(select: int, name: str) -> float:
    return float(Definitions.default().visemes[select, fap_numbers()[name] - 1])


def expression(select: int, name: str) -> float:
    return float(Definitions.default().expressions[select, fap_numbers()[name] - 1])


def gap(table: np.ndarray, place: str = "mid") -> np.ndarray:
    """How far the inner lips stand apart: lower_t is positive down, raise_b positive up; both close."""
    top, bottom = {"mid": (4, 5), "left": (8, 10), "right": (9, 11)}[place]
    found: np.ndarray = -(table[..., top - 1] + table[..., bottom - 1])
    return found


# ---- visemes


def test_lips_never_pass_through_each_other() -> None:
    for table in (Definitions.default().visemes, Definitions.default().expressions):
        for place in ("mid", "left", "right"):
            assert (gap(table, place) >= -20).all()  # at most the 0.4 mm by which soft lips press


@pytest.mark.parametrize("select", range(1, 15), ids=VISEMES.get)
def test_a_viseme_is_symmetric_and_leaves_eyes_and_head_alone(select: int) -> None:
    row = Definitions.default().visemes[select]
    for fap in faps():
        if fap.left_right_mate is not None:
            assert row[fap.number - 1] == row[fap.left_right_mate - 1]
    for fap in faps():
        if fap.group in (3, 4, 7, 9, 10):
            assert row[fap.number - 1] == 0, fap.label
    assert row[[14, 42]].tolist() == [0, 0]  # jaw and tongue stay in the middle


@pytest.mark.parametrize("kind", ["visemes", "expressions"])
def test_values_stay_well_inside_their_ranges(kind: str) -> None:
    """Two of them, or one with an expression on top, can still be coded."""
    table = getattr(Definitions.default(), kind)
    for fap in faps()[2:]:
        assert fap.i_limits is not None
        low, high = fap.i_limits
        column = table[:, fap.number - 1]
        assert low * fap.step / 2 <= column.min(), fap.label
        assert column.max() <= high * fap.step / 2, fap.label


def test_p_b_m_press_the_lips_together() -> None:
    row = Definitions.default().visemes[PBM]
    assert [gap(row, place) for place in ("mid", "left", "right")] == [0, 0, 0]
    assert viseme(PBM, "open_jaw") == 0
    assert viseme(PBM, "lower_t_midlip_o") > 50 < viseme(PBM, "raise_b_midlip_o")  # less red is seen
    assert viseme(PBM, "push_b_lip") < 0 > viseme(PBM, "push_t_lip")  # rolled in


def test_f_v_put_the_lower_lip_to_the_upper_teeth() -> None:
    assert viseme(FV, "push_b_lip") == min(viseme(v, "push_b_lip") for v in range(15)) < -100
    assert viseme(FV, "raise_b_midlip") >= 0  # up to the edge of the upper teeth
    assert viseme(FV, "lower_t_midlip") < -100  # which are seen
    assert viseme(FV, "open_jaw") < 100


def test_the_tongue_does_what_each_consonant_needs() -> None:
    tip = {v: viseme(v, "raise_tongue_tip") for v in range(15)}
    out = {v: viseme(v, "thrust_tongue_tip") for v in range(15)}
    back = {v: viseme(v, "raise_tongue") for v in range(15)}
    assert out[TH] == max(out.values()) > 150  # between the teeth, as in "thin"
    assert viseme(TH, "open_jaw") >= 150
    assert tip[TD] > 100 < tip[NL]  # at the ridge behind the upper teeth
    assert tip[R] > 100
    assert out[R] < 0  # bunched back
    assert back[KG] == max(back.values()) > 200  # the back against the soft palate
    for vowel in (A, E, I, O, U):
        assert (tip[vowel], out[vowel], back[vowel]) == (0, 0, 0)


def test_s_and_sh_keep_the_teeth_together_behind_open_lips() -> None:
    for select in (SZ, TSH):
        assert viseme(select, "open_jaw") < 60
        assert gap(Definitions.default().visemes[select]) > 200
    assert viseme(SZ, "stretch_l_cornerlip") > 0 > viseme(TSH, "stretch_l_cornerlip")
    assert viseme(TSH, "push_t_lip") > 200 < viseme(TSH, "push_b_lip")


def test_vowels_open_in_the_order_of_phonetics() -> None:
    jaw = [viseme(v, "open_jaw") for v in (A, O, E, I, U)]
    assert jaw == sorted(jaw, reverse=True)
    lips = [gap(Definitions.default().visemes[v]) for v in (A, O, E, I, U)]
    assert lips == sorted(lips, reverse=True)
    assert viseme(A, "open_jaw") == max(viseme(v, "open_jaw") for v in range(15))


def test_rounded_visemes_narrow_the_mouth_and_push_the_lips() -> None:
    width = {v: viseme(v, "stretch_l_cornerlip") for v in range(15)}
    for rounded in (O, U, TSH, R):
        assert width[rounded] < -100
        assert viseme(rounded, "push_t_lip") > 100 < viseme(rounded, "push_b_lip")
    assert width[U] == min(width.values())  # narrowest and most protruded
    assert viseme(U, "push_b_lip") == max(viseme(v, "push_b_lip") for v in range(15))
    assert width[I] == max(width.values()) > width[E] > 50  # spread


@pytest.mark.parametrize("select", OPENED, ids=VISEMES.get)
def test_lips_part_where_sound_comes_out(select: int) -> None:
    assert gap(Definitions.default().visemes[select]) > 100


def test_visemes_differ_from_each_other() -> None:
    table = Definitions.default().visemes
    for one in range(15):
        for other in range(one):
            assert np.abs(table[one] - table[other]).max() >= 80, (VISEMES[one], VISEMES[other])


# ---- expressions

MEASURED = [
    # measured means and deviations over pictures and recordings (Karpouzis, Table 8-4, with the
    # signs of 8.5): squeezes and eye openings are changes of distances, so the FAPs have the other sign
    (ANGER, {"squeeze_l_eyebrow": 1}, 57, 28),
    (ANGER, {"squeeze_l_eyebrow": 1, "squeeze_r_eyebrow": 1}, 69, 51),
    (ANGER, {"raise_l_i_eyebrow": 1}, -83, 48),
    (ANGER, {"raise_r_i_eyebrow": 1}, -85, 51),
    (ANGER, {"raise_l_o_eyebrow": 1}, -66, 35),
    (ANGER, {"raise_l_m_eyebrow": 1}, -149, 40),
    (ANGER, {"lower_t_midlip": 1}, -73, 51),
    (SADNESS, {"raise_l_i_eyebrow": 1}, 85, 55),
    (SADNESS, {"close_t_l_eyelid": 1, "close_b_l_eyelid": 1}, 153, 112),
    (SADNESS, {"squeeze_l_eyebrow": 1, "squeeze_r_eyebrow": 1}, 56, 35),
    (JOY, {"lower_t_midlip": 1}, -271, 110),
    (JOY, {"raise_l_m_eyebrow": 1}, 24, 22),
    (JOY, {"close_t_l_eyelid": 1, "close_b_l_eyelid": 1}, 254, 133),
    (JOY, {"stretch_l_cornerlip": 1, "stretch_r_cornerlip": 1}, 234, 98),
    (DISGUST, {"lower_t_midlip": 1}, -234, 109),
    (DISGUST, {"raise_b_midlip": 1}, 177, 108),  # a distance from the nose: the lower lip rises
    (DISGUST, {"raise_l_m_eyebrow": 1}, -80, 53),
    (DISGUST, {"close_t_l_eyelid": 1, "close_b_l_eyelid": 1}, 203, 148),
    (DISGUST, {"squeeze_l_eyebrow": 1, "squeeze_r_eyebrow": 1}, 52, 34),
    (FEAR, {"raise_b_midlip": 1}, -218, 135),
    (FEAR, {"raise_l_i_eyebrow": 1}, 104, 69),
    (FEAR, {"raise_l_m_eyebrow": 1}, 72, 58),
    (FEAR, {"open_jaw": 1}, 291, 189),
    (FEAR, {"close_t_l_eyelid": 1, "close_b_l_eyelid": 1}, -244, 126),
    (SURPRISE, {"raise_b_midlip": 1}, -543, 203),
    (SURPRISE, {"raise_l_i_eyebrow": 1}, 224, 103),
    (SURPRISE, {"raise_l_o_eyebrow": 1}, 54, 31),
    (SURPRISE, {"raise_l_m_eyebrow": 1}, 144, 64),
    (SURPRISE, {"open_jaw": 1}, 885, 316),
    (SURPRISE, {"close_t_l_eyelid": 1, "close_b_l_eyelid": 1}, -254, 83),
    (SURPRISE, {"stretch_l_cornerlip": 1, "stretch_r_cornerlip": 1}, -82, 39),
    (SURPRISE, {"squeeze_l_eyebrow": 1, "squeeze_r_eyebrow": 1}, -86, 60),
]


@pytest.mark.parametrize(
    ("select", "sum_of", "mean", "deviation"),
    MEASURED,
    ids=[f"{EXPRESSIONS[row[0]]} {'+'.join(row[1])}" for row in MEASURED],
)
def test_expressions_lie_near_measured_ones(
    select: int, sum_of: dict[str, int], mean: float, deviation: float
) -> None:
    """Full intensity may be stronger than the mean of faces that were measured, not something else."""
    ours = sum(sign * expression(select, name) for name, sign in sum_of.items())
    assert abs(ours - mean) <= 2.3 * deviation


def test_joy_lifts_corners_and_cheeks_and_narrows_the_eyes() -> None:
    assert expression(JOY, "raise_l_cornerlip") > 250
    assert expression(JOY, "stretch_l_cornerlip") > 80
    assert expression(JOY, "lift_l_cheek") > 100
    assert expression(JOY, "close_b_l_eyelid") > 100  # from below, as the cheeks push
    row = Definitions.default().expressions[JOY]
    lowest = min(-row[3], -row[7])  # the upper lip's middle and its halves, upwards
    assert row[11] > lowest  # the corners stand above the middle: a smile, not a snarl


def test_sadness_lifts_only_the_inner_brows_and_drops_lids_and_corners() -> None:
    brows = [expression(SADNESS, f"raise_l_{place}_eyebrow") for place in "imo"]
    assert brows == sorted(brows, reverse=True)
    assert brows[0] > 100
    assert brows[2] < 0
    assert expression(SADNESS, "raise_l_cornerlip") < -80
    assert expression(SADNESS, "close_t_l_eyelid") > 100
    assert expression(SADNESS, "depress_chin") > 50  # positive is up
    assert gap(Definitions.default().expressions[SADNESS]) < 50


def test_anger_knits_the_brows_and_presses_the_lips() -> None:
    brows = [expression(ANGER, f"raise_l_{place}_eyebrow") for place in "imo"]
    assert brows == sorted(brows)
    assert brows[0] < -100
    assert expression(ANGER, "squeeze_l_eyebrow") == max(expression(e, "squeeze_l_eyebrow") for e in range(7))
    assert expression(ANGER, "raise_l_cornerlip") < 0
    assert gap(Definitions.default().expressions[ANGER]) == 0
    assert expression(ANGER, "lower_t_midlip_o") > 50 < expression(ANGER, "raise_b_midlip_o")
    assert expression(ANGER, "stretch_l_nose") > 50
    assert -100 < expression(ANGER, "close_t_l_eyelid") < 0  # wide, but no white above the iris
    assert -100 < expression(ANGER, "close_b_l_eyelid") < 0


def test_fear_raises_and_knits_the_brows_and_opens_eyes_and_mouth() -> None:
    assert expression(FEAR, "raise_l_i_eyebrow") > expression(FEAR, "raise_l_o_eyebrow") > 0
    assert expression(FEAR, "squeeze_l_eyebrow") > 0 > expression(SURPRISE, "squeeze_l_eyebrow")
    assert expression(FEAR, "close_t_l_eyelid") < -100
    assert expression(FEAR, "stretch_l_cornerlip") > 0 > expression(SURPRISE, "stretch_l_cornerlip")
    assert expression(FEAR, "raise_l_cornerlip") < 0
    assert 100 < expression(FEAR, "open_jaw") < expression(SURPRISE, "open_jaw")


def test_disgust_wrinkles_the_nose_and_lifts_the_upper_lip() -> None:
    assert expression(DISGUST, "raise_nose") == max(expression(e, "raise_nose") for e in range(7)) > 100
    assert expression(DISGUST, "lower_t_midlip") < -150
    assert expression(DISGUST, "raise_b_midlip") > 0
    assert expression(DISGUST, "lift_l_cheek") > 100
    assert expression(DISGUST, "close_t_l_eyelid") > 50 < expression(DISGUST, "close_b_l_eyelid")
    assert expression(DISGUST, "raise_l_i_eyebrow") < 0 > expression(DISGUST, "raise_l_cornerlip")


def test_surprise_raises_the_whole_brow_and_drops_the_jaw() -> None:
    assert all(expression(SURPRISE, f"raise_l_{place}_eyebrow") > 100 for place in "imo")
    assert expression(SURPRISE, "open_jaw") == max(expression(e, "open_jaw") for e in range(7)) > 500
    assert gap(Definitions.default().expressions[SURPRISE]) > 500
    assert expression(SURPRISE, "close_t_l_eyelid") < -100


@pytest.mark.parametrize("select", range(1, 7), ids=EXPRESSIONS.get)
def test_an_expression_is_symmetric(select: int) -> None:
    row = Definitions.default().expressions[select]
    for fap in faps():
        if fap.left_right_mate is not None:
            sign = 1 if fap.name[:3] != "yaw" else -1
            assert row[fap.number - 1] == sign * row[fap.left_right_mate - 1]


def test_the_built_in_head_has_them() -> None:
    assert FaceModel.default().definitions is Definitions.default()
