"""EPF files: what each tag means, contradictions, the 177 real ones both ways."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from fba.codec.settings import FrameRate, PartSettings, PlaneSettings, RangeLists, TimeCode
from fba.errors import FbaWarning, FormatError, UnsupportedError
from fba.formats.epf.epf import read_animation, read_epf, write_epf
from format_files import file

FMT = "FMT 0 3 0 0 1 1 0 0 0 0 0 0 2 1 0 0 0 0"
FIRST = ("FBM 1", "FFR 0", "ISI 1", FMT, "FQU 4")


def limits(tag: str, value: int, count: int = 66) -> str:
    return f"{tag} {' '.join([str(value)] * count)}"


def comparable(plane: PlaneSettings) -> list[Any]:
    """Everything a plane says, as plain values."""
    parts = [
        part and [part.mask_types, part.mask.tolist(), part.quant, part.gender, part.coding_type]
        + [None if codes is None else codes.tolist() for codes in part.ranges]
        for part in (plane.face, plane.body)
    ]  # fmt: skip
    frames = [plane.face_frame, plane.body_frame]
    return [plane.intra, frames, parts, plane.frame_rate, plane.time_code, plane.skip, plane.start_code]


def test_tags_stay_in_force_until_changed(tmp_path: Path) -> None:
    path = file(
        tmp_path, "a.epf",
        "# by hand", *FIRST, "FRR 29 5 1", "TC 1 2 0 3", "SKN 17", limits("FIX", 61), limits("FIN", -61),
        "FBM 1", "FFR 2", "ISI 0",
        "FBM 1", "FFR 9", "SKN 1",
        "FBM 1", "FFR 10", "ISI 1", "FQU 7", "GDR 1", limits("FPN", -1860),
    )  # fmt: skip
    first, second, third, fourth = read_epf(path)
    assert [plane.intra for plane in (first, second, third, fourth)] == [True, False, False, True]
    assert [plane.face_frame for plane in (first, second, third, fourth)] == [0, 2, 9, 10]
    assert (first.body, first.body_frame) == (None, None)
    assert first.frame_rate == FrameRate(29, 5, 1)
    assert first.time_code == TimeCode(1, 2, 3, marker=0)
    assert [first.skip, second.skip, third.skip, fourth.skip] == [17, 0, 1, 0]
    assert first.face is second.face is third.face
    assert fourth.frame_rate is fourth.time_code is None
    face = first.face
    assert (face.quant, face.gender, face.coding_type) == (4, 0, 0)
    assert face.mask_types == (0, 3, 0, 0, 1, 0, 0, 0, 2, 0)
    # group 2 is FAP 3..18; group 5 FAP 39..42 with bits 1 0 0 0; group 9 FAP 61..64 with 1 0 0 0
    assert (np.flatnonzero(face.mask) + 1).tolist() == [*range(3, 19), 39, 61]
    assert face.ranges.i_max.tolist() == [0, 0] + [2] * 66  # 61 -> 120
    assert face.ranges.i_min.tolist() == [0, 0] + [2] * 66  # -61 -> -120
    assert face.ranges.p_max is face.ranges.p_min is None
    assert (fourth.face.quant, fourth.face.gender) == (7, 1)
    assert fourth.face.mask.tolist() == face.mask.tolist()
    assert fourth.face.ranges.p_min.tolist() == [0, 0] + [31] * 66
    assert fourth.face.ranges.i_max is None


def test_body_masks_follow_the_listed_order_of_the_groups(tmp_path: Path) -> None:
    groups = ["0"] * 24
    groups[5] = "1 1 0 0 0 1"  # left arm 1: BAPs 32 34 36 38 42
    groups[18] = "3"  # global positioning: BAPs 181..186
    path = file(
        tmp_path, "a.epf", "FBM 2", "BFR 5", "ISI 1", "BRR 25 0 0", f"BMT {' '.join(groups)}", "BQU 1"
    )
    (plane,) = read_epf(path)
    assert (plane.body_frame, plane.face) == (5, None)
    assert (np.flatnonzero(plane.body.mask) + 1).tolist() == [32, 42, *range(181, 187)]


@pytest.mark.parametrize(
    ("lines", "line", "message"),
    [
        (["FXM 1"], 1, "unknown tag.*'FXM'"),
        (["FFR 1"], 1, "comes before FBM"),
        (["FBM 4"], 1, r"integer in 1\.\.3.*'4'"),
        (["FBM"], 1, "one number, found 0"),
        (["FBM 1", "FFR 0"], 1, "the first block must contain .ISI 1."),
        (["FBM 1", "ISI 1", FMT, "FQU 1"], 1, "needs FFR"),
        (["FBM 1", "FFR 0", "ISI 0"], 1, "P plane.*before any I plane"),
        (["FBM 1", "FFR 0", "ISI 1", "FQU 1"], 1, "needs FMT"),
        (["FBM 1", "FFR 0", "ISI 1", FMT], 1, "needs FQU"),
        (["FBM 1", "FFR 0", "ISI 1", FMT, limits("FIX", 60), "FQU 1"], 5, "FQU must stand before"),
        ([*FIRST, "FQU 5"], 6, "twice in one block"),
        ([*FIRST, "BQU 5"], 6, "body tag in a block without a body"),
        ([*FIRST[:4], "FQU 32"], 5, r"integer in 0\.\.31"),
        ([*FIRST[:4], "FQU x"], 5, "'x'"),
        (["FBM 1", "FFR 0", "ISI 1", FMT + " 0", "FQU 1"], 4, "has more values than its 10 groups need"),
        (["FBM 1", "FFR 0", "ISI 1", "FMT 0 3 0 1 1", "FQU 1"], 4, "ends within group 4"),
        (["FBM 1", "FFR 0", "ISI 1", "FMT 1 2 0", "FQU 1"], 4, "mask bits of group 1"),
        (["FBM 1", "FFR 0", "ISI 1", "FMT 4", "FQU 1"], 4, r"integer in 0\.\.3"),
        (
            ["FBM 2", "BFR 0", "ISI 1", "BMT 2 1 1 1", "BQU 1"],
            4,
            "type 2 in group 1: it exists for faces only",
        ),
        ([*FIRST, limits("FIX", 1861)], 6, r"maximum of FAP 3 must lie in 0\.\.1860.*'1861'"),
        ([*FIRST, limits("FIX", -60)], 6, "maximum of FAP 3"),
        ([*FIRST, limits("FPN", 60)], 6, r"minimum of FAP 3 must lie in -1860\.\.0"),
        ([*FIRST, limits("FIX", 60, 68)], 6, "FIX needs 66 limits, found 68"),
        ([*FIRST, "FRR 0 0 0"], 6, "more than 0"),
        ([*FIRST, "FRR 25 16 0"], 6, r"seconds of FRR must lie in 0\.\.15"),
        ([*FIRST, "FRR 25"], 6, "3 numbers: rate seconds frequency_offset"),
        ([*FIRST, "TC 1 64 1 0"], 6, "minutes of TC"),
        ([*FIRST, "SKN 99999999999999999999"], 6, "integer in"),
        ([*FIRST, "FBM 1", "FFR 1", "ISI 0", "FRR 25 0 0"], 9, "only be sent with an I plane"),
        ([*FIRST, "FBM 1", "FFR 1", "ISI 0", limits("FIX", 60)], 9, "only be sent with an I plane"),
        (["# nothing"], 1, "no planes"),
    ],
)
def test_errors_name_line_and_token(tmp_path: Path, lines: list[str], line: int, message: str) -> None:
    with pytest.raises(FormatError, match=message) as caught:
        read_epf(file(tmp_path, "a.epf", *lines))
    assert caught.value.line == line


def test_one_time_for_both_parts(tmp_path: Path) -> None:
    block = ["FBM 3", "FFR 0", "BFR 0", "ISI 1", FMT, "FQU 1", f"BMT {'0 ' * 24}", "BQU 1", "FRR 25 0 0"]
    (plane,) = read_epf(file(tmp_path, "a.epf", *block, "BRR 25 0 0"))
    assert plane.frame_rate == FrameRate(25)
    with pytest.raises(FormatError, match="FRR and BRR of one block must agree"):
        read_epf(file(tmp_path, "a.epf", *block, "BRR 30 0 0"))


def test_a_mask_on_a_p_plane_waits_for_the_next_i_plane(tmp_path: Path) -> None:
    path = file(tmp_path, "a.epf", *FIRST, "FBM 1", "FFR 1", "ISI 0", "FQU 9", "FBM 1", "FFR 2", "ISI 1")
    with pytest.warns(FbaWarning, match="FQU in the block of a P plane"):
        planes = read_epf(path)
    assert [plane.face and plane.face.quant for plane in planes] == [4, 4, 9]


def part(**changes: Any) -> PartSettings:
    values: dict[str, Any] = {"mask_types": (3, *[0] * 9), "mask": np.arange(68) < 2, **changes}
    return PartSettings(**values)


@pytest.mark.parametrize(
    ("planes", "message"),
    [
        ([], "no planes"),
        ([PlaneSettings(True)], "neither a face nor a body"),
        ([PlaneSettings(True, face=part())], "no face_frame"),
        ([PlaneSettings(False, face_frame=0, face=part())], "P plane keeps"),
        ([PlaneSettings(True, face_frame=0, face=part(mask=np.zeros(68, bool)))], "contradicts its mask"),
        ([PlaneSettings(True, face_frame=0, face=part(mask_types=(3,)))], "10 mask types"),
        (
            [PlaneSettings(True, face_frame=0, face=part(mask_types=(4, *[0] * 9)))],
            "group 1 has mask type 4; expected 0 to 3",
        ),
        (
            [PlaneSettings(True, body_frame=0, body=PartSettings((2, *[0] * 23), np.zeros(296, bool)))],
            "group 1 has mask type 2; expected 0, 1 or 3",
        ),
        (
            [
                PlaneSettings(
                    True, face_frame=0, face=part(ranges=RangeLists(i_max=np.full(68, 32, np.uint8)))
                )
            ],
            "FIX needs 68 range codes of at most 31",
        ),
    ],
)
def test_contradicting_settings_are_not_written(
    tmp_path: Path, planes: list[PlaneSettings], message: str
) -> None:
    path = file(tmp_path, "old.epf", "old")
    with pytest.raises(FormatError, match=message):
        write_epf(path, planes)
    assert path.read_text() == "old\n"
    assert [entry.name for entry in tmp_path.iterdir()] == ["old.epf"]


def test_settings_without_a_tag(tmp_path: Path) -> None:
    body = PartSettings((0,) * 24, np.zeros(296, bool), gender=1)
    both = PlaneSettings(True, 0, 0, part(), body)
    with pytest.raises(UnsupportedError, match="suggested_gender"):
        write_epf(tmp_path / "a.epf", [both])
    with pytest.warns(FbaWarning, match="1 planes have a start code"):
        write_epf(tmp_path / "a.epf", [PlaneSettings(True, 0, face=part(gender=1), start_code=True)])
    (plane,) = read_epf(tmp_path / "a.epf")
    assert plane.face.gender == 1


def test_reading_an_epf_file_as_an_animation_explains_its_use(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedError, match=r"encoder parameter file.*--epf"):
        fba.read(file(tmp_path, "a.txt", *FIRST))


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"a\.epf:1: unknown tag; an EPF line begins with FBM"):
        read_animation(file(tmp_path, "a.epf", "2.1 a 25 1", "0 " * 68, "0"))


def test_every_real_file_reads_and_writes_back(shared: Path, tmp_path: Path) -> None:
    paths = sorted((shared / "vectors").glob("*/*.epf"))
    assert len(paths) == 177
    for path in paths:
        planes = read_epf(path)
        assert planes[0].intra
        write_epf(tmp_path / "b.epf", planes)
        assert list(map(comparable, read_epf(tmp_path / "b.epf"))) == list(map(comparable, planes)), path
        if path.parent.name == "real":
            continue  # these have limits that are no multiples of 60
        words = [line.split() for line in path.read_text().splitlines()]
        ours = [line.split() for line in (tmp_path / "b.epf").read_text().splitlines()]
        # the reference repeats nothing else, and puts each block's tags in the same order
        assert ours == words or "time" in path.name, path
