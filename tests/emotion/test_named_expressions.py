from itertools import combinations

import numpy as np
import pytest

from fba import emotion
from fba.emotion._rules import fap_limits
from fba.errors import OptionError
from fba.face import Deformer, FaceModel
from fba.face._expressions import Definitions
from fba.parameters import fap_numbers


def column(name: str) -> int:
    return fap_numbers()[name] - 1


def test_there_are_at_least_24_of_six_families() -> None:
    named = emotion.expressions()
    assert len(named) >= 24
    assert {one.family for one in named} == {*emotion.FAMILIES, ""}
    assert len({name for one in named for name in (one.name, *one.aliases)}) == sum(
        1 + len(one.aliases) for one in named
    )


@pytest.mark.parametrize("select", range(1, 7))
def test_the_six_are_those_of_fap_2(select: int) -> None:
    one = emotion.expression(emotion.FAMILIES[select - 1])
    assert one.select == select
    assert np.array_equal(one.faps, Definitions.default().expressions[select])


def test_no_expression_leaves_the_limits_of_the_standard() -> None:
    low, high = fap_limits()
    for one in emotion.expressions():
        assert (one.faps >= low).all(), one
        assert (one.faps <= high).all(), one
        assert one.faps[2:].any(), one


def test_no_two_look_the_same() -> None:
    table = np.array([one.faps for one in emotion.expressions()])
    apart = np.abs(table[:, None] - table).max(axis=2)
    assert apart[~np.eye(len(table), dtype=bool)].min() > 40


def test_faces_of_all_words_can_be_told_apart() -> None:
    """Every pair at full intensity, by the skin that any of them moves by 2 mm: 1.5 mm apart at least, rms.

    Guilt and worry were 0.4 mm apart, joy and delight 0.9, sadness and shame 1.0.
    """
    model = FaceModel.default()
    named = emotion.expressions()
    faces = Deformer(model).local(np.array([np.zeros(68, np.float32), *(one.faps for one in named)]))
    skin = np.concatenate([np.full(len(part.vertices), part.kind == "skin") for part in model.parts])
    moved = 1000 * (faces[1:, skin].astype(np.float64) - faces[0, skin])
    moved = moved[:, (np.linalg.norm(moved, axis=2) >= 2).any(axis=0)]
    apart = {
        (a.name, b.name): float(np.sqrt(((one - other) ** 2).sum(axis=1).mean()))
        for (a, one), (b, other) in combinations(zip(named, moved, strict=True), 2)
    }
    assert len(apart) == 35 * 34 // 2
    assert {pair: distance for pair, distance in apart.items() if distance < 1.5} == {}


def test_who_is_ashamed_or_guilty_looks_away() -> None:
    pitch, yaw, lid = column("pitch_l_eyeball"), column("yaw_l_eyeball"), column("close_t_l_eyelid")
    shame, guilt = (emotion.expression(name).faps for name in ("shame", "guilt"))
    assert min(shame[pitch], guilt[pitch], guilt[yaw]) > 17_000  # ten degrees
    assert shame[column("head_pitch")] > 17_000
    assert min(shame[lid], guilt[lid]) > 300


def test_whissels_table() -> None:
    points = emotion.known_points()
    assert (points["fear"], points["shame"], points["guilt"]) == ((4.9, 3.4), (2, 2.7), (4, 1.1))
    assert (points["delight"], len(points)) == ((4.2, 6.4), 11)


@pytest.mark.parametrize("name", ["Afraid", "fear", " FEAR ", "scared"])
def test_names_and_aliases(name: str) -> None:
    assert emotion.expression(name).name == "fear"


def test_words_may_be_joined() -> None:
    assert emotion.expression("fake_smile") is emotion.expression("Fake-smile")


def test_an_unknown_name_suggests_the_nearest() -> None:
    with pytest.raises(OptionError, match=r"no expression 'disgusst' \(did you mean 'disgust'\?\)"):
        emotion.expression("disgusst")


def test_a_fake_smile_lifts_no_cheeks() -> None:
    smile, fake = emotion.expression("smile").faps, emotion.expression("fake smile").faps
    lifted, lower_lid = column("lift_l_cheek"), column("close_b_l_eyelid")
    assert smile[lifted] >= 200
    assert fake[lifted] == 0
    assert smile[lower_lid] >= 200
    assert fake[lower_lid] <= 0


@pytest.mark.parametrize("name", ["contempt", "sneer", "sarcasm"])
def test_a_sneer_is_one_sided(name: str) -> None:
    faps = emotion.expression(name).faps
    left, right = column("raise_l_cornerlip"), column("raise_r_cornerlip")
    assert abs(faps[left] - faps[right]) > 100


def test_the_eyes_tell_worry_fear_and_terror_apart() -> None:
    lid = column("close_t_l_eyelid")
    openings = [-emotion.expression(name).faps[lid] for name in ("worry", "fear", "terror")]
    assert openings == sorted(openings)


def test_all_measurements_of_table_8_4() -> None:
    listed = {family: emotion.measurements(family) for family in emotion.FAMILIES}
    assert sum(map(len, listed.values())) == 48
    jaw = next(one for one in listed["surprise"] if one.feature == 11)
    assert (jaw.faps, jaw.mean, jaw.deviation) == ((3,), 885, 316)


@pytest.mark.parametrize(
    ("family", "faps", "total"),
    [
        ("anger", ["squeeze_l_eyebrow"], 57),
        ("anger", ["raise_l_m_eyebrow"], -149),
        ("sadness", ["close_t_l_eyelid", "close_b_l_eyelid"], 153),
        ("fear", ["close_t_r_eyelid", "close_b_r_eyelid"], -249),
        ("fear", ["raise_b_midlip"], -218),
        ("disgust", ["raise_b_midlip"], 177),
        ("joy", ["lower_t_midlip"], -271),
        ("joy", ["stretch_l_cornerlip", "stretch_r_cornerlip"], 234),
        ("surprise", ["squeeze_l_eyebrow", "squeeze_r_eyebrow"], -86),
    ],
)
def test_measured_distances_become_faps_with_the_standards_signs(
    family: str, faps: list[str], total: float
) -> None:
    values = emotion.measured_faps(family)
    assert values[[column(name) for name in faps]].sum() == pytest.approx(total)


def test_a_measured_profile_moves_by_its_deviations() -> None:
    assert emotion.measured_faps("surprise", {11: 1.0})[2] == 885 + 316
    assert emotion.measured_faps("fear", {4: -1.0})[4] == -(218 - 135)


def test_vocabularies_and_measurements_agree_in_sign() -> None:
    """Where Tables 8-3 and 8-4 both have a FAP; disgust's brows are in the second alone."""
    for family in emotion.FAMILIES:
        measured = emotion.measured_faps(family)
        listed = {one.fap: one.sign for one in emotion.vocabulary(family)}
        both = [fap for fap in listed if measured[fap - 1]]
        assert len(both) >= 3, family
        assert [fap for fap in both if np.sign(measured[fap - 1]) != listed[fap]] == []


@pytest.mark.parametrize("family", emotion.FAMILIES)
def test_shown_expressions_contradict_no_sign_of_table_8_3(family: str) -> None:
    """Of what always takes part. Anger's lids open, though the eyes of trackers' angry faces narrow."""
    shown = emotion.expression(family).faps
    listed = [one for one in emotion.vocabulary(family) if not one.alternative]
    assert [one.fap for one in listed if shown[one.fap - 1] * one.sign < 0] == []


def test_an_unknown_family_is_an_error() -> None:
    with pytest.raises(OptionError, match="no family 'joi'"):
        emotion.vocabulary("joi")
