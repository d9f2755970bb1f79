"""Avatar animation units: bytes of others, streams and containers in and out, and bad ones."""

import json
import struct
import zipfile
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from avatar_files import configuration, container, joints, unit, weights
from fba import FbaWarning, FormatError, LimitError, Limits
from fba.animation import Animation
from fba.capture import SkeletonMotion, make_animation
from fba.carriage.avatar_units import JOINTS, SHAPES, read_units, write_configuration, write_units
from fba.face import arkit_names, resolve
from fba.formats import format_of, read_motion
from fba.parameters import fap_numbers

SAMPLES = Path(__file__).parents[2] / "fba" / "samples"


def saved(folder: Path, data: bytes, name: str = "a.aau") -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def test_units_of_others_are_read(tmp_path: Path) -> None:
    jaw, smile = arkit_names().index("jawOpen"), arkit_names().index("mouthSmileLeft")
    data = configuration(timescale=90_000) + b"".join(
        weights(3000 * frame, {jaw: frame / 10, smile: 0.25}, flags=128 * (frame % 2)) for frame in range(6)
    )
    path = saved(tmp_path, data + unit(3, b"landmarks") + unit(77, b""), "face.aau")
    assert format_of(path).name == "arf"
    with pytest.warns(FbaWarning, match="ARKit's order|of type 3, 1 of type 77|shapes") as said:
        animation = fba.read(path)
    assert "1 of type 3, 1 of type 77" in str(said[0].message)
    assert (animation.rate, len(animation)) == (30, 6)
    assert (np.diff(animation.face.values[:, fap_numbers()["open_jaw"] - 1]) > 0).all()


def test_streams_come_back(tmp_path: Path) -> None:
    """Faces as far as ARKit's shapes go, head and eyes and bodies exactly, times exactly."""
    body = fba.read(SAMPLES / "hello.bvh").resample(25)
    face = fba.read(SAMPLES / "hello.fap")
    both = fba.formats.merge(face, body)
    for source in (face, body, both):
        kept = Animation(Fraction(30_000, 1001), source.index[1:] * 1, source[1:].face, source[1:].body)
        fba.write(tmp_path / "a.aau", kept)
        with pytest.warns(FbaWarning) if source.face is not None else nullcontext():  # its eyes turn far
            back = fba.read(tmp_path / "a.aau")
        assert back.rate == kept.rate
        assert len(back) == len(kept)
        if kept.body is not None:
            assert np.abs(back.body.values - kept.body.values).max() <= 1
        if kept.face is not None:
            assert back.face is not None
            apart = np.abs(resolve(back.face) - resolve(kept.face)).max(axis=0)
            turns = [fap_numbers()[name] - 1 for name in ("head_pitch", "head_yaw", "head_roll")]
            assert apart[turns].max() <= 1
            assert apart[fap_numbers()["open_jaw"] - 1] < 30


def test_skipped_frames_have_no_units(tmp_path: Path) -> None:
    face = fba.read(SAMPLES / "hello.fap")
    kept = Animation(face.rate, np.array([0, 1, 2, 6, 7, 8]), face.face[:6])
    fba.write(tmp_path / "a.aau", kept)
    assert read_units((tmp_path / "a.aau").read_bytes()).shapes.times.tolist() == [
        0,
        0.04,
        0.08,
        0.24,
        0.28,
        0.32,
    ]  # type: ignore[union-attr]
    with pytest.warns(FbaWarning, match="frames are missing"):
        assert fba.read(tmp_path / "a.aau").index.tolist() == list(range(9))


@pytest.fixture(scope="module")
def walk() -> SkeletonMotion:
    return read_motion(SAMPLES / "hello.bvh").select(slice(0, 60))


@pytest.mark.parametrize("bind", [True, False])
def test_containers_of_others_are_read(tmp_path: Path, walk: SkeletonMotion, bind: bool) -> None:
    path = container(tmp_path / "a.arfz", walk, seed=3, bind=bind, faces=True)
    assert format_of(path).name == "arf"
    animation = fba.read(path)
    wanted = make_animation(walk, path=path).animation
    assert animation.rate == walk.rate
    assert np.abs(animation.body.values - wanted.body.values).max() < 50  # 5e-4 rad, or mm
    assert (
        animation.face.values[-1, fap_numbers()["open_jaw"] - 1]
        > animation.face.values[1, fap_numbers()["open_jaw"] - 1]
    )
    assert animation.face.values[5, fap_numbers()["stretch_l_cornerlip"] - 1] > 0


def test_joints_of_further_trees_are_left_out(tmp_path: Path) -> None:
    """A prop among the joints, whose numbers come before those of the skeleton."""
    names, parents = ("hat", "hips", "brim", "knee", "ankle"), (None, None, 0, 1, 3)
    placed = np.tile(np.eye(4), (5, 1, 1))
    placed[:, 1, 3] = (9.0, 1.0, 0.5, -0.4, -0.3)
    nodes = [
        {"id": number, "name": name, "translation": placed[number, :3, 3].tolist()}
        | ({} if parents[number] is None else {"parent": parents[number]})
        for number, name in enumerate(names)
    ]
    skeletons = [{"id": 0, "joints": list(range(5))}]
    document = {"preamble": {"signature": "ARF"}, "components": {"nodes": nodes, "skeletons": skeletons}}
    path = tmp_path / "a.arfz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("arf.json", json.dumps(document))
        stream = configuration("arf-body-v1") + b"".join(joints(frame, placed) for frame in range(3))
        archive.writestr("animations/joints.bin", stream)
    motion = read_motion(path)
    assert (motion.names, motion.parents.tolist()) == (("hips", "knee", "ankle"), [-1, 0, 1])
    assert motion.world()[1][2, :, 1] == pytest.approx([1.0, 0.6, 0.3], abs=1e-6)


def test_many_joints_that_no_unit_mentions_do_not_fill_the_memory(
    tmp_path: Path, walk: SkeletonMotion
) -> None:
    def with_crowd(document: Any) -> None:
        crowd = [{"id": 1000 + number, "name": f"j{number}", "parent": 0} for number in range(60_000)]
        document["components"]["nodes"] += crowd
        document["components"]["skeletons"][0]["joints"] += [node["id"] for node in crowd]

    with pytest.raises(LimitError, match="bytes of memory"):
        fba.read(container(tmp_path / "a.arfz", walk, seed=1, bind=False, change=with_crowd))


GOOD = configuration() + weights(0, {0: 0.5}) + weights(1, {0: 0.5})
BODY = configuration("arf-body-v1") + joints(0, np.eye(4)[None])


@pytest.mark.parametrize(
    ("data", "finding"),
    [
        (configuration(), "neither weights of shapes nor joints"),
        (GOOD[:-1], "unit 2, byte 45: has 15 bytes; expected 4 to 14"),
        (GOOD[:50], "unit 2, byte 45: the stream ends in the head"),
        (configuration() + weights(0, {0: 0.5})[:-4] + b"\x7f\xc0\0\0", "not finite"),
        (configuration() + unit(1, b"\0\0\0"), "ends before its list"),
        (configuration() + unit(1, struct.pack(">HBH", 0, 0, 65535)), "lists 65536 entries, but"),
        (GOOD + weights(1, {0: 0.5}), "not later than the one before it"),
        (configuration(timescale=0), "0 ticks per second"),
        (configuration(timescale=float("nan")), "ticks per second"),
        (configuration() + unit(0, b"\x09a\0\0\0\0"), "a configuration of"),
        (configuration() + weights(0, {0: 7.5}), "has the weight 7.5"),
        (configuration() + weights(0, {60: 0.5}), "has 61 shapes without names; ARKit has 52"),
        (BODY, "joints have numbers only"),
        (configuration("mpeg4-body") + joints(0, np.zeros((1, 4, 4))), "flat or mirrored"),
        (configuration("mpeg4-body") + joints(0, np.full((1, 4, 4), 1e30)), "too large"),
        (configuration("mpeg4-body") + joints(0, np.tile(np.eye(4), (99, 1, 1))), "moves joint 98; the"),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_bad_streams(tmp_path: Path, data: bytes, finding: str) -> None:
    with pytest.raises(FormatError, match=finding) as error:
        fba.read(saved(tmp_path, data))
    assert "a.aau" in str(error.value)


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_a_few_bytes_do_not_fill_the_memory(tmp_path: Path) -> None:
    data = configuration() + b"".join(weights(frame, {65535: 0.5}) for frame in range(3000))
    with pytest.raises(LimitError, match="bytes of memory"):
        fba.read(saved(tmp_path, data))
    far = b"".join(weights(second, {0: 1.0}) for second in (1, 2, 3, 4, 900_000))
    with pytest.raises(LimitError, match="lasts"):
        fba.read(saved(tmp_path, configuration(timescale=1.0) + far))
    with pytest.raises(LimitError, match="frames"):
        fba.read(saved(tmp_path, GOOD), limits=Limits(frames=1))


@pytest.mark.parametrize(
    ("change", "finding"),
    [
        (lambda document: document.pop("preamble"), "not laid out"),
        (lambda document: document["preamble"].update(signature="X"), "expected 'ARF'"),
        (lambda document: document["components"]["nodes"][3].update(parent=3), "in a circle"),
        (lambda document: document["components"]["skeletons"][0]["joints"].append(0), "lists a joint twice"),
        (lambda document: document["components"]["skeletons"][0]["joints"].pop(), "moves joint|no tensor"),
        (lambda document: document["data"][0].update(uri="nothing"), "not laid out"),
        (lambda document: document["data"][0].update(uri="arf.json"), "not laid out|no tensor"),
        (lambda document: document["data"][0].update(uri="animations/joints.bin"), "no tensor"),
        (lambda document: document["components"].update(nodes=[]), "not laid out"),
        (lambda document: document["components"]["blendshapeSets"][0].update(shapes=[1, 1]), "several"),
    ],
)  # fmt: skip
def test_bad_containers(
    tmp_path: Path, walk: SkeletonMotion, change: Callable[[Any], None], finding: str
) -> None:
    with pytest.raises(FormatError, match=finding):
        fba.read(container(tmp_path / "a.arfz", walk.select(slice(0, 3)), seed=1, faces=True, change=change))


@pytest.mark.parametrize(
    ("members", "finding"),
    [
        ({"a.txt": "x"}, "without arf.json"),
        ({"arf.json": "{"}, "no complete JSON"),
        ({"arf.json": "[" * 100_000}, "no complete JSON"),
        ({"arf.json": "[]"}, "not laid out"),
    ],
)
def test_other_archives(tmp_path: Path, members: Mapping[str, str], finding: str) -> None:
    path = tmp_path / "a.arfz"
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    with pytest.raises(FormatError, match=finding):
        fba.read(path)


def test_what_cannot_be_written(tmp_path: Path) -> None:
    face = fba.read(SAMPLES / "hello.fap")
    for bad in (face[:0], Animation(face.rate, face.index + (1 << 40), face.face)):
        with pytest.raises(FormatError):
            fba.write(tmp_path / "a.aau", bad)
    assert not list(tmp_path.iterdir())


def test_units_are_those_of_the_layout() -> None:
    """What is written, byte for byte as put together by hand."""
    ticks = np.array([0, 40])
    rows = np.array([[0.25, 0.5], [1.0, 0.0]])
    assert write_configuration("arf-face-v1", 30.0) == configuration()
    assert write_units(SHAPES, ticks, rows) == [weights(0, {0: 0.25, 1: 0.5}), weights(40, {0: 1.0, 1: 0.0})]
    turned = np.stack([np.eye(4), 2 * np.eye(4)])
    assert write_units(JOINTS, ticks[1:], turned[None]) == [joints(40, turned)]
