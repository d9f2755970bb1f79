"""BVH written: what other programs rely on, and that reading it gives the same performance."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fba
from fba.animation import Animation, BodyTrack, FaceTrack
from fba.body import BapSolver, Skeleton
from fba.errors import FormatError, OptionError
from fba.formats.bvh import _reader as reader
from fba.parameters import BAP_COUNT, bap_numbers, baps


def body(values: np.ndarray, rate: Fraction | int = 30, index: np.ndarray | None = None) -> Animation:
    rows = np.asarray(values, dtype=np.int32)
    track = BodyTrack(rows, np.ones(rows.shape, dtype=bool))
    return Animation(Fraction(rate), np.arange(len(rows)) if index is None else index, None, track)


def swaying(frames: int = 40) -> np.ndarray:
    """(T, 296): every BAP of a joint swings smoothly within +-0.7 rad, the root walks."""
    rng = np.random.default_rng(4)
    values = np.zeros((frames, BAP_COUNT))
    time = np.arange(frames)[:, None] / 30
    used = [b.number - 1 for b in baps() if b.joint and b.unit == "1e-5 rad"]
    size, speed, phase = (
        rng.uniform(0, 0.7e5, len(used)),
        rng.uniform(1, 4, len(used)),
        rng.uniform(0, 6, len(used)),
    )
    values[:, used] = size * np.sin(speed * time + phase)
    for number, size in ((181, 30.0), (182, 40.0), (183, 900.0)):
        values[:, number - 1] = size * time[:, 0]
    return np.rint(values).astype(np.int32)


@pytest.mark.parametrize("joints", ["all", "moving"])
def test_the_same_baps_come_back(tmp_path: Path, joints: str) -> None:
    animation = body(swaying())
    fba.write(tmp_path / "a.bvh", animation, joints=joints)
    back = fba.read(tmp_path / "a.bvh")
    assert (back.rate, len(back)) == (30, 40)
    solver = BapSolver()
    np.testing.assert_allclose(solver.pose(back.body.values), solver.pose(animation.body.values), atol=3e-5)
    sent = back.body.mask.all(axis=0)
    assert not animation.body.values[:, ~sent].any()
    assert np.abs(back.body.values[:, sent] - animation.body.values[:, sent]).max() <= 2


def test_real_files_come_back(shared: Path, tmp_path: Path) -> None:
    for name in ("hi.bap", "clap.bap", "show.bap", "cmu_walk.bvh"):
        animation = fba.read(shared / "data" / "vreng" / name)
        fba.write(tmp_path / "a.bvh", animation)
        back = fba.read(tmp_path / "a.bvh")
        shown = np.zeros(BAP_COUNT)
        held = []
        for frame in range(int(animation.index[0]), int(animation.index[-1]) + 1):
            at = np.flatnonzero(animation.index == frame)
            assert len(at) == 1, "these files have no gaps"
            shown = np.where(animation.body.mask[at[0]], animation.body.values[at[0]], shown)
            held.append(shown)
        solver = BapSolver()
        there, here = solver.pose(np.array(held)), solver.pose(back.body.values)
        assert np.abs(there[..., :3, 3] - here[..., :3, 3]).max() < 1e-4  # metres
        assert np.abs(there - here)[..., :3, :3].max() < 1e-4


def test_joints_channels_and_numbers(tmp_path: Path) -> None:
    """The file itself, read by what the format says: the first frame of a bent left arm."""
    values = np.zeros((2, BAP_COUNT), dtype=np.int32)
    values[:, bap_numbers()["l_elbow_flexion"] - 1] = 157080
    values[:, bap_numbers()["HumanoidRoot_tr_vertical"] - 1] = 250
    fba.write(tmp_path / "a.bvh", body(values, Fraction(30000, 1001)))
    lines = (tmp_path / "a.bvh").read_text().splitlines()
    assert lines[:4] == ["HIERARCHY", "ROOT HumanoidRoot", "{", "  OFFSET 0 0 0"]
    assert lines[4].startswith("  CHANNELS 6 Xposition Yposition Zposition ")
    assert sum(line.split()[0] in ("ROOT", "JOINT") for line in lines if line.strip()) == 87
    at = lines.index("MOTION")
    assert lines[at + 1] == "Frames: 2"
    assert float(lines[at + 2].split()[-1]) == pytest.approx(1001 / 30000, rel=1e-11)
    assert len(lines[at + 3].split()) == 87 * 3 + 3
    motion = reader.read_motion(tmp_path / "a.bvh")
    assert motion.rate == Fraction(30000, 1001)
    assert motion.positions[0] == pytest.approx([0, 97.23 + 25, -7.28])
    places = motion.world()[1]
    wrist, elbow = (places[0, motion.names.index(n)] for n in ("l_wrist", "l_elbow"))
    forearm = (wrist - elbow) / np.linalg.norm(wrist - elbow)
    assert forearm == pytest.approx([0, 0, 1], abs=0.06)  # forward: a right angle at the elbow


def test_only_joints_that_move(tmp_path: Path) -> None:
    values = np.zeros((3, BAP_COUNT), dtype=np.int32)
    values[:, bap_numbers()["l_index1_flexion"] - 1] = 20000
    fba.write(tmp_path / "a.bvh", body(values), joints="moving")
    names = reader.read_motion(tmp_path / "a.bvh").names
    assert "l_index1" in names
    assert not {"r_index1", "vl3"} & set(names)
    assert {"l_hip", "r_knee", "l_shoulder", "skullbase"} <= set(names)


def test_another_skeleton_gives_the_same_turns(tmp_path: Path) -> None:
    """BAPs fit any body: a taller one's file gives the same angles, its walk sized to the default's legs."""
    plain = Skeleton.default()
    tall = Skeleton(plain.names, plain.parents, plain.centres * [1.1, 1.2, 1.1])
    values = swaying()
    fba.write(tmp_path / "a.bvh", body(values), skeleton=tall, unit=1.0)
    back = fba.read(tmp_path / "a.bvh").body
    turning = [b.number - 1 for b in baps() if b.joint and b.unit == "1e-5 rad"]
    assert np.abs(back.values[:, turning] - values[:, turning]).max() <= 2
    walked = (back.values[-1] - back.values[0])[182]
    assert walked == pytest.approx((values[-1] - values[0])[182] / 1.2, rel=0.01)  # sized by the legs
    hips = BapSolver().pose(back.values[0])[[plain.number("l_hip"), plain.number("r_hip")], 1, 3].mean()
    theirs = BapSolver(tall).pose(values[0])[[plain.number("l_hip"), plain.number("r_hip")], 1, 3].mean()
    assert hips == pytest.approx(theirs / 1.2, abs=0.01)


def test_gaps_are_filled_and_unsent_values_kept(tmp_path: Path) -> None:
    values = np.zeros((3, BAP_COUNT), dtype=np.int32)
    column = bap_numbers()["r_elbow_flexion"] - 1
    values[0, column], values[2, column] = -30000, -60000
    mask = np.ones(values.shape, dtype=bool)
    mask[1] = False
    animation = Animation(Fraction(25), np.array([10, 11, 15]), None, BodyTrack(values, mask))
    fba.write(tmp_path / "a.bvh", animation)
    back = fba.read(tmp_path / "a.bvh").body
    assert len(back) == 6
    assert back.values[:2, column] == pytest.approx([-30000, -30000], abs=2)
    assert back.values[5, column] == pytest.approx(-60000, abs=2)


def test_a_file_of_another_pose_is_still_retargeted(tmp_path: Path) -> None:
    """The standard's names alone do not make a file the standard's: here it rests with its arms out."""
    plain = Skeleton.default()
    centres = plain.centres.copy()
    for side, turn in (("l", 90), ("r", -90)):
        start = plain.number(f"{side}_shoulder")
        for number in range(start + 1, len(plain)):
            if plain.names[number].startswith(side) and number > start and number < start + 24:
                away = centres[number] - centres[start]
                centres[number] = centres[start] + Rotation.from_euler("z", turn, degrees=True).apply(away)
    fba.write(
        tmp_path / "t.bvh",
        body(np.zeros((2, BAP_COUNT))),
        skeleton=Skeleton(plain.names, plain.parents, centres),
    )
    pose = BapSolver().pose(fba.read(tmp_path / "t.bvh").body.values[0])
    arm = pose[plain.number("l_elbow"), :3, 3] - pose[plain.number("l_shoulder"), :3, 3]
    assert arm[0] / np.linalg.norm(arm) > 0.99  # still out to the left


def test_animations_that_cannot_be_written(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    still = body(np.zeros((1, BAP_COUNT)))
    with pytest.raises(FormatError, match="only a face"):
        fba.write(path, Animation(Fraction(25), np.arange(2), FaceTrack.empty(2)))
    with pytest.raises(FormatError, match="this animation has none"):
        fba.write(path, body(np.zeros((0, BAP_COUNT))))
    with pytest.raises(FormatError, match="more than the 500000"):
        fba.write(path, body(np.zeros((2, BAP_COUNT)), index=np.array([0, 2**61])))
    with pytest.raises(FormatError, match="cannot be written as BVH"):
        fba.write(path, body(np.zeros((2, BAP_COUNT)), rate=20_000))
    with pytest.raises(OptionError, match="joints must be"):
        fba.write(path, still, joints="some")
    with pytest.raises(OptionError, match="unit must be"):
        fba.write(path, still, unit=float("nan"))
    assert not list(tmp_path.iterdir())
