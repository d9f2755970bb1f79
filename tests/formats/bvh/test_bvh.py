"""BVH as it is written, and as it is found.

Which frame rate a rounded frame time of a BVH file stands for.
"""

import time
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fba
from fba.errors import FbaError, FbaWarning, FormatError
from fba.formats.bvh import _reader as reader

HEAD = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 10 0
    CHANNELS 3 Yrotation Zrotation Xrotation
    End Site
    {
      OFFSET 0 5 1
    }
  }
}
"""
NTSC = Fraction(30000, 1001)
ROWS = "1 2 3 10 20 30 40 50 60\n0 0 0 0 0 0 0 0 0\n"


def text(head: str = HEAD, rows: str = ROWS, frames: str = "2", time: str = "0.04") -> str:
    return f"{head}MOTION\nFrames: {frames}\nFrame Time: {time}\n{rows}"


def test_reads_hierarchy_and_motion() -> None:
    motion = reader.parse(text(), name="small")
    assert (motion.names, motion.parents.tolist()) == (("Hips", "Spine"), [-1, 0])
    assert (motion.offsets.tolist(), motion.end_parents.tolist()) == ([[0, 0, 0], [0, 10, 0]], [1])
    assert motion.end_offsets.tolist() == [[0, 5, 1]]
    assert (motion.positions.tolist(), motion.rate) == ([[1, 2, 3], [0, 0, 0]], 25)
    assert motion.name == "small"
    for joint, order, angles in ((0, "ZXY", [10, 20, 30]), (1, "YZX", [40, 50, 60])):
        w, *xyz = motion.rotations[0, joint]
        found = Rotation.from_quat([*xyz, w])
        assert (found.inv() * Rotation.from_euler(order, angles, degrees=True)).magnitude() < 1e-12
    np.testing.assert_array_equal(motion.rotations[1, :, 0], 1.0)


@pytest.mark.parametrize(
    "change",
    [
        lambda t: t.replace("\n", "\r\n"),
        lambda t: t.replace("\n", "\r"),
        lambda t: t.replace(" ", "\t"),
        lambda t: t.replace(" ", "   ").replace("\n", "\n\n"),
        lambda t: t.lower(),
        lambda t: "\ufeff" + t,
        lambda t: t.replace("\n{", " {"),
        lambda t: t.replace("Frames:", "Frames").replace("Time:", "Time"),
        lambda t: t.replace("Frames: ", "Frames:\t").rstrip("\n"),
        lambda t: t.replace("30 40", "30\n40"),  # a frame over two lines
        lambda t: t.replace("10 20", "1e1 +20.0"),
    ],
)  # fmt: skip
def test_lenient_with_how_it_is_written(tmp_path: Path, change) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "walk.bvh"
    path.write_bytes(change(text()).encode())
    expected, found = reader.parse(text()), reader.read_motion(path)
    np.testing.assert_allclose(found.rotations, expected.rotations)
    np.testing.assert_array_equal(found.positions, expected.positions)
    assert [n.lower() for n in found.names] == ["hips", "spine"]


@pytest.mark.parametrize(
    ("written", "rate"),
    [
        ("0.008333", 120), ("0.00833333", 120), ("0.016667", 60), ("0.0166667", 60), ("0.0333333", 30),
        ("0.033333", 30), ("0.033", 30), ("0.033367", NTSC),
        ("0.0333667", NTSC),
        ("0.04", 25), ("0.0400000", 25), ("0.041667", 24), ("0.0417083", Fraction(24000, 1001)),
        ("0.01", 100),
        ("0.02", 50), ("1", 1), ("1e-2", 100), ("0.05", 20), ("0.0666667", 15), ("0.002", 500),
        (".5", 2), ("0.4", Fraction(5, 2)),
    ],
)  # fmt: skip
def test_rates(written: str, rate: Fraction) -> None:
    assert reader.parse(text(time=written)).rate == rate


def test_wrong_frame_count_is_a_warning() -> None:
    with pytest.warns(FbaWarning, match="header says 3 frames, but the file has 2; these"):
        assert len(reader.parse(text(frames="3"))) == 2


def test_claimed_frames_allocate_nothing() -> None:
    with pytest.warns(FbaWarning, match="10000000000"):
        assert len(reader.parse(text(frames="10000000000"))) == 2


def test_truncated_last_line_is_left_out() -> None:
    with pytest.warns(FbaWarning, match=r"cut short \(4 of 9"), pytest.warns(FbaWarning, match="3 frames"):
        motion = reader.parse(text(rows=ROWS + "1 2 3 4", frames="3"))
    assert len(motion) == 2


def test_positions_of_inner_joints() -> None:
    head = HEAD.replace("CHANNELS 3 Y", "CHANNELS 6 Xposition Yposition Zposition Y")
    rows = "1 2 3 10 20 30 0 11 0 40 50 60\n0 0 0 0 0 0 0 11 0 0 0 0\n"
    assert reader.parse(text(head, rows)).offsets[1].tolist() == [0, 11, 0]
    with pytest.warns(FbaWarning, match="Spine"):
        reader.parse(text(head, rows.replace("0 11 0 4", "0 19 0 4")))


@pytest.mark.parametrize(
    ("content", "line", "message"),
    [
        (text(rows=ROWS.replace("20", "nan")), 19, "finite"),
        (text(rows=ROWS.replace("20", "inf")), 19, "finite"),
        (text(rows=ROWS.replace("20", "1e300")), 19, "finite numbers of at most 1e.12 "),
        (text(rows=ROWS.replace("20", "x")), 19, "number"),
        (text(rows=ROWS.replace(" 20", "")), 19, "expected 9 numbers"),
        (text(rows=ROWS.replace("20", "20 21")), 19, "expected 9 numbers"),
        (text(rows=""), 19, "no frame"),
        (text(rows="1 2 3\n"), 19, "no frame"),
        (text(time="0"), 18, "frame time"),
        (text(time="-0.01"), 18, "frame time"),
        (text(time="nan"), 18, "number"),
        (text(time="1e-300"), 18, "frame time"),
        (HEAD, 15, "before MOTION"),
        (HEAD + "MOTION\nFrames: 2\n", 16, "Frame Time"),
        (text(HEAD + HEAD.replace("HIERARCHY\n", "")), 16, "several ROOTs"),
        (text(HEAD.replace("OFFSET 0 10 0", "OFFSET 0 10")), 8, "three numbers"),
        (text(HEAD.replace("OFFSET 0 10 0", "OFFSET 0 ten 0")), 8, "number"),
        (text(HEAD.replace("OFFSET 0 10 0", "OFFSET 0 nan 0")), 8, "number"),
        (text(HEAD.replace("CHANNELS 3", "CHANNELS 4")), 9, "with 4 names"),
        (text(HEAD.replace("CHANNELS 3", "CHANNELS 99")), 9, "with 99 names"),
        (text(HEAD.replace("CHANNELS 3", "CHANNELS -3")), 9, "the number of channels"),
        (text(HEAD.replace("Yrotation Z", "Wrotation Z")), 9, "Xposition"),
        (text(HEAD.replace("JOINT", "JIONT")), 6, "expected ROOT"),
        (text(HEAD[:-2]), 15, "still open"),
        (text(HEAD + "}\n"), 16, "never opened"),
        (text("HIERARCHY\n{\n}\n"), 2, "brace opens"),
        (text("HIERARCHY\n"), 2, "no ROOT"),
        (text("HIERARCHY\nJOINT a\n{\n}\n"), 2, "inside"),
        (text("HIERARCHY\nEnd Site\n{\n}\n"), 2, "an End Site must stand inside a joint"),
        (text("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n}\n"), None, "no joint has channels"),
        (text(HEAD.replace("HIERARCHY", "HIERARHCY")), 1, "HIERARCHY"),
        ("", None, "before MOTION"),
    ],
)  # fmt: skip
def test_errors_say_where(content: str, line: int | None, message: str) -> None:
    with pytest.raises(FormatError, match=message) as caught:
        reader.parse(content, path="walk.bvh")
    assert caught.value.path == "walk.bvh"
    if line is not None:
        assert caught.value.line == line


def test_a_file_of_another_kind_is_named(tmp_path: Path) -> None:
    path = tmp_path / "walk.bvh"
    path.write_bytes(b"glTF" + bytes(60))
    with pytest.raises(FormatError, match=r"a BVH file begins with HIERARCHY.*glTF"):
        reader.read_motion(path)


def test_deep_nesting() -> None:
    def nested(depth: int) -> str:
        inner = "".join(f"JOINT j{n} {{ OFFSET 0 1 0\n" for n in range(depth))
        return text(
            "HIERARCHY\nROOT r {\nOFFSET 0 0 0\nCHANNELS 1 Yrotation\n" + inner + "}" * (depth + 1) + "\n",
            "1\n",
            "1",
        )

    assert len(reader.parse(nested(3000)).names) == 3001
    with pytest.raises(FormatError, match="more than 4096 joints"):
        reader.parse(nested(100_000))


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_damage_anywhere_is_an_error_of_ours() -> None:
    """Cut at every character, and seeded replacements: only FbaError, or a motion that is finite."""
    whole = text()
    damaged = [whole[:end] for end in range(len(whole))]
    generator = np.random.default_rng(0)
    alphabet = list("{}0 9.-e\n\tJROOTEnd")
    for _ in range(1500):
        letters = list(whole)
        for at in generator.integers(0, len(letters), generator.integers(1, 6)):
            letters[at] = alphabet[generator.integers(len(alphabet))]
        damaged.append("".join(letters))
    read = 0
    for content in damaged:
        try:
            motion = reader.parse(content)
        except FbaError:
            continue
        read += 1
        assert np.isfinite(motion.rotations).all()
    assert read > 50


def test_skeleton_that_is_no_body(tmp_path: Path) -> None:
    path = tmp_path / "tail.bvh"
    path.write_text(text())
    with pytest.raises(FormatError, match=r"tail.bvh.*no known skeleton family"):
        fba.read(path)
    with pytest.raises(FormatError):
        fba.read(tmp_path)
    (tmp_path / "empty.bvh").touch()
    with pytest.raises(FormatError, match="empty"):
        fba.read(tmp_path / "empty.bvh")


def test_sniffs_content_not_name() -> None:
    assert reader.sniff(text().encode(), ".txt")
    assert reader.sniff(b"\xef\xbb\xbf\r\n hierarchy\r\n root x", "")
    assert not reader.sniff(b"HIERARCHY", ".bvh")
    assert not reader.sniff(b"3.2 hierarchy root", ".bvh")


def test_real_files_read_quickly_and_whole(shared: Path) -> None:
    path = shared / "data" / "greta" / "Dance.bvh"
    start = time.process_time()
    motion = reader.read_motion(path)
    assert time.process_time() - start < 30  # about 0.1 s of one core; a guard against losing orders
    assert (len(motion), motion.names[:3]) == (961, ("Hips", "Chest", "Chest2"))
    np.testing.assert_allclose(motion.positions[0], [-51.207945, 97.094741, -70.474226])


def test_real_file_through_the_registry(shared: Path) -> None:
    animation = fba.read(shared / "data" / "vreng" / "cmu_walk.bvh", rate=30)
    assert animation.rate == 30
    assert len(animation) == 86  # 344 frames at 120: the last one lies beyond the last sample
    assert animation.body is not None


def test_positions_of_joints_may_count_from_their_offsets() -> None:
    """MakeHuman writes 0 for a joint in its place; most others write its OFFSET."""
    head = HEAD.replace("CHANNELS 3 Yrotation", "CHANNELS 6 Xposition Yposition Zposition Yrotation")
    for place in ("0 10 0", "0 0 0"):
        motion = reader.parse(text(head, f"0 0 0 0 0 0 {place} 0 0 0\n" * 2))
        assert motion.offsets[1].tolist() == [0, 10, 0], place


def test_only_what_moves_more_than_its_parts_carries_the_body() -> None:
    """A back that was solved from markers slides along the hips like all joints; it is not the hips."""
    spine = "".join(
        f"JOINT {name}\n{{\nOFFSET 0 10 0\n"
        "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
        for name in ("Spine", "Chest", "Neck", "Head")
    )
    head = (
        "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\n"
        "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
        f"{spine}End Site\n{{\nOFFSET 0 5 0\n}}\n{'}' * 5}\n"
    )

    def row(*heights: float) -> str:
        return " ".join(f"0 {height} 0 0 0 0" for height in (90, *heights)) + "\n"

    with pytest.warns(FbaWarning, match="Spine, Chest, Neck, Head"):
        solved = reader.parse(text(head, row(10, 10, 10, 10) + row(10.2, 10.1, 10.2, 10.1)))
    assert solved.names[0] == "Hips"
    with pytest.warns(FbaWarning, match="varies keep the median of it: Chest, Neck, Head"):
        carried = reader.parse(text(head, row(10, 10, 10, 10) + row(12, 10.1, 10.2, 10.1)))
    assert carried.names[0] == "Spine"


@pytest.mark.parametrize(
    ("frame_time", "rate"),
    [
        ("0.042", Fraction(24)),  # nearer to 23.976, but so coarse a time is that of a whole rate
        ("0.0167", Fraction(60)),
        ("0.0417", Fraction(24000, 1001)),  # much nearer than 24
        ("0.0333667", Fraction(30000, 1001)),
        ("0.0333333", Fraction(30)),
        ("1000.5", Fraction(2, 2001)),
    ],
)
def test_rate_of_a_frame_time(frame_time: str, rate: Fraction) -> None:
    assert reader._rate(frame_time) == rate
