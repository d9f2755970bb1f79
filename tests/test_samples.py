"""The sample performance that comes with fba: reproducible, within the standard's limits, and believable."""

import subprocess
import sys
import wave
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import fba
from fba.body import BapSolver
from fba.codec import EncoderOptions
from fba.face import resolve
from fba.formats import merge
from fba.formats.bvh._reader import read_motion
from fba.parameters import bap_numbers, baps, fap_numbers, faps
from tools.captures.measurement import root_mean_squares
from tools.captures.performances import perform_track

ROOT = Path(__file__).parents[1]
SAMPLES = Path(fba.__file__).parent / "samples"
SCRIPT = ROOT / "tools" / "make_samples.py"
BAP_STEPS = "visage"


@cache
def performance() -> fba.Animation:
    face = fba.read(SAMPLES / "hello.fap")
    return merge(face, fba.read(SAMPLES / "hello.bvh").resample(face.rate))


@cache
def stream() -> bytes:
    return fba.encode(performance(), EncoderOptions(bap_steps=BAP_STEPS))


@cache
def decoded() -> fba.Animation:
    return fba.decode(stream(), bap_steps=BAP_STEPS)


@cache
def joints() -> dict[str, npt.NDArray[np.float64]]:
    """Joint -> places (T, 3) in metres, of what a receiver shows."""
    body = decoded().body
    solver = BapSolver()
    matrices = solver.pose(body.values)
    return {name: matrices[:, number, :3, 3] for number, name in enumerate(solver.skeleton.names)}


@cache
def shown() -> npt.NDArray[np.float32]:
    face = decoded().face
    assert face is not None
    return resolve(face)


def fap(name: str) -> npt.NDArray[np.float32]:
    return shown()[:, fap_numbers()[name] - 1]


def test_script_makes_the_same_bytes(tmp_path: Path) -> None:
    if not SCRIPT.is_file():
        pytest.skip("the examples are not beside the tests; they come with a checkout")
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    for name in ("hello.bvh", "hello.fap"):
        assert (tmp_path / name).read_bytes() == (SAMPLES / name).read_bytes(), name


def test_files_are_small() -> None:
    assert (SAMPLES / "hello.bvh").stat().st_size <= 600_000
    assert (SAMPLES / "hello.fap").stat().st_size <= 150_000
    assert (SAMPLES / "hello.wav").stat().st_size <= 200_000


def test_markers_say_what_the_face_says() -> None:
    """From a rest on, but for what they cannot tell: the inner lips, whose corners the outer ones follow."""
    talk = fba.read(SAMPLES / "talk.c3d", neutral="first")
    performed = perform_track(fba.read(SAMPLES / "hello.fap"), 50)[: len(talk)]
    assert len(talk) == 300
    told = tuple(fap for fap in (3, 14, *range(16, 21), *range(31, 43), *range(51, 65)))
    assert talk.face.mask[0, np.array(told) - 1].all()
    errors = root_mean_squares(talk.face.values.astype(float), performed, told)
    assert {fap: error for fap, error in errors.items() if error > (4 if fap in (59, 60) else 2.5)} == {}
    assert np.ptp(talk.face.values[:, 47:50], axis=0).min() > 10_000  # the head moves
    assert (SAMPLES / "talk.c3d").stat().st_size <= 150_000


def test_face_and_body_last_equally_long() -> None:
    face, body = fba.read(SAMPLES / "hello.fap"), fba.read(SAMPLES / "hello.bvh")
    assert 8 <= face.duration <= 10
    assert face.duration == body.duration


def test_capture_is_of_human_size() -> None:
    motion = read_motion(SAMPLES / "hello.bvh")
    rest = motion.rest()
    ends = rest[motion.end_parents] + motion.end_offsets
    height = max(rest[:, 1].max(), ends[:, 1].max()) - min(rest[:, 1].min(), ends[:, 1].min())
    assert 165 <= height <= 185  # centimetres


def test_values_are_within_the_standards_ranges() -> None:
    animation = performance()
    assert animation.face is not None
    assert animation.body is not None
    limits: list[tuple[str, fba.FaceTrack | fba.BodyTrack, int, int, tuple[int, int] | None]]
    limits = [(f.label, animation.face, f.number, f.step, f.i_limits) for f in faps()]
    limits += [(b.label, animation.body, b.number, b.step_visage, b.i_limits) for b in baps()]
    checked = 0
    for label, track, number, step, ends in limits:
        values = track.values[track.mask[:, number - 1], number - 1]
        if len(values) and ends is not None:
            assert ends[0] * step <= values.min(), label
            assert values.max() <= ends[1] * step, label
            checked += 1
    assert checked > 120


def test_bit_rate() -> None:
    seconds = float(performance().duration)
    assert 8 * len(stream()) / seconds < 15_000


def test_decoded_close_to_the_capture() -> None:
    before, after = performance().body, decoded().body
    turns = [b.number - 1 for b in baps() if b.unit != "mm" and before.mask[0, b.number - 1]]
    assert np.abs(after.values - before.values)[:, turns].max() < 400  # 1e-5 rad: a quarter of a degree


@pytest.mark.parametrize("joint", ["l_ankle", "r_ankle", "l_metatarsal", "r_metatarsal"])
def test_feet_stand(joint: str) -> None:
    places = joints()[joint]
    assert np.linalg.norm(places - np.median(places, axis=0), axis=1).max() < 0.01


def test_knees_never_bend_backward() -> None:
    body = decoded().body
    for side in "lr":
        assert body.values[:, bap_numbers()[f"{side}_knee_flexion"] - 1].max() < 0


def test_right_hand_waves_above_the_shoulder() -> None:
    wrist, shoulder = joints()["r_wrist"], joints()["r_shoulder"]
    rate = float(performance().rate)
    waving = slice(round(1.8 * rate), round(2.9 * rate))
    assert (wrist - shoulder)[waving, 1].min() > 0.02
    sideways = joints()["r_middle1"][waving, 0] - wrist[waving, 0]
    turns = np.sign(np.diff(sideways))
    assert np.count_nonzero(np.diff(turns)) >= 3  # to and fro, twice at least
    assert joints()["l_wrist"][waving, 1].max() < 1.0  # the other one hangs


def test_ends_as_it_begins() -> None:
    for name, places in joints().items():
        assert np.linalg.norm(places[-1] - places[0]) < 0.02, name


def test_moves_without_jumps() -> None:
    rate = float(performance().rate)
    for name in ("skullbase", "l_wrist", "r_wrist", "HumanoidRoot"):
        speed = np.linalg.norm(np.diff(joints()[name], axis=0), axis=1) * rate
        assert speed.max() < 2.5, name  # metres a second
        change = np.linalg.norm(np.diff(joints()[name], n=2, axis=0), axis=1) * rate**2
        assert change.max() < 30, name  # metres a second squared


def test_blinks_close_the_eyes() -> None:
    for side in "lr":
        closed = fap(f"close_t_{side}_eyelid") + fap(f"close_b_{side}_eyelid")
        shut = closed >= 1024  # the height of an eye's opening is 1024 of its units
        blinks = np.count_nonzero(np.diff(shut.astype(int)) == 1)
        assert 5 <= blinks <= 12
        assert shut.mean() < 0.15


def test_lips_meet_for_m_and_open_for_a_vowel() -> None:
    rate = float(performance().rate)
    opening = -fap("raise_b_midlip") - fap("lower_t_midlip")
    assert opening[round(4.18 * rate)] < 30  # "me"
    assert opening[round(3.92 * rate)] > 200  # "all"
    assert fap("open_jaw").max() > 150


def test_mouth_moves_while_its_voice_is_heard() -> None:
    with wave.open(str(SAMPLES / "hello.wav")) as file:
        samples = np.frombuffer(file.readframes(file.getnframes()), dtype="<i2").astype(float)
        rate = file.getframerate()
    loud = (
        np.abs(samples[: len(samples) // (rate // 25) * (rate // 25)].reshape(-1, rate // 25)).max(axis=1)
        > 1000
    )
    heard = np.zeros(len(shown()), dtype=bool)
    heard[: len(loud)] = loud
    jaw = fap("open_jaw")
    assert jaw[heard].mean() > 3 * jaw[~heard].mean()


def test_looks_at_us_while_waving() -> None:
    """The default camera stands 25 degrees to the performer's left; body, head and eyes turn there."""
    rate = float(performance().rate)
    at = round(2.0 * rate)
    body = decoded().body
    model = fba.face.FeaturePointFace()
    turn = BapSolver().pose(body.values[at])[list(BapSolver().skeleton.names).index("skullbase"), :3, :3]
    turn = turn @ model.head_rotation(shown()[at])
    for side in "lr":
        yaw, pitch = (fap(f"{way}_{side}_eyeball")[at] * 1e-5 for way in ("yaw", "pitch"))
        gaze = turn @ [np.sin(yaw) * np.cos(pitch), -np.sin(pitch), np.cos(yaw) * np.cos(pitch)]
        assert np.degrees(np.arctan2(gaze[0], gaze[2])) == pytest.approx(25, abs=3)
        assert np.degrees(np.arcsin(gaze[1])) == pytest.approx(0, abs=4)
