import numpy as np
import pytest

from fba import emotion
from fba.emotion import Rules
from fba.emotion._rules import Part, mix_families, mix_within_family
from fba.errors import OptionError
from fba.parameters import fap_numbers

JAW, LIP, BROW, LID = 2, 4, 30, 18


def part(faps: dict[int, float], *, moved: tuple[int, ...] | None = None, activation: float = 5.0,
         intensity: float = 1.0, family: str = "fear") -> Part:  # fmt: skip
    values, mask = np.zeros(68), np.zeros(68)
    for where, value in faps.items():
        values[where] = value
    mask[list(faps if moved is None else moved)] = 1
    return Part(values, mask, activation, intensity, family)


def centre(faps: dict[int, float]) -> np.ndarray:
    return part(faps).faps


def test_one_family_interpolates_what_both_move() -> None:
    mixed = mix_within_family(
        part({JAW: 100}), part({JAW: 500}, intensity=0.5), centre({JAW: 200}), Rules(crossover=0)
    )
    assert mixed.faps[JAW] == pytest.approx(100 * 2 / 3 + 500 / 3)
    assert mixed.intensity == 1.0


def test_the_share_can_be_given() -> None:
    rules = Rules(interpolation=0.25)
    mixed = mix_within_family(part({JAW: 100}), part({JAW: 500}), centre({JAW: 200}), rules)
    assert mixed.faps[JAW] == pytest.approx(200)


@pytest.mark.parametrize(("value", "kept"), [(130, 65.0), (151, 0.0), (60, 30.0), (49, 0.0)])
def test_what_one_moves_stays_reduced_if_it_is_near_the_familys_value(value: float, kept: float) -> None:
    rules = Rules(reduction=0.5, nearness=0.5)
    mixed = mix_within_family(part({JAW: 10, BROW: value}), part({JAW: 10}), centre({BROW: 100}), rules)
    assert mixed.faps[BROW] == pytest.approx(kept)


def test_of_two_families_the_more_active_dominates() -> None:
    surprise = part({JAW: 600, BROW: 200}, activation=6.5, family="surprise")
    anger = part({BROW: -200, LID: -50}, activation=4.2, family="anger")
    for pair in ((surprise, anger), (anger, surprise)):
        mixed = mix_families(pair, Rules(reduction=0.4))
        assert mixed[[JAW, BROW, LID]] == pytest.approx([600, 200, -20])


def test_intensity_counts_in_activation() -> None:
    surprise = part({BROW: 200}, activation=6.5, intensity=0.3, family="surprise")
    anger = part({BROW: -200}, activation=4.2, family="anger")
    assert mix_families((surprise, anger), Rules())[BROW] == pytest.approx(-200)


@pytest.mark.parametrize("crossover", [0, 0.1])
def test_equal_activations_share(crossover: float) -> None:
    pair = (part({BROW: 200}), part({BROW: -100}, family="anger"))
    assert mix_families(pair, Rules(crossover=crossover))[BROW] == pytest.approx(50)


@pytest.mark.parametrize(("lead", "brow", "lid"), [(5.001, 200, -20), (4.999, -200, -50)])
def test_without_a_crossover_the_rules_take_hold_at_once(lead: float, brow: float, lid: float) -> None:
    first = part({JAW: 600, BROW: 200}, activation=lead, family="surprise")
    second = part({BROW: -200, LID: -50}, activation=5, family="anger")
    mixed = mix_families((first, second), Rules(reduction=0.4, crossover=0))
    assert mixed[[BROW, LID]] == pytest.approx([brow, lid])


def test_without_a_crossover_all_expressions_mix() -> None:
    """Named ones together and in pairs of one family, also where one has no intensity."""
    rules = Rules(crossover=0)
    assert emotion.combine({one.name: 100 for one in emotion.expressions()}, rules).faps.any()
    assert emotion.combine({"fear": 60, "terror": 60, "joy": 30}, rules).faps.any()
    assert emotion.combine({"fear": 60, "joy": 0}, rules).faps == pytest.approx(
        emotion.combine({"fear": 60}).faps
    )


def test_a_third_comes_in_reduced_after_the_second() -> None:
    parts = [
        part({BROW: 200}, activation=6),
        part({LID: 100, BROW: 7}, activation=4, family="joy"),
        part({JAW: 100, LID: 9}, activation=2, family="anger"),
    ]
    mixed = mix_families(parts, Rules(reduction=0.5))
    assert mixed[[BROW, LID, JAW]] == pytest.approx([200, 50, 25])


@pytest.mark.parametrize("pair", [("fear", "terror"), ("fear", "joy"), ("sleepiness", "anger")])
def test_nothing_jumps_while_intensities_change(pair: tuple[str, str]) -> None:
    shown = np.array(
        [
            emotion.combine({pair[0]: 100 - step / 4, pair[1]: step / 4}).faps[
                [*range(2, 22), *range(30, 42)]
            ]
            for step in range(401)
        ]
    )
    assert np.abs(np.diff(shown, axis=0)).max() < 60


def test_a_mixture_stays_within_the_limits() -> None:
    blend = emotion.combine({one.name: 100 for one in emotion.expressions()})
    assert np.isfinite(blend.faps).all()
    assert blend.faps[fap_numbers()["open_jaw"] - 1] <= 4 * 1080


def test_one_alone_is_itself() -> None:
    blend = emotion.combine({"terror": 50, "neutral": 70})
    assert np.allclose(blend.faps, emotion.expression("terror").faps / 2)
    assert str(blend) == "terror=50"


def test_fap_2_says_one_or_two_of_six() -> None:
    assert emotion.combine({"fear": 60, "joy": 30}).fields is not None
    assert np.array_equal(emotion.combine({"fear": 100, "joy": 50}).fields, [4, 63, 1, 32, 0, 0])
    assert emotion.combine({"terror": 60}).fields is None
    assert emotion.combine({"fear": 60, "joy": 30, "anger": 10}).fields is None


@pytest.mark.parametrize("bad", [-1, 101, np.nan, np.inf])
def test_intensities_out_of_range(bad: float) -> None:
    with pytest.raises(OptionError, match="intensity of 'fear' must be from 0 to 100"):
        emotion.combine({"fear": bad})


def test_two_names_of_one_expression_contradict_each_other() -> None:
    with pytest.raises(OptionError, match="'afraid' means 'fear', which is given already"):
        emotion.combine({"fear": 60, "afraid": 30})


@pytest.mark.parametrize("wrong", [{"reduction": 1.5}, {"nearness": np.nan}, {"interpolation": -0.1}])
def test_parameters_out_of_range(wrong: dict[str, float]) -> None:
    with pytest.raises(OptionError, match="must be a number from 0 to 1"):
        Rules(**wrong)


@pytest.mark.parametrize(
    ("text", "weights"),
    [
        ("fear=60 joy=30", {"fear": 60, "joy": 30}),
        ("fear=60,joy", {"fear": 60, "joy": 100}),
        ("pleasant surprise=20, fake_smile=5.5%", {"pleasant surprise": 20, "fake_smile": 5.5}),
    ],
)
def test_weights_as_text(text: str, weights: dict[str, float]) -> None:
    assert emotion.parse_weights(text) == weights


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no expression is given"),
        ("=5", "a name is missing"),
        ("fear=x", "must be a number from 0 to 100, not 'x'"),
        ("fear=5 fear=6", "given twice"),
    ],
)
def test_weights_that_cannot_be_read(text: str, message: str) -> None:
    with pytest.raises(OptionError, match=message):
        emotion.parse_weights(text)


def test_the_plane_gives_named_expressions_at_their_points() -> None:
    for name, point in emotion.known_points().items():
        assert str(emotion.expression_at(*point)) == f"{name}=100"


def test_the_middle_of_the_plane_is_neutral() -> None:
    assert emotion.expression_at(*emotion.NEUTRAL_POINT).parts == ()


def test_a_path_over_the_plane_does_not_jump() -> None:
    path = np.linspace((1.5, 1.5), (6.8, 6.6), 4000)
    lids = [emotion.expression_at(*point).faps[[2, 4, 11, 18, 30, 32]] for point in path]
    assert np.abs(np.diff(lids, axis=0)).max() < 10


@pytest.mark.parametrize("point", [(0.5, 4), (4, 7.5), (np.nan, 4)])
def test_points_beyond_the_plane(point: tuple[float, float]) -> None:
    with pytest.raises(OptionError, match="must be from 1 to 7"):
        emotion.expression_at(*point)
