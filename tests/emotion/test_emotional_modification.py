"""`emote`: moods on a performance; lips that touch, lids that close, limits, times."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fba
from fba.animation import Animation
from fba.arrays import Float32
from fba.emotion import Damping, Mood, MoodCurve, emote, expression, expressions, modify
from fba.errors import OptionError
from fba.face import resolve
from fba.face.deform._deformer import Deformer
from fba.face.model import FaceModel
from fba.parameters import fap_numbers, faps, point_rows
from fba.tracks import BodyTrack, FaceTrack

UPPER, LOWER = (18, 19), (20, 21)
"""Columns of the upper and the lower lids."""


def columns(*names: str) -> list[int]:
    return [fap_numbers()[name] - 1 for name in names]


def performance(frames: list[dict[int, int]], rate: int = 25) -> Animation:
    values = np.zeros((len(frames), 68), dtype=np.int32)
    mask = np.zeros((len(frames), 68), dtype=np.bool_)
    for row, frame in enumerate(frames):
        for number, value in frame.items():
            values[row, number - 1] = value
            mask[:, number - 1] = True
    return Animation(rate, np.arange(len(frames)), FaceTrack(values, mask))


def speech() -> Animation:
    """Lips that open and meet twice, an eye that blinks, brows that rise."""
    opening = [0, 60, 200, 320, 180, 40, 0, 0, 90, 260, 120, 0]
    blink = [0, 0, 0, 0, 512, 1024, 512, 0, 0, 0, 0, 0]
    return performance(
        [
            {3: gap, 5: -gap, 10: -gap, 11: -gap, 52: -gap, 57: -gap, 58: -gap,
             19: lid, 20: lid, 31: gap // 2, 32: gap // 2}
            for gap, lid in zip(opening, blink, strict=True)
        ]
    )  # fmt: skip


def lips_apart(shown: Float32) -> np.ndarray:
    """Millimetres between the lips of the built-in head, middle and both sides, (T, 3): heights only."""
    deformer = Deformer(FaceModel.default())
    pairs = [(point_rows()[a], point_rows()[b]) for a, b in (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9"))]
    rows = []
    for one in shown:
        points = deformer.feature_points(np.where(np.arange(68) // 3 == 16, 0, one).astype(np.float32))
        rows.append([(points[upper] - points[lower])[1] * 1000 for upper, lower in pairs])
    return np.array(rows)


@pytest.mark.parametrize("name", [one.name for one in expressions()])
def test_every_mood_keeps_lips_and_lids(name: str) -> None:
    source = speech()
    shown = resolve(source.face)  # type: ignore[arg-type]
    moved = resolve(emote(source, [Mood(name, 100)]).face)  # type: ignore[arg-type]
    touching = [0, 6, 7, 11]
    assert lips_apart(moved[touching]).max() < 0.5
    assert (moved[:, UPPER] + moved[:, LOWER]).max() <= 1024
    np.testing.assert_array_equal(moved[5, list(UPPER)] + moved[5, list(LOWER)], 1024)  # the blink shuts
    assert np.abs(moved - shown).max() > 20


def test_a_mood_opens_the_mouth_of_a_speaker_only() -> None:
    moved = resolve(emote(speech(), [Mood("surprise", 100)]).face)  # type: ignore[arg-type]
    jaw = moved[:, 2]
    assert jaw[[0, 6, 11]].max() == 0
    assert jaw[3] > 600  # the performer's 320 and most of the mood's 640, damped


def test_the_performance_is_damped_near_the_limit() -> None:
    source = performance([{31: value} for value in (0, 100, 200)])
    brow = columns("raise_l_i_eyebrow")[0]
    plain = 200.0
    surprised = resolve(emote(source, [Mood("surprised", 100)]).face)[:, brow]  # type: ignore[arg-type]
    assert 0 < surprised[2] - surprised[0] < 0.6 * plain
    half = resolve(emote(source, [Mood("surprised", 50)]).face)[:, brow]  # type: ignore[arg-type]
    assert surprised[2] - surprised[0] < half[2] - half[0] < plain
    angry = resolve(emote(source, [Mood("angry", 100)]).face)[:, brow]  # type: ignore[arg-type]
    assert angry[2] - angry[0] == plain  # against the mood, it moves freely


def test_at_the_limit_nothing_moves_further() -> None:
    limit = max(one.faps[30] for one in expressions())
    offsets, shown = np.zeros((2, 68)), np.zeros((2, 68))
    offsets[:, 30] = limit
    shown[1, 30] = 150
    moved = modify(shown, offsets, Damping(reach=1.0))
    np.testing.assert_array_equal(moved[:, 30], limit)


def test_without_a_mood_frames_stay() -> None:
    source = speech()
    shown = resolve(source.face)  # type: ignore[arg-type]
    made = emote(source, [Mood("anger", 80, start=0.16, end=0.32, ease=0.04)])
    moved = resolve(made.face)  # type: ignore[arg-type]
    np.testing.assert_array_equal(moved[:5], shown[:5])
    np.testing.assert_array_equal(moved[8:], shown[8:])
    assert (moved[6] != shown[6]).any()


def test_neutral_changes_nothing() -> None:
    source = speech()
    made = emote(source, [Mood("neutral", 100)])
    np.testing.assert_array_equal(resolve(made.face), resolve(source.face))  # type: ignore[arg-type]


def test_one_intensity_is_a_share_of_the_expression() -> None:
    still = performance([{31: 0}])
    for share in (25, 50, 100):
        moved = resolve(emote(still, [Mood("anger", share)]).face)[0]  # type: ignore[arg-type]
        expected = expression("anger").faps * share / 100
        brows = columns("raise_l_i_eyebrow", "squeeze_r_eyebrow")
        np.testing.assert_allclose(moved[brows], expected[brows], atol=0.5)


def test_moods_ease_in_and_out() -> None:
    source = performance([{31: 0}] * 101)
    brow = resolve(emote(source, [Mood("anger", 100, start=1, end=3, ease=0.5)]).face)[:, 30]  # type: ignore[arg-type]
    full = expression("anger").faps[30]
    np.testing.assert_allclose(
        brow[[25, 31, 38, 50, 62, 75]], np.array([0, 0.47, 1, 1, 1, 0]) * full, atol=10
    )
    assert np.abs(np.diff(brow)).max() < 0.16 * abs(full)  # nothing jumps


def test_several_moods_at_once_mix_by_the_rules() -> None:
    still = performance([{31: 0}] * 3)
    both = resolve(emote(still, [Mood("fear", 60), Mood("joy", 30)]).face)  # type: ignore[arg-type]
    brows = columns("raise_l_i_eyebrow", "raise_r_m_eyebrow", "squeeze_l_eyebrow")
    np.testing.assert_allclose(
        both[1, brows], fba.emotion.combine({"fear": 60, "joy": 30}).faps[brows], atol=1
    )


def test_keys_are_followed() -> None:
    source = performance([{31: 0}] * 51)
    curve = MoodCurve("anger", np.array([0.0, 1.0, 2.0]), np.array([0.0, 100.0, 40.0]))
    brow = resolve(emote(source, [curve]).face)[:, 30] / expression("anger").faps[30]  # type: ignore[arg-type]
    np.testing.assert_allclose(brow[[0, 25, 50]], [0, 1, 0.4], atol=0.01)
    assert (np.diff(brow[:26]) >= 0).all()


def test_moods_of_one_name_follow_each_other() -> None:
    source = performance([{31: 0}] * 101)
    moods = [Mood("anger", 50, end=2), Mood("angry", 100, start=2)]
    brow = resolve(emote(source, moods).face)[:, 30] / expression("anger").faps[30]  # type: ignore[arg-type]
    np.testing.assert_allclose(brow[[10, 75, 100]], [0.5, 1, 1], atol=0.01)


def test_bodies_visemes_and_what_is_not_sent_stay() -> None:
    values = np.zeros((2, 296), dtype=np.int32)
    values[1, 20] = 5000
    viseme = np.zeros((2, 4), dtype=np.int16)
    viseme[1] = 10, 0, 63, 0  # a wide open mouth
    mask = np.zeros((2, 68), dtype=np.bool_)
    mask[:, 0] = True
    source = Animation(
        25, np.arange(2), FaceTrack(np.zeros((2, 68), dtype=np.int32), mask, viseme),
        BodyTrack(values, values != 0),
    )  # fmt: skip
    made = emote(source, [Mood("sleepy", 100)])
    np.testing.assert_array_equal(made.body.values, values)  # type: ignore[union-attr]
    shown, moved = resolve(source.face), resolve(made.face)  # type: ignore[arg-type]
    assert not made.face.viseme.any()  # type: ignore[union-attr]
    assert moved[1, 2] == pytest.approx(shown[1, 2], rel=0.2)
    assert shown[1, 2] > 100
    decoded = fba.decode(fba.encode(made))
    error = np.abs(resolve(decoded.face) - moved)  # type: ignore[arg-type]
    assert (error <= np.array([one.step for one in faps()]) / 2).all()
    tongue = columns("raise_tongue")[0]
    assert not emote(performance([{31: 1}]), [Mood("anger", 5)]).face.mask[:, tongue].any()  # type: ignore[union-attr]


@settings(max_examples=60)
@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.tuples(st.sampled_from([one.name for one in expressions()]), st.integers(0, 100)), min_size=1,
             max_size=3, unique_by=lambda pair: pair[0]),
)  # fmt: skip
def test_no_fap_leaves_its_limits(seed: int, moods: list[tuple[str, int]]) -> None:
    random = np.random.default_rng(seed)
    limits = np.array([(f.i_limits or (0, 0)) for f in faps()], dtype=float) * np.array(
        [[f.step] for f in faps()]
    )
    values = random.uniform(limits[:, 0], limits[:, 1], (4, 68)) * random.choice([0.01, 0.3, 1.0])
    mask = np.ones((4, 68), dtype=np.bool_)
    mask[:, :2] = False
    source = Animation(25, np.arange(4), FaceTrack(np.rint(values).astype(np.int32), mask))
    made = emote(source, [Mood(name, share) for name, share in moods])
    moved = resolve(made.face)  # type: ignore[arg-type]
    assert (moved >= limits[:, 0] - 1e-3).all()
    assert (moved <= limits[:, 1] + 1e-3).all()
    before = np.rint(values)[:, UPPER] + np.rint(values)[:, LOWER]
    after = moved[:, UPPER] + moved[:, LOWER]
    assert (after <= np.maximum(before, 1024) + 1).all()


class TestMistakes:
    def test_contradictory_moods(self) -> None:
        source = speech()
        with pytest.raises(OptionError, match="70 and as 30 at the same time"):
            emote(source, [Mood("anger", 70), Mood("angry", 30)])
        with pytest.raises(OptionError, match="keys and another intensity"):
            emote(source, [Mood("anger", 70), MoodCurve("anger", np.array([0.0]), np.array([3.0]))])

    def test_nothing_to_do(self) -> None:
        with pytest.raises(OptionError, match="no mood"):
            emote(speech(), [])
        body = BodyTrack(np.zeros((1, 296), dtype=np.int32), np.ones((1, 296), dtype=np.bool_))
        with pytest.raises(OptionError, match="no face"):
            emote(Animation(25, np.arange(1), None, body), [Mood("anger", 1)])

    @pytest.mark.parametrize(
        ("settings", "said"),
        [
            ({"name": "angre", "intensity": 50}, "anger"),
            ({"name": "anger", "intensity": 101}, "0 to 100, not 101"),
            ({"name": "anger", "intensity": float("nan")}, "0 to 100, not nan"),
            ({"name": "anger", "intensity": 50, "start": 3, "end": 2}, "ends at 2 s, but begins at 3 s"),
            ({"name": "anger", "intensity": 50, "start": float("inf")}, "number of seconds"),
            ({"name": "anger", "intensity": 50, "ease": -1}, "ease must be"),
        ],
    )
    def test_moods_that_make_no_sense(self, settings: dict[str, object], said: str) -> None:
        with pytest.raises(OptionError, match=said):
            Mood(**settings)  # type: ignore[arg-type]

    @pytest.mark.parametrize(
        ("times", "intensities", "said"),
        [
            ([0, 1, 1], [0, 5, 9], "not in increasing order at 1 s"),
            ([1, 0], [0, 5], "not in increasing order"),
            ([0], [120], "0 to 100"),
            ([], [], "at least one"),
            ([0, float("nan")], [1, 2], "must be numbers"),
        ],
    )
    def test_keys_that_make_no_sense(self, times: list[float], intensities: list[float], said: str) -> None:
        with pytest.raises(OptionError, match=said):
            MoodCurve("anger", np.array(times, dtype=float), np.array(intensities, dtype=float))

    @pytest.mark.parametrize("settings", [{"reach": 0.5}, {"speaking": 0}, {"reach": float("nan")}])
    def test_damping(self, settings: dict[str, float]) -> None:
        with pytest.raises(OptionError, match="must be a number"):
            Damping(**settings)
