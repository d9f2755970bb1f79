"""FAP files: the real ones, the odd ones, the broken ones, and round trips.

BAP files: both widths, scales, round trips, the real ones.
"""

import tempfile
import warnings
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.errors import FbaWarning, FormatError
from fba.formats.text.bap import read_bap, write_bap
from fba.formats.text.fap import read_fap, write_fap
from format_files import animations, file, mask


def test_reads_values_masks_and_numbers(tmp_path: Path) -> None:
    path = file(
        tmp_path, "a.fap",
        "# made by hand", "2.1 a name with blanks 25 3", "", mask(1, 2, 3, 68), "  # between",
        "4 1 2 63 1 5 62 6 61 0 1 -7 99  # tail", mask(3), "5\t-0", mask(), "9",
    )  # fmt: skip
    animation = read_fap(path)
    assert (animation.name, animation.rate) == ("a name with blanks", 25)
    assert animation.index.tolist() == [4, 5, 9]
    face = animation.face
    assert face.viseme.tolist() == [[1, 2, 63, 1], [0] * 4, [0] * 4]
    assert face.expression[0].tolist() == [5, 62, 6, 61, 0, 1]
    assert face.values[0, [2, 3, 67]].tolist() == [-7, 0, 99]
    assert np.argwhere(face.mask).tolist() == [[0, 0], [0, 1], [0, 2], [0, 67], [1, 2]]


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_line_ends_byte_order_mark_and_old_encodings(tmp_path: Path, end: bytes) -> None:
    name = "Gähnen".encode("latin-1")
    path = file(tmp_path, "a.fap", b"\xef\xbb\xbf2.0 " + name + b" 30 1", mask(5), "0 12", end=end)
    animation = read_fap(path)
    assert (animation.name, animation.face.values[0, 4]) == ("Gähnen", 12)


def test_windows_path_as_a_name_and_a_69th_column(tmp_path: Path) -> None:
    path = file(
        tmp_path, "a.fap", r"2.1 C:\My Files\x 25 2", mask(19, width=69), "0 940", mask(69, width=69), "1 5"
    )
    animation = read_fap(path)
    assert (animation.name, animation.face.values[:, 18].tolist()) == (r"C:\My Files\x", [940, 0])
    assert not animation.face.mask[1].any()


def test_floats_round_half_away_from_zero_with_one_warning(tmp_path: Path) -> None:
    path = file(
        tmp_path, "a.fap", "2.1 a 25 1", mask(3, 4, 5, 6, 7), "0 0.5 -0.5 1.49 2e2 0.49999999999999994"
    )
    with pytest.warns(FbaWarning, match=r"a\.fap: 4 values are not integers, the first on line 3") as caught:
        animation = read_fap(path)
    assert len(caught) == 1
    assert animation.face.values[0, 2:7].tolist() == [1, -1, 1, 200, 0]


def test_angle_scale_touches_angles_only(tmp_path: Path) -> None:
    path = file(tmp_path, "a.fap", "2.0 a 25 1", mask(3, 48), "0 10 10")
    assert read_fap(path, angle_scale=50).face.values[0, [2, 47]].tolist() == [10, 500]


def test_the_frame_count_of_the_header_is_a_hint(tmp_path: Path) -> None:
    path = file(tmp_path, "a.fap", "2.1 a 25 10000000000", mask(3), "0 1")
    with pytest.warns(FbaWarning, match="says 10000000000 frames, the file has 1; all"):
        assert len(read_fap(path)) == 1


def test_numbers_that_start_again_go_on_instead(tmp_path: Path) -> None:
    frames = [line for number in (0, 1, 5, 0, 1, 1) for line in (mask(3), f"{number} 1")]
    path = file(tmp_path, "a.fap", "2.1 a 25 6", *frames)
    with pytest.warns(FbaWarning, match=r"a\.fap:9: frame number 0 comes after 5; 2 frames"):
        assert read_fap(path).index.tolist() == [0, 1, 5, 6, 7, 8]


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_numbers_that_start_again_do_not_grow_beyond_what_a_file_may_hold(tmp_path: Path) -> None:
    frames = [line for number in (2**31 - 1, 0) for line in (mask(3), f"{number} 1")]
    path = file(tmp_path, "a.fap", "2.1 a 25 2", *frames)
    with pytest.raises(FormatError, match=r"a\.fap:5: the frame would get the number 2147483648"):
        read_fap(path)


def test_without_a_header_it_wants_a_rate(tmp_path: Path) -> None:
    path = file(tmp_path, "a.fap", mask(3), "0 1")
    with pytest.raises(FormatError, match=r"no header.*; give one with source_rate=25$"):
        read_fap(path)
    animation = read_fap(path, source_rate="29.97", name="given")
    assert (animation.rate, animation.name) == (Fraction(30000, 1001), "given")
    assert len(animation) == 1


@pytest.mark.parametrize(
    ("lines", "line", "token", "message"),
    [
        (["2.1 a 25 1", mask(3), "0 inf"], 3, "inf", "FAP 3 open_jaw must be a finite number"),
        (["2.1 a 25 1", mask(3), "0 nan"], 3, "nan", "finite"),
        (["2.1 a 25 1", mask(3), "0 0x10"], 3, "0x10", "FAP 3 open_jaw is no number"),
        (["2.1 a 25 1", mask(3), "0 1_0"], 3, "1_0", "no number"),
        (["2.1 a 25 1", mask(3, 4), "0 1-2 3"], 3, "1-2", "FAP 3 open_jaw is no number"),
        (["2.1 a 25 1", mask(3), "0 2147483648"], 3, "2147483648", "must lie in -2147483648..2147483647"),
        (["2.1 a 25 1", mask(3), "0.5 1"], 3, "0.5", "frame number must be an integer"),
        (["2.1 a 25 1", mask(3), "9999999999 1"], 3, "9999999999", "frame number"),
        (["2.1 a 25 1", mask(1), "0 15 0 0 0"], 3, "15", r"viseme_select1 must lie in 0\.\.14"),
        (["2.1 a 25 1", mask(2), "0 1 0 7 0 0 0"], 3, "7", r"expression_select2 must lie in 0\.\.6"),
        (["2.1 a 25 1", mask(2), "0 1 0 1 0 2 0"], 3, "2", r"init_face must lie in 0\.\.1"),
        (["2.1 a 25 2", mask(3), "0 1 2", mask(3), "1 1"], 3, "2", "asks for 1 values .* found 2"),
        (["2.1 a 25 2", mask(3, 4), "0 1", mask(3), "1 1"], 3, "1", "asks for 2 values .* found 1"),
        (["2.1 a 25 1", mask(3).replace("1", "2"), "0 1"], 2, "2", "mask line of 68 bits"),
        (["2.1 a 25 1", mask(width=67), "0", mask(), "0"], 2, None, "mask of 68 bits, found 67"),
        (["2.1 a 25 1", mask(3), "0 1", "2.1 b 25 1", mask(), "0"], 4, "2.1", "second header"),
        (["2.1 a 0 1", mask(3), "0 1"], 1, "0", r"more than 0 \(found '0'\); give one with source_rate=25$"),
        (["2.1 a nan 1", mask(3), "0 1"], 1, "nan", "frame rate is a positive number"),
        (["2.1 a 1e400000000 1", mask(3), "0 1"], 1, "1e400000000", "frame rate is a positive number"),
        (["2.1 a -25 1", mask(3), "0 1"], 1, "-25", "frame rate"),
        (["2.1 a 25 many", mask(3), "0 1"], 1, "many", "number of frames"),
        (["hello"], 1, "hello", "expected a header"),
        (["# nothing", ""], 2, None, "only blank lines"),
        (["2.1 a 25 3"], None, None, "promises 3 frames, but the file has none"),
    ],
)  # fmt: skip
def test_errors_name_line_and_token(
    tmp_path: Path, lines: list[str], line: int | None, token: str | None, message: str
) -> None:
    path = file(tmp_path, "a.fap", *lines)
    with pytest.raises(FormatError, match=message) as caught:
        read_fap(path)
    assert caught.value.path == str(path)
    assert (caught.value.line, caught.value.token) == (line, token)


@pytest.mark.parametrize(
    "tail", [[mask(3, 4)], [mask(3, 4), "1 5"], [mask(3, 4)[:50]], [mask(3, 4), "1 5 x"]]
)
def test_salvage_keeps_the_frames_before_a_damage(tmp_path: Path, tail: list[str]) -> None:
    path = file(tmp_path, "a.fap", "2.1 a 25 1", mask(3, 4), "0 1 2", *tail)
    with pytest.raises(FormatError, match=r"cut.*; salvage=True reads the frames before it$|is no number"):
        read_fap(path)
    with pytest.warns(FbaWarning, match="salvaged the 1 frames"):
        assert len(read_fap(path, salvage=True)) == 1


def test_salvage_stops_at_damage_in_the_middle(tmp_path: Path) -> None:
    frames = [
        line for number in range(5000) for line in (mask(3), f"{number} {'oops' if number == 3000 else 7}")
    ]
    path = file(tmp_path, "a.fap", "2.1 a 25 3000", *frames)
    with pytest.warns(FbaWarning, match=r"a\.fap:6003: FAP 3 open_jaw is no number.*salvaged the 3000"):
        animation = read_fap(path, salvage=True)
    assert animation.index.tolist() == list(range(3000))


def test_no_line_is_read_without_end(tmp_path: Path) -> None:
    path = tmp_path / "a.fap"
    path.write_bytes(b"2.1 a 25 1\n" + b"0 " * 10_000_000)
    with pytest.raises(FormatError, match="a line of more than 65536 bytes") as caught:
        read_fap(path)
    assert caught.value.line == 2
    path.write_bytes(b"2.1 a 25 1\n" + mask(3).encode() + b"\n0 \0\n")
    with pytest.raises(FormatError, match="NUL bytes") as caught:
        read_fap(path)
    assert caught.value.line == 3
    path.write_bytes(b"2.1 a 25 1\n" + mask(3).encode() + b"\n0 " + b"1" * 65_000 + b"x\n")
    with pytest.raises(FormatError, match="no number"):  # at once: nothing here is quadratic
        read_fap(path)
    path.write_bytes("2.1 a 25 1\n".encode("utf-16"))
    with pytest.raises(FormatError, match="UTF-16 text; save it as UTF-8"):
        read_fap(path)


def test_an_unknown_version_is_read_with_a_warning(tmp_path: Path) -> None:
    path = file(tmp_path, "a.fap", "2.7 a 25 1", mask(3), "0 1")
    with pytest.warns(FbaWarning, match=r"FAP version 2\.7 is unknown"):
        assert len(read_fap(path)) == 1


def test_a_body_is_not_written_as_a_face(tmp_path: Path) -> None:
    body = BodyTrack(np.zeros((1, 296), np.int32), np.ones((1, 296), bool))
    with pytest.raises(FormatError, match="only a body"):
        write_fap(tmp_path / "a.fap", Animation(Fraction(25), np.arange(1), None, body))
    assert not (tmp_path / "a.fap").exists()


def test_times_that_the_text_cannot_carry(tmp_path: Path) -> None:
    face = FaceTrack(np.zeros((2, 68), np.int32), np.ones((2, 68), bool))
    late = Animation(Fraction(25), np.array([0, 2**31]), face, None)
    with pytest.raises(FormatError, match=r"frame numbers 0\.\.2147483648 do not fit this format"):
        write_fap(tmp_path / "a.fap", late)
    odd = Animation(Fraction(10**40 + 1, 10**39), np.arange(2), face, None)
    with pytest.raises(FormatError, match="a fraction with too many digits; resample the animation"):
        write_fap(tmp_path / "a.fap", odd)
    assert not (tmp_path / "a.fap").exists()


def test_the_written_form_is_the_canonical_one(tmp_path: Path) -> None:
    source = file(tmp_path, "a.fap", "2.0 a  b 25 1", "#", mask(1, 3), "  7   1 2 3 0\t-5 ")
    write_fap(tmp_path / "b.fap", read_fap(source))
    assert (tmp_path / "b.fap").read_text() == f"2.2 a b 25 1\n{mask(1, 3)}\n7 1 2 3 0 -5\n"


@settings(max_examples=60)
@given(animations())
def test_written_files_read_back_unchanged(animation: Animation) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.fap"
        write_fap(path, animation)
        again = read_fap(path)
        assert again == animation
        write_fap(path, again)
        assert read_fap(path).name == again.name


def test_every_real_file_reads_and_writes_back(shared: Path, tmp_path: Path) -> None:
    paths = [path for path in shared.rglob("*") if path.suffix.lower() == ".fap"]
    assert len(paths) >= 190
    for path in paths:
        options = {"source_rate": 25} if path.parent.name == "semaine" else {}
        with warnings.catch_warnings(action="error"):  # none of them has an oddity worth a warning
            animation = read_fap(path, **options)  # type: ignore[arg-type]
        assert len(animation)
        write_fap(tmp_path / "b.fap", animation)
        assert read_fap(tmp_path / "b.fap") == animation


def test_decoded_reference_files_come_out_word_for_word(shared: Path, tmp_path: Path) -> None:
    paths = sorted((shared / "vectors" / "generated").glob("*.decoded.fap"))
    assert paths
    for path in paths:
        write_fap(tmp_path / "b.fap", read_fap(path))
        words = [line.split() for line in path.read_text().splitlines() if not line.startswith("#")]
        assert [line.split() for line in (tmp_path / "b.fap").read_text().splitlines()] == words, path


def test_a_face_is_not_written_as_a_body(tmp_path: Path) -> None:
    face = FaceTrack(np.zeros((1, 68), np.int32), np.ones((1, 68), bool))
    with pytest.raises(FormatError, match="a BAP file holds a body, and this animation has only a face"):
        write_bap(tmp_path / "a.bap", Animation(25, np.arange(1), face, None))
    assert not (tmp_path / "a.bap").exists()


@pytest.mark.parametrize("width", [186, 187, 296, 297])
def test_both_widths_and_one_column_more(tmp_path: Path, width: int) -> None:
    path = file(tmp_path, "a.bap", "3.2 walk 30 1", mask(1, 186, width=width), "3 -5 6")
    animation = read_bap(path)
    assert (animation.index.tolist(), animation.body.values[0, [0, 185]].tolist()) == ([3], [-5, 6])
    assert animation.body.mask.sum() == 2
    write_bap(tmp_path / "b.bap", animation)
    assert (tmp_path / "b.bap").read_text() == f"3.2 walk 30 1\n{mask(1, 186, width=296)}\n3 -5 6\n"


def test_a_file_may_change_its_width(tmp_path: Path) -> None:
    path = file(tmp_path, "a.bap", "3.1 a 30 2", mask(186, width=186), "0 1", mask(296, width=296), "1 2")
    body = read_bap(path).body
    assert (body.values[0, 185], body.values[1, 295]) == (1, 2)


def test_angle_scale_leaves_millimetres_alone(tmp_path: Path) -> None:
    path = file(tmp_path, "a.bap", "3.1 a 30 1", mask(1, 181, 184, width=186), "0 3 1000 -3")
    assert read_bap(path, angle_scale=1.5).body.values[0, [0, 180, 183]].tolist() == [5, 1000, -5]
    with pytest.raises(FormatError, match=r"must lie in .* after angle_scale 1e\+10"):
        read_bap(path, angle_scale=1e10)
    for scale in (0, float("nan"), "x"):
        with pytest.raises(FormatError, match="angle_scale must be a number other than 0"):
            read_bap(path, angle_scale=scale)  # type: ignore[arg-type]


def test_errors_name_the_bap(tmp_path: Path) -> None:
    path = file(tmp_path, "a.bap", "3.1 a 30 1", mask(1, width=186), "0 1e30")
    with pytest.raises(FormatError, match=r"a\.bap:3: BAP 1 sacroiliac_tilt must lie in .*'1e30'"):
        read_bap(path)
    path = file(tmp_path, "a.bap", "3.1 a 30 1", mask(1, width=180), "0 1", mask(1, width=186))
    with pytest.raises(FormatError, match="mask of 186 or 296 bits, found 180"):
        read_bap(path)


@settings(max_examples=40)
@given(animations(face=False, body=True))
def test_written_bap_files_read_back_unchanged(animation) -> None:  # type: ignore[no-untyped-def]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.bap"
        write_bap(path, animation)
        assert read_bap(path) == animation


def test_every_real_bap_file_reads_and_writes_back(shared: Path, tmp_path: Path) -> None:
    paths = [path for path in shared.rglob("*") if path.suffix.lower() == ".bap"]
    assert len(paths) >= 100
    for path in paths:
        with warnings.catch_warnings(action="error", category=FbaWarning):
            animation = read_bap(path)
        write_bap(tmp_path / "b.bap", animation)
        assert read_bap(tmp_path / "b.bap") == animation


def test_known_numbers_of_a_real_file(shared: Path) -> None:
    body = read_bap(shared / "data" / "vreng" / "clap.bap").body
    assert (len(body), body.values[0][body.mask[0]].tolist()) == (59, [-8726, -8726, 8726, 8726])
    assert body.values[58][body.mask[58]].tolist() == [49109, -36678, 164853, -131197, 23565, 28441]
