"""Datagrams, text records and JSON of captured faces, written from known weights: they come back.

Captures of faces with numbers or shapes that none can have, as mutated files had them.
"""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.capture import ShapeMotion
from fba.capture.points.picture import fit_poses
from fba.errors import FbaWarning, FormatError, ModelError, UnsupportedError
from fba.formats import format_of
from fba.formats.face_tables import _livelink_csv as tables
from fba.formats.face_tables import _shapes_json as shapes_json
from fba.formats.face_tables import ifacialmocap
from fba.formats.face_tables import livelink_udp as packets
from format_files import saved
from tools.captures.face_files import (
    STEP,
    beat,
    camel,
    datagram,
    face_angles,
    face_weights,
    ifacialmocap_records,
    livelink_csv,
    livelink_udp,
    mediapipe_frames,
)

RECORD = "|".join(
    f"{name}-5" for name in ("eyeBlinkL", "eyeLookOutL", "eyeLookUpL", "jawForward", "mouthClose")
)
ROWS = 40
WEIGHTS = face_weights(ROWS)
COLUMNS = {**WEIGHTS, **face_angles(ROWS)}


def check(motion: ShapeMotion, *, tolerance: float = 1e-6, but: tuple[str, ...] = ()) -> None:
    assert sorted(motion.names) == sorted(camel(name) for name in WEIGHTS if camel(name) not in but)
    for name, expected in WEIGHTS.items():
        if camel(name) not in but:
            found = motion.weights[:, motion.names.index(camel(name))]
            np.testing.assert_allclose(found, expected, atol=tolerance)


@pytest.mark.parametrize("name", ["a.udp", "a.bin", "a"])
def test_datagrams_are_as_the_table_of_the_same_face(tmp_path: Path, name: str) -> None:
    path = saved(tmp_path, b"".join(livelink_udp(COLUMNS)), name)
    assert format_of(path).name == "livelink-udp"
    motion = packets.read_face(path, swap="no")
    check(motion)
    np.testing.assert_allclose(motion.times, np.arange(ROWS) * STEP, atol=1e-4)  # 32-bit parts of frames
    table = tables.read_face(saved(tmp_path, livelink_csv(COLUMNS), "a.csv"), swap="no")
    assert motion.head is not None
    assert motion.eyes is not None
    np.testing.assert_allclose(motion.head, table.head, atol=1e-6)
    np.testing.assert_allclose(motion.eyes, table.eyes, atol=1e-6)


def test_datagrams_without_a_face_out_of_order_doubled_and_cut(tmp_path: Path) -> None:
    sent = livelink_udp(COLUMNS)
    sent[5] = datagram(None, 18_000 + 5 * STEP)
    late = [*sent[:10], sent[11], sent[10], sent[12], sent[12], *sent[13:-1], sent[-1][:-9]]
    motion = packets.read_face(saved(tmp_path, b"".join(late), "a.udp"), swap="no")
    assert len(motion) == ROWS - 1
    assert np.flatnonzero(~motion.seen).tolist() == [5]
    np.testing.assert_allclose(np.diff(motion.times), STEP, atol=1e-4)
    said = "; ".join(motion.findings)
    for text in ("1 datagrams are out of order", "1 datagrams come twice", "the last datagram is incomplete",
                 "1 of 39 rows have no face"):  # fmt: skip
        assert text in said
    kept = motion.weights[motion.seen][:, motion.names.index("jawOpen")]
    np.testing.assert_allclose(kept, np.delete(WEIGHTS["JawOpen"][:-1], 5), atol=1e-6)


def test_datagrams_over_midnight(tmp_path: Path) -> None:
    sent = [datagram([0.1] * 61, (86_399.9 + row / 60) % 86_400) for row in range(20)]
    motion = packets.read_face(saved(tmp_path, b"".join(sent), "a.udp"))
    np.testing.assert_allclose(motion.times, np.arange(20) / 60, atol=2e-4)


def test_a_signalling_nan_is_a_face_that_was_not_seen(tmp_path: Path) -> None:
    sent = livelink_udp(COLUMNS)
    sent[5] = sent[5][:-4] + bytes.fromhex("7f800001")
    motion = packets.read_face(saved(tmp_path, b"".join(sent), "a.udp"))
    assert np.flatnonzero(~motion.seen).tolist() == [5]


def test_two_senders(tmp_path: Path) -> None:
    first, second = livelink_udp(COLUMNS, name="Ann"), livelink_udp(COLUMNS, name="Bo", device="E" * 36)
    mixed = [one for pair in zip(first, second, strict=True) for one in pair]
    path = saved(tmp_path, b"".join(mixed), "a.udp")
    with pytest.raises(FormatError, match=r"has several faces: Ann, Bo; choose one with face='Ann'"):
        fba.read(path)
    check(packets.read_face(path, swap="no", face="Bo"))
    with pytest.raises(FormatError, match=r"has no face 'Cy'; there are Ann, Bo"):
        fba.read(path, face="Cy")


@pytest.mark.parametrize(
    ("data", "error", "said"),
    [
        (b"\x05" + datagram([0.0] * 61, 1.0)[1:], UnsupportedError, "byte 0: .* version 5; only version 6"),
        (struct.pack(">HH", 1, 4) + b"face" + bytes(60), UnsupportedError, "version 1 of the MetaHuman mode"),
        (datagram([0.0] * 61, 1.0) + b"garbage", FormatError, "byte 312: no datagram of Live Link Face"),
        (datagram([0.0] * 61, 1.0)[:100], FormatError, "holds no complete datagram"),
        (
            datagram([0.0] * 61, 1.0).replace(b"\0\0\0\x3c\0\0\0\1", b"\0\0\0\x3c\0\0\0\0"),
            FormatError,
            "60/0 frames/s: no time",
        ),
        (
            datagram([0.0] * 61, 1.0) + datagram([0.0] * 61, 2.0, rate=30),
            FormatError,
            "the rate changes in the recording",
        ),
        (datagram([50.0] * 61, 1.0), FormatError, r"frame 0: eyeBlinkLeft has the weight 50"),
    ],
)
def test_datagrams_that_are_refused(tmp_path: Path, data: bytes, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        fba.read(saved(tmp_path, data, "a.udp"))


def test_the_recorded_capture(shared: Path) -> None:
    path = shared / "data/capture/livelink_capture.udp"
    motion = packets.read_face(path)
    assert (len(motion), int((~motion.seen).sum()), motion.rate) == (567, 7, 60)
    looks = {name: motion.weights[motion.seen][:, motion.names.index(name)] for name in motion.names}
    left = looks["eyeLookOutLeft"] - looks["eyeLookInLeft"]
    assert np.corrcoef(left, motion.eyes[motion.seen][:, 0])[0, 1] > 0.99
    down = looks["eyeLookDownRight"] - looks["eyeLookUpRight"]
    assert np.corrcoef(down, motion.eyes[motion.seen][:, 3])[0, 1] > 0.99


HEAD = np.outer(np.linspace(0, 1, ROWS), [10.0, 20.0, 5.0, 0.01, 0.02, -0.5])
EYES = np.outer(np.linspace(0, 1, ROWS), [4.0, 6.0, 0.0, 3.0, 7.0, 0.0])


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("between", ["\n", "\r\n", "___iFacialMocap", "", "\0"])
def test_records_of_ifacialmocap(tmp_path: Path, version: int, between: str) -> None:
    records = ifacialmocap_records(WEIGHTS, HEAD, EYES, version=version)
    path = saved(tmp_path, between.join(records), "a.txt")
    assert format_of(path).name == "ifacialmocap"
    motion = ifacialmocap.read_face(path, source_rate=30)
    check(motion, tolerance=0.0051)
    assert motion.rate == 30
    assert motion.head is not None
    assert motion.eyes is not None
    np.testing.assert_allclose(np.degrees(motion.head), HEAD[:, :3], atol=1e-5)
    np.testing.assert_allclose(np.degrees(motion.eyes), EYES[:, [4, 1, 3, 0]], atol=1e-5)


def test_more_of_ifacialmocap(tmp_path: Path) -> None:
    records = ifacialmocap_records(WEIGHTS, HEAD, EYES)
    odd = [
        record.replace("mouthLeft-", "mouthLeft--").replace("jawOpen", "hapihapi-0|timecode-1:2|jawOpen")
        for record in records
    ]
    odd[7] = "trackingStatus-0|" + odd[7]
    path = saved(tmp_path, "\n".join(odd), "a.txt")
    with pytest.warns(FbaWarning, match="taken as 60 in a second|left out: hapihapi, timecode|1 of 40 rows"):
        assert fba.read(path).rate == 60
    motion = ifacialmocap.read_face(path)
    assert np.flatnonzero(~motion.seen).tolist() == [7]
    left = motion.weights[:, motion.names.index("mouthLeft")]
    np.testing.assert_allclose(left[motion.seen], -np.delete(WEIGHTS["MouthLeft"], 7), atol=0.0051)
    for old, new, said in (
        ("head#", "head#a,", r"a\.txt:2: this is no turn"),
        ("jawOpen-", "jawOpen-x", r"a\.txt:2: this is no weight; expected jawOpen-12"),
        ("jawOpen-", "jawOpen-99", r"a\.txt:2: the weight is beyond 100 percent by far"),
    ):
        bad = [records[0], records[1].replace(old, new), *records[2:]]
        with pytest.raises(FormatError, match=said):
            ifacialmocap.read_face(saved(tmp_path, "\n".join(bad), "a.txt"))


def test_signs_in_a_record_of_the_app(tmp_path: Path) -> None:
    """Eyes of a real record look down and to the right: its shapes say so, and its angles."""
    record = (
        "eyeLookDown_L-25|eyeLookIn_L-25|eyeLookOut_L-0|eyeLookDown_R-25|eyeLookIn_R-0|eyeLookOut_R-13|jawOpen-0"
        "|hapihapi-0|=head#-16.5,4.35,0.26,0.03,-0.08,-0.4|rightEye#8.97,-4.78,-0.75|leftEye#8.8,-9.08,-1.4|"
    )
    motion = ifacialmocap.read_face(saved(tmp_path, "\n".join([record] * 2), "a.txt"), source_rate=60)
    yaw_left, yaw_right, pitch_left, pitch_right = motion.eyes[0]
    assert max(yaw_left, yaw_right) < 0 < min(pitch_left, pitch_right)


def test_scores_of_mediapipe(tmp_path: Path) -> None:
    frames = mediapipe_frames(WEIGHTS)
    plain = [
        {"time": number / 30, **{camel(name): float(values[number]) for name, values in WEIGHTS.items()
                                 if name != "TongueOut"}}
        for number in range(ROWS)
    ]  # fmt: skip
    python = json.loads(json.dumps(frames).replace("categoryName", "category_name"))
    for document in (frames, {"frames": frames}, {"fps": 30, "results": python}, plain, {"data": plain}):
        path = saved(tmp_path, json.dumps(document), "a.json")
        assert format_of(path).name == "shapes-json"
        motion = shapes_json.read_face(path)
        check(motion, but=("tongueOut",))
        assert motion.rate == 30
        np.testing.assert_allclose(motion.times, np.arange(ROWS) / 30, atol=1e-9)
    frames[3]["faceBlendshapes"] = []
    motion = shapes_json.read_face(saved(tmp_path, json.dumps(frames), "a.json"))
    assert np.flatnonzero(~motion.seen).tolist() == [3]


def test_recordings_of_beat(tmp_path: Path) -> None:
    motion = shapes_json.read_face(saved(tmp_path, json.dumps(beat(WEIGHTS)), "a.json"))
    check(motion, but=("tongueOut",))
    assert motion.rate == 60


def test_json_that_is_refused(tmp_path: Path) -> None:
    untimed = mediapipe_frames(WEIGHTS)
    for frame in untimed:
        del frame["timestampMs"]
    path = saved(tmp_path, json.dumps(untimed), "a.json")
    with pytest.raises(FormatError, match="its frames have no times; give their rate with source_rate=30"):
        fba.read(path)
    assert fba.read(path, source_rate=25).rate == 25
    short = beat(WEIGHTS)
    short["frames"][4]["weights"].pop()  # type: ignore[index]
    backwards = beat(WEIGHTS)
    backwards["frames"][4]["time"] = 0.0  # type: ignore[index]
    text = beat(WEIGHTS)
    text["frames"][4]["weights"][3] = "wide"  # type: ignore[index]
    for document, said in (
        (short, "frame 4 has 50 weights, and there are 51 names"),
        (backwards, "frame 4 is not later than the one before it"),
        (text, "frame 4: a weight is no number"),
    ):
        with pytest.raises(FormatError, match=said):
            fba.read(saved(tmp_path, json.dumps(document), "a.json"))
    with pytest.raises(FormatError, match="is no complete JSON"):
        fba.read(saved(tmp_path, json.dumps(beat(WEIGHTS))[:-40], "a.json"))
    with pytest.raises(FormatError, match="is in no format known here"):
        fba.read(saved(tmp_path, '{"frames": []}', "a.json"))


def numpy_file(kind: str, shape: str) -> bytes:
    """Return a file of NumPy that says this of its array, with no numbers in it."""
    head = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\1\0" + len(head).to_bytes(2, "little") + head.encode()


@pytest.mark.parametrize(
    ("name", "content", "finding"),
    [
        (
            "a.txt",
            f"{RECORD}|head#0,0,0,0,0,0|rightEye#0,0,0|leftEye-|jawOpen-1",
            "this is no turn|no weight",
        ),
        ("a.txt", f"{RECORD}|rightEye#0,0,0|leftEye-12", "no weight"),
        ("a.txt", f"{RECORD}|head#1e308,5,5,5,5,5|rightEye#5,5,5|leftEye#0,0,0", "head has an angle of"),
        ("a.csv", "Timecode,JawOpen\n4:9:9.0,\n8:9:0,", "no times in seconds"),
        ("a.npy", numpy_file("4f4", "(3, 68, 2)"), "no array|no format|holds"),
        ("a.npy", numpy_file("<f4", "(-248, 68)"), "an array that cannot be read"),
    ],
)
def test_what_no_capture_has(tmp_path: Path, name: str, content: str | bytes, finding: str) -> None:
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(FormatError, match=finding) as error:
        fba.read(path)
    assert name in str(error.value)


def test_points_in_one_place_show_no_pose() -> None:
    shape = np.random.default_rng(0).normal(size=(20, 3))
    with pytest.raises(ModelError, match="all in one place"):
        fit_poses(shape, np.zeros((2, 20, 2)))


def test_times_beyond_numbers(tmp_path: Path) -> None:
    rows = "".join(f"{10.0**308 * row / 2}," + ",".join(["1"] * 136) + "\n" for row in range(3))
    columns = ",".join([f" x_{point}" for point in range(68)] + [f" y_{point}" for point in range(68)])
    path = tmp_path / "a.csv"
    path.write_text(f"timestamp,{columns}\n{rows}")
    with pytest.raises(FormatError, match=r"a\.csv"):
        fba.read(path)
