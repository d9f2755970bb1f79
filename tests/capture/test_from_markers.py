"""Markers on faces whose FAPs are known: these come back, from other heads and from damaged captures."""

from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from fba.capture import MarkerMotion, from_markers
from fba.capture.markers import _stabilisation as stabilisation
from fba.capture.markers._eyes import opening_by_blinks
from fba.capture.markers._faces import MarkerFace, find_face
from fba.capture.markers._gaps import fill_gaps
from fba.capture.markers._solving import JAW_VALUES, jaw_curves
from fba.capture.markers._targets import RIGID
from fba.capture.markers.marker_maps import change_map, find_map, marker_sets, read_map, summarise, write_map
from fba.errors import FbaWarning, FormatError, ModelError, OptionError
from fba.face import Deformer, FaceModel
from fba.face.authoring import author
from fba.limits import Limits
from fba.parameters import faps, point_rows
from small_head import adult_points, authored_head, small_head
from tools.captures.marked_actor import NAMES, Take, perform

TURNED = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""To axes with z up and the actor looking along x."""
PER_MILLE = 1024 / 1000
EXACT = {18: 30}
"""Thousandths of FAPU, root mean square, where the lower lip carries the skin of a coarse mask too far."""


def actor() -> FaceModel:
    """Another head than the built-in one, by whose motions the encoder tells FAPs apart."""
    return authored_head(0.005)


@cache
def take() -> Take:
    return perform(actor(), 500)


def errors(face: MarkerFace, truth: Take) -> dict[int, float]:
    """Root mean square error of each FAP that is sent, thousandths of its FAPU; of angles, in degrees."""
    off = face.faps - truth.faps
    result = {}
    for fap in face.sent:
        error = float(np.sqrt((off[:, fap - 1] ** 2).mean()))
        result[fap] = np.degrees(error * 1e-5) if faps()[fap - 1].unit == "AU" else error / PER_MILLE
    return result


def check(face: MarkerFace, truth: Take, most: float, most_degrees: float = 0.3) -> None:
    worse = {
        fap: round(error, 3)
        for fap, error in errors(face, truth).items()
        if error > (most_degrees if fap in (48, 49, 50) else max(most, EXACT.get(fap, 0)))
    }
    assert not worse


def with_positions(change: np.ndarray) -> MarkerMotion:
    return replace(take().motion, positions=change)


def test_faps_of_another_head_come_back() -> None:
    face = find_face(take().motion)
    check(face, take(), 20)
    assert face.found_by == "regions50"
    assert {3, 14, 16, 17, 18, 31, 37, 39, 41, 51, 59, 61, 63} <= set(face.sent)
    assert not {23, 25, 29, 43, 65} & set(face.sent)  # nothing is made up
    np.testing.assert_allclose(face.path, take().path, atol=1e-3)


def test_with_noise() -> None:
    noise = np.random.default_rng(1).normal(0, 0.3e-3, take().motion.positions.shape)
    face = find_face(with_positions(take().motion.positions + noise))
    check(face, take(), 50)


def test_the_jaw_goes_back_as_far_as_the_actors() -> None:
    """From where chin and ears are, against the motion of two heads whose chins go back by 1.2 and 1.5."""
    for head in (actor(), FaceModel.default()):
        moved = Deformer(head).feature_points(np.eye(68)[2] * 1000, local=True)
        found = jaw_curves(head.points, head.fapu)
        assert len(found) == 4
        for row, shifts in found.items():
            shown = (moved[row] - head.points[row]) / head.fapu.MNS
            np.testing.assert_allclose(shifts[JAW_VALUES == 1000][0], shown, atol=10)


def test_a_long_chin() -> None:
    """It is 15 mm lower below the ears, so it goes back by a third more than that of the built-in head."""
    points, rows = adult_points().copy(), point_rows()
    for name, share in (("2.1", 1), ("2.10", 0.6), ("2.11", 1), ("2.12", 1), ("2.13", 0.5), ("2.14", 0.5)):
        points[rows[name], 1] -= 0.015 * share
    head = small_head(points, cell=0.005)
    talk = perform(author(head.parts, head.points, bound=head.bound), 300)
    worse = {fap: error for fap, error in errors(find_face(talk.motion), talk).items() if error > 20}
    assert not worse


def lid(times: np.ndarray, blinks: dict[float, float], length: float = 0.2) -> np.ndarray:
    """Metres (T,) that a lid is lowered: second -> depth of each blink."""
    sunk = np.zeros(len(times))
    for second, depth in blinks.items():
        sunk += depth * np.exp(-(((times - second) / (0.6 * length)) ** 2))
    return sunk


def test_blinks_show_how_far_eyes_are_open() -> None:
    times = np.arange(1000) / 100
    noise = np.random.default_rng(4).normal(0, 0.3e-3, (1000, 2))
    half_way = lid(times, {1.0: 0.009, 3.0: 0.006, 5.0: 0.009, 8.0: 0.009})
    both = np.stack([half_way, half_way], axis=1)
    assert opening_by_blinks(both + noise, times, 0.0117) == pytest.approx(0.0095, rel=0.05)
    assert opening_by_blinks(both, times, 0.006) == pytest.approx(0.0078)  # no eye is as wide as that
    squint = lid(times, {4.0: 0.004, 7.0: 0.003})[:, None]
    asleep = lid(times, {5.0: 0.008}, 2.0)[:, None]
    assert opening_by_blinks(squint, times, 0.0117) is None
    assert opening_by_blinks(asleep, times, 0.0117) is None
    assert opening_by_blinks(noise[:2], times[:2], 0.0117) is None


def test_eyes_without_blinks_are_open_as_usual() -> None:
    still = take().faps[:, 18] < 10
    whole = take().motion
    motion = replace(whole, positions=whole.positions[still], times=whole.times[still])
    opening, usual = (1024 * find_face(one).fapu.IRISD for one in (whole, motion))
    assert opening == pytest.approx(1024 * actor().fapu.IRISD, rel=0.08)
    assert usual == pytest.approx((0.0117 + 0.0108) / 2, abs=4e-4)


def test_a_stream_of_another_rate_lasts_as_long() -> None:
    motion = take().motion
    animation = from_markers(motion, 25)
    assert len(animation) == 125
    assert float(animation.duration) == pytest.approx(motion.duration)
    shown = animation.face.values[:, 50]
    np.testing.assert_allclose(shown, take().faps[::4, 50], atol=30)
    assert set(np.flatnonzero(animation.body.mask.any(axis=0)) + 1) == {181, 182, 183}
    up = animation.body.values[:, 180]
    np.testing.assert_allclose(up, 1000 * take().path[::4, 1], atol=2)
    assert from_markers(motion, head_path=False).body is None


def test_times_of_the_capture_count_not_its_rows() -> None:
    kept = np.r_[0:200, 250:500]
    motion = take().motion
    partly = replace(motion, positions=motion.positions[kept], times=motion.times[kept])
    animation = from_markers(partly, 25, head_path=False)
    assert len(animation) == 125
    np.testing.assert_allclose(animation.face.values[70:, 50], take().faps[280::4, 50], atol=30)


def test_other_axes_and_units() -> None:
    positions = 1000 * (take().motion.positions @ TURNED.T) + (1200, -300, 1650)
    with pytest.warns(FbaWarning, match="the face would be 97. times as large.*multiplied by 0.001"):
        face = find_face(with_positions(positions))
    check(face, take(), 20)


def test_a_mirrored_capture() -> None:
    with pytest.warns(FbaWarning, match="the capture is mirrored: x is turned round"):
        face = find_face(with_positions(take().motion.positions * (1, 1, -1)))
    check(face, take(), 20)


@pytest.mark.parametrize(("one", "other"), [("BRR2", "LCL"), ("FHL", "FHR"), ("LPL1", "LPR1")])
def test_swapped_markers(one: str, other: str) -> None:
    positions = take().motion.positions.copy()
    a, b = NAMES.index(one), NAMES.index(other)
    positions[:, [a, b]] = positions[:, [b, a]]
    with pytest.warns(FbaWarning, match=f"{one} and {other} have each other's places: exchanged"):
        face = find_face(with_positions(positions))
    check(face, take(), 20)


def test_markers_that_exchange_names_for_a_while() -> None:
    positions = take().motion.positions.copy()
    a, b, c = (NAMES.index(name) for name in ("LPL1", "LPL2", "LCL"))
    positions[200:350, [a, b]] = positions[200:350, [b, a]]
    positions[400:, [a, c]] = positions[400:, [c, a]]
    message = "LPL1 and LPL2 take each other's names in frame 200, and 2 more times"
    with pytest.warns(FbaWarning, match=message):
        face = find_face(with_positions(positions))
    check(face, take(), 20)


def test_a_marker_that_fell_off() -> None:
    positions = take().motion.positions.copy()
    positions[:, NAMES.index("FHC")] = (0.3, -0.4, 0.2)
    with pytest.warns(FbaWarning, match="far from their places on a face, and left out: FHC"):
        face = find_face(with_positions(positions))
    check(face, take(), 20)


def test_drop_outs() -> None:
    random = np.random.default_rng(5)
    positions = take().motion.positions.copy()
    for marker in range(len(NAMES)):
        for start in random.integers(0, 480, 4):
            positions[start : start + random.integers(3, 15), marker] = np.nan
    positions[60:85] = np.nan  # nothing at all for a quarter of a second
    with pytest.warns(
        FbaWarning, match=r"long gaps are filled by neighbouring markers, the longest 0\.\d\d s"
    ):
        face = find_face(with_positions(positions))
    seen = np.r_[0:55, 90:500]
    part = Take(take().motion, take().faps[seen], take().path[seen])
    check(replace(face, faps=face.faps[seen]), part, 20)
    assert face.filled.short > 100


def test_a_long_gap_follows_its_neighbours_and_meets_both_ends() -> None:
    """By hand: neighbours move 5 mm aside and back, the marker as they do, and ends 1 mm higher."""
    times = np.arange(101) / 100
    positions = np.zeros((101, 4, 3)) + np.array([[0.0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [0.01, 0.01, 0]])
    bump = 0.005 * np.sin(np.pi * times)
    positions[..., 0] += bump[:, None]
    truth = positions[:, 0].copy()
    positions[80:, 0, 1] += 0.001
    positions[20:80, 0] = np.nan
    filled, what = fill_gaps(("A", "B", "C", "D"), positions, times)
    assert (what.short, what.long, what.marker) == (0, 1, "A")
    assert what.longest == pytest.approx(0.61)
    np.testing.assert_allclose(filled[:, 0, 0], truth[:, 0], atol=1e-9)
    np.testing.assert_allclose(filled[19:81, 0, 1], 0.001 * np.arange(62) / 61, atol=1e-9)


def test_a_short_gap_is_a_cubic_through_its_ends() -> None:
    times = np.arange(60) / 100
    positions = np.zeros((60, 1, 3))
    positions[:, 0, 2] = times**2
    truth = positions.copy()
    positions[30:40] = np.nan
    filled, what = fill_gaps(("A",), positions, times)
    assert (what.short, what.long) == (1, 0)
    np.testing.assert_allclose(filled, truth, atol=3e-4)  # a straight line is off by 3e-3


def test_jitter_of_a_fixed_marker_hardly_turns_the_head() -> None:
    positions = take().motion.positions.copy()
    jitter = np.random.default_rng(1).normal(0, 3e-3, (len(positions), 3))
    positions[:, NAMES.index("FHL")] += jitter
    check(find_face(with_positions(positions)), take(), 20, 0.05)


def test_rigid_fit_beats_the_local_frame() -> None:
    """A local frame (left to right, forehead to bridge of the nose, repeated) turns more with noise."""
    positions = take().motion.positions
    noisy = positions + np.random.default_rng(2).normal(0, 0.3e-3, positions.shape)
    places = marker_sets()["regions50"]
    fixed = [n for n, name in enumerate(NAMES) if places[name.lower()] in RIGID]
    truth = np.array([np.linalg.norm(p) for p in take().faps[:, 47:50] * 1e-5])
    rotation, _, _ = stabilisation.fit_poses(noisy[0, fixed], noisy[:, fixed])

    def frame(markers: np.ndarray) -> np.ndarray:
        at = {name: markers[NAMES.index(name)] for name in ("FHL", "FHR", "EAL", "EAR", "FHC", "NSB")}
        x = (at["FHL"] + at["EAL"] - at["FHR"] - at["EAR"]) / 2
        y = at["NSB"] - at["FHC"]
        z = np.cross(x, y)
        x = np.cross(y, z)
        return np.stack([axis / np.linalg.norm(axis) for axis in (x, y, z)])

    first, local = frame(noisy[0]), []
    for markers in noisy:
        turned = frame(markers).T @ first
        for _ in range(2):  # passes over its own output
            turned = turned @ (frame(markers @ turned).T @ first)
        local.append(turned)
    clean, _, _ = stabilisation.fit_poses(positions[0, fixed], positions[:, fixed])
    assert truth.max() > 0.3

    def off(found: np.ndarray) -> float:
        trace = np.einsum("tij,tij->t", found, clean)
        return float(np.sqrt((np.degrees(np.arccos(np.clip((trace - 1) / 2, -1, 1))) ** 2).mean()))

    assert off(rotation) < 0.6 * off(np.array(local))


def test_names_that_say_nothing() -> None:
    order = np.random.default_rng(0).permutation(len(NAMES))
    names = tuple(f"unlabelled {n}" for n in range(len(NAMES)))
    positions = take().motion.positions[:, order] @ TURNED.T + (0.3, 0.2, 1.5)
    motion = MarkerMotion(names, positions, take().motion.times, take().motion.rate)
    places = marker_sets()["regions50"]
    wanted = {names[n]: places[NAMES[m].lower()] for n, m in enumerate(order) if places[NAMES[m].lower()]}
    found, how = find_map(motion)
    assert (how, found) == ("shape", wanted)
    check(find_face(motion), take(), 20)


def test_names_of_feature_points() -> None:
    places = marker_sets()["regions50"]
    rows = [n for n, name in enumerate(NAMES) if places[name.lower()]]
    targets = [places[NAMES[n].lower()] for n in rows]
    names = tuple(f"FDP {target}" if "." in target else target for target in targets)
    motion = take().motion
    points = MarkerMotion(names, motion.positions[:, rows], motion.times, motion.rate)
    assert find_map(points)[1] == "feature points"
    check(find_face(points), take(), 20)


@pytest.mark.parametrize("neutral", [0, "first", (0.0, 0.2), "auto"])
def test_neutral_frames(neutral: str | int | tuple[float, float]) -> None:
    check(find_face(take().motion, neutral=neutral), take(), 20)


def test_the_neutral_face_is_found_at_the_end() -> None:
    turned = Take(with_positions(take().motion.positions[::-1]), take().faps[::-1], take().path[::-1])
    face = find_face(turned.motion)
    assert face.neutral[0] > 450
    check(face, turned, 20)
    assert max(errors(find_face(turned.motion, neutral="first"), turned).values()) > 50


def test_eyes_keep_looking_at_the_camera() -> None:
    animation = from_markers(take().motion, gaze="camera")
    values = animation.face.values
    np.testing.assert_array_equal(values[:, 22], values[:, 23])
    np.testing.assert_allclose(values[:, 22], np.clip(-values[:, 48], -60000, 60000), atol=1)
    np.testing.assert_allclose(values[:, 24], np.clip(-values[:, 47], -60000, 60000), atol=1)


def test_maps_are_changed_by_hand_and_saved(tmp_path: Path) -> None:
    motion = take().motion
    found = change_map(motion, None, {"LCL": "", "CHC": "8.3", "FHM": "head"})
    assert "LCL" not in found
    assert (found["CHC"], found["FHM"]) == ("8.3", "head")
    write_map(tmp_path / "a.toml", found, motion)
    assert read_map(tmp_path / "a.toml") == found
    assert "not used" in (tmp_path / "a.toml").read_text()
    with pytest.raises(OptionError, match=r"no marker 'LCX'.*did you mean"):
        change_map(motion, None, {"LCX": "8.3"})
    with pytest.raises(OptionError, match=r"no place '8\.99'"):
        change_map(motion, None, {"LCL": "8.99"})
    with pytest.raises(OptionError, match=r"no marker can be at feature point 6\.1"):
        change_map(motion, None, {"LCL": "6.1"})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[markers]\nA = 3\n", "'A': there is no place '3'"),
        ("[joints]\nA = 'l_hip'\n", r"no table \[markers\]"),
        ("[markers]\nA = '2.1'\nB = '2.1'\n", "'A' and 'B' are both at 2.1"),
        ("[markers\n", "a.toml:1: is not TOML"),
    ],
)
def test_wrong_maps_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(FormatError, match=message):
        read_map(tmp_path / "a.toml")


def test_captures_without_a_face() -> None:
    motion = take().motion
    three = MarkerMotion(("A", "B", "C"), motion.positions[:, :3], motion.times, motion.rate)
    with pytest.raises(ModelError, match="3 are too few to find a face"):
        find_face(three)
    random = np.random.default_rng(1).uniform(0, 1.7, (1, 40, 3)) + np.zeros((5, 1, 1))
    body = MarkerMotion(tuple(f"m{n}" for n in range(40)), random, np.arange(5) / 100, Fraction(100))
    with pytest.raises(ModelError, match="their shape is not that of a face"):
        find_face(body)
    for spread in (0.0, 1e-38, 1e5):  # as damaged files have
        with pytest.raises(ModelError, match="in no unit of length that a face has"):
            find_face(replace(body, positions=spread * random))
    skin = FaceModel.default().of_kind("skin")[0].vertices
    scalp = skin[(skin[:, 1] > 0.06) & (skin[:, 2] > -0.09)][::7][:60]
    labels = tuple(f"m{n}" for n in range(len(scalp)))
    cap = MarkerMotion(labels, scalp[None].repeat(2, axis=0), np.arange(2), Fraction(1))
    with pytest.raises(ModelError, match=r"not that of a face: only \d+ of 60"):
        find_face(cap)
    flat = {name: place for name, place in find_map(motion)[0].items() if place not in RIGID}
    with pytest.raises(ModelError, match=r"needs three markers that the face does not move.*the map has 0"):
        find_face(motion, markers=flat)
    with pytest.raises(ModelError, match=r"\d+ markers have a place on the face, but 6"):
        find_face(motion, markers={"FHL": "11.3", "FHR": "11.2", "NSB": "9.12"})
    with pytest.raises(ModelError, match="time runs backwards: frame 3"):
        replace(motion, times=np.r_[0.0, 0.1, 0.2, 0.15, np.arange(4, 500)])


def test_wrong_markers_are_refused() -> None:
    positions, times = np.zeros((2, 2, 3)), np.arange(2.0)
    for names, where, when, rate, message in (
        (("A",), positions, times, 1, r"1 names need positions \(T, 1, 3\) and times \(T,\)"),
        ((), positions[:, :0], times, 1, "a capture needs 1 to "),
        (("A", "A"), positions, times, 1, "two markers are called 'A'"),
        (("A", "B"), positions, times, 0, "the frame rate must be positive, not 0"),
        (("A", "B"), positions, np.array([0.0, np.nan]), 1, "the time of frame 1 is not a number"),
    ):
        with pytest.raises(ModelError, match=message):
            MarkerMotion(names, where, when, Fraction(rate))


def test_what_a_capture_holds() -> None:
    positions = take().motion.positions[:60].copy()
    positions[10:20, 3] = positions[30, 3] = positions[40:42, 5] = np.nan
    motion = replace(take().motion, positions=positions, times=take().motion.times[:60], unit="mm", up="z")
    held = summarise(motion)
    assert [held[key] for key in ("frames", "rate", "unit", "up")] == [60, "100", "mm", "z"]
    assert (held["gaps"], held["longest_marker"]) == (3, motion.names[3])
    assert held["longest"] == pytest.approx(0.1)
    assert held["missing"] == pytest.approx(13 / (60 * len(motion.names)))
    assert (held["map"], held["placed"]) == ("regions50", 34)
    few = summarise(MarkerMotion(("A", "B"), motion.positions[:, :2], motion.times, motion.rate))
    assert (few["map"], few["placed"], few["gaps"]) == ("", 0, 0)


def test_options_that_are_wrong() -> None:
    motion = take().motion
    with pytest.raises(OptionError, match="there is no frame 900"):
        from_markers(motion, neutral=900)
    with pytest.raises(OptionError, match="no frames between 8 and 9 s"):
        from_markers(motion, neutral=(8.0, 9.0))
    with pytest.raises(OptionError, match="gaze must be one of"):
        from_markers(motion, gaze="left")
    with pytest.raises(OptionError, match="has no marker Nose"):
        from_markers(motion, markers={"Nose": "9.3"})
    with pytest.raises(OptionError, match=r"both at 8\.3"):
        from_markers(motion, markers={"LCL": "8.3", "LCR": "8.3"})


def test_limits() -> None:
    from fba.errors import LimitError

    with pytest.raises(LimitError):
        from_markers(take().motion, 10_000, limits=Limits(frames=10_000))
