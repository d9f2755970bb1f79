"""The results in docs/measure.md, some of which the README shows: `./dev bench --summary` measures them.

A figure is made of what the row's benchmark stores in `benchmark.extra_info`, in the run that prints it. So
a new row needs an entry in ROWS and a benchmark that stores its numbers; then put what the command prints
into the page. `./dev bench --check` compares the figures that do not depend on the machine, and
tests/test_bench.py checks that ROWS, the page, the README and the benchmarks agree.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "measure.md"
HEADER = ("result", "conditions", "measured", "by")


@dataclass(frozen=True)
class Row:
    """One result.

    result, conditions: text of the first two columns. figure: a format string over the benchmark's
    `extra_info`. benchmark: its pytest id below bench/. command: an `fba` command that shows the same.
    fixed: whether the figure is the same on every machine. chosen: whether the README shows it, too.
    """

    result: str
    conditions: str
    figure: str
    benchmark: str
    command: str = ""
    fixed: bool = False
    chosen: bool = False

    @property
    def source(self) -> str:
        """Markdown of the last column."""
        benchmark = f"`{self.benchmark}`"
        return f"`{self.command}`, {benchmark}" if self.command else benchmark

    def line(self, figure: str) -> str:
        """The row in Markdown."""
        return f"| {self.result} | {self.conditions} | {figure} | {self.source} |"


STREAM = "2253 frames of 66 FAPs, alphabets of 3721 symbols; warm, one core"
PICTURES = "1280x720, OpenGL in software on two cores, warm"
FILM = "1280x720, OpenGL in software and H.264 on two cores, warm"
PROGRAM = "a new process, caches warm"
COLD = "a new process, nothing compiled or cached yet"
CODED = (
    "{rate:.1f} million symbols/s, {ratio:.1f} times a textbook arithmetic coder compiled the same way "
    "(our arithmetic coder alone: {bare_ratio:.1f} times)"
)

ROWS = (
    Row(
        "test vectors from other codecs, decoded to exactly their values",
        "41 streams of real applications, 136 of another encoder; not part of this project",
        "{decoded} of {count}",
        "test_results.py::test_vectors_of_others",
        "fba conformance FOLDER",
        fixed=True,
        chosen=True,
    ),
    Row(
        "the same, encoded again to the same bytes",
        "without two that have what this encoder never writes: an obsolete start code, a wrong time code",
        "{encoded} of {to_encode}",
        "test_results.py::test_vectors_of_others",
        "fba conformance FOLDER",
        fixed=True,
        chosen=True,
    ),
    Row(
        "test vectors that come with `fba`, both ways",
        "written and checked by a second codec; 39 of them damaged",
        "{passed} of {count}",
        "test_results.py::test_own_vectors",
        "fba conformance",
        fixed=True,
    ),
    Row(
        "size of the 41 real streams, encoded again with fitted ranges",
        "the same values; bytes of all together",
        "{percent:.0f} % of the original",
        "test_results.py::test_size_of_real_streams",
        fixed=True,
        chosen=True,
    ),
    Row("decoding", f"{STREAM}, new arrays", CODED, "codec/test_codec.py::test_decode", chosen=True),
    Row(
        "decoding in JavaScript",
        f"{STREAM}; node.js 20",
        "{rate:.1f} million symbols/s, {ratio:.2f} times the decoder in Python",
        "codec/test_codec.py::test_decode_in_javascript",
    ),
    Row("encoding, ranges fitted", STREAM, CODED, "codec/test_codec.py::test_encode", chosen=True),
    Row(
        "memory to decode an hour of 68 FAPs at 25 Hz at once",
        "peak of the whole process",
        "{peak:.0f} MB, of which Python, NumPy and numba {before:.0f} MB",
        "codec/test_codec.py::test_memory_of_an_hour[one-shot]",
    ),
    Row(
        "the same, streaming",
        "peak of the whole process",
        "{peak:.0f} MB, of which Python, NumPy and numba {before:.0f} MB",
        "codec/test_codec.py::test_memory_of_an_hour[streaming]",
    ),
    Row(
        "BVH to BAPs: direction of each mapped bone against the source's",
        "9 BVH files from elsewhere, before coding, feet planted",
        "within {worst:.1f} degrees, {mean:.2f} on average",
        "test_results.py::test_captures",
        "fba encode --report --json",
        fixed=True,
        chosen=True,
    ),
    Row(
        "BVH to BAPs: height of the feet on the ground against the source's, scaled",
        "the same",
        "{feet_mean:.1f} mm off on average, {feet_worst:.1f} mm at worst, "
        "within 1 cm in {feet_within:.2f} % of frames",
        "test_results.py::test_captures",
        "fba encode --report --json",
        fixed=True,
        chosen=True,
    ),
    Row(
        "50 markers on a face (C3D) to a stream",
        "one minute at 100 Hz; warm, one core",
        "{seconds:.2f} s of processor",
        "capture/test_markers.py::test_a_minute_of_markers",
    ),
    Row(
        "ARKit's 52 shapes (CSV of Live Link Face) to a stream",
        "ten minutes at 60 Hz; warm, one core",
        "{seconds:.2f} s of processor",
        "capture/test_face_capture.py::test_ten_minutes_of_blendshapes",
    ),
    Row(
        "an hour of FAPs, encoded with the preset `compact`",
        "66 FAPs at 25 Hz; warm, one core",
        "{seconds:.1f} s of processor, {ratio:.0f} times the plain encoder",
        "capture/test_planning.py::test_an_hour_compact",
    ),
    Row(
        "a frame of a face at a bit rate, as it comes",
        "44 FAPs at 20 kbit/s, which leaves no frame out; warm, one core",
        "{median:.2f} ms, {slow:.2f} ms in 99 % of frames; {rate:,.0f} frames/s",
        "capture/test_planning.py::test_a_frame_at_a_bit_rate[20000]",
        "fba capture livelink --bitrate",
    ),
    Row(
        "BAPs to 87 joint matrices",
        "186 BAPs, 2000 poses a call; warm, one core, `out=`",
        "{rate:,.0f} poses/s, {ratio:.1f} times NumPy",
        "figures/test_body.py::test_pose[out]",
    ),
    Row(
        "the same",
        "the same, new arrays in memory that was used before",
        "{rate:,.0f} poses/s, {ratio:.1f} times NumPy",
        "figures/test_body.py::test_pose[new arrays]",
    ),
    Row(
        "the same",
        "the same, new arrays, all kept: 22 MB of new memory a call",
        "{rate:,.0f} poses/s; filling such arrays with zeros takes {filling:.2f} of that time",
        "figures/test_body.py::test_pose[new arrays, all kept]",
    ),
    Row(
        "87 joint matrices to BAPs",
        "2000 poses a call; warm, one core, new arrays, all kept",
        "{rate:,.0f} poses/s",
        "figures/test_body.py::test_solve",
    ),
    Row(
        "skinning by dual quaternions, with normals",
        "for 10,000 vertices; warm, one core, `out=`",
        "{milliseconds:.2f} ms",
        "figures/test_skinning.py::test_skinning_a_person[dual]",
    ),
    Row(
        "built-in head moved by all 66 FAPs, with normals",
        "20,527 vertices; warm, one core, `out=`",
        "{milliseconds:.2f} ms a frame, {ratio:.0f} times a copy of the arrays",
        "figures/test_face.py::test_deform[built-in head]",
        chosen=True,
    ),
    Row(
        "the same, without normals",
        "the same",
        "{bare_milliseconds:.2f} ms a frame",
        "figures/test_face.py::test_deform[built-in head]",
    ),
    Row(
        "built-in head against the standard",
        "rest position and every FAP",
        "{errors} errors, {warnings} warnings",
        "test_results.py::test_validation[built-in head]",
        "fba model validate --default",
        fixed=True,
    ),
    Row(
        "MakeHuman's head against the standard",
        "every FAP (`--only faps`); `base.obj` of MakeHuman, not part of this project",
        "{errors} errors, {warnings} warnings",
        "test_results.py::test_validation[MakeHuman's FAPs]",
        "fba model validate base.obj --only faps",
        fixed=True,
    ),
    Row(
        "the same",
        "rest position and every FAP; irises, lips and tongue rest in other positions than the standard's",
        "{errors} errors, {warnings} warnings",
        "test_results.py::test_validation[MakeHuman]",
        "fba model validate base.obj",
        fixed=True,
    ),
    Row(
        "pictures of the built-in person",
        PICTURES,
        "{processor:.1f} ms of processor each; {pictures:.0f} a second by the clock",
        "player/test_player.py::test_pictures[person]",
        chosen=True,
    ),
    Row(
        "pictures of the built-in head alone",
        PICTURES,
        "{processor:.1f} ms of processor each; {pictures:.0f} a second by the clock",
        "player/test_player.py::test_pictures[face]",
    ),
    Row(
        "pictures of eight persons side by side",
        PICTURES,
        "{processor:.1f} ms of processor each; {pictures:.0f} a second by the clock",
        "player/test_player.py::test_pictures[eight persons]",
    ),
    Row(
        "pictures of the person into an MP4 file",
        FILM,
        "{processor:.1f} ms of processor each; {pictures:.0f} a second by the clock",
        "player/test_render.py::test_render_to_mp4[head and body]",
    ),
    Row(
        "pictures of the head alone into an MP4 file",
        FILM,
        "{processor:.1f} ms of processor each; {pictures:.0f} a second by the clock",
        "player/test_render.py::test_render_to_mp4[head]",
    ),
    Row(
        "first picture of a face: `fba render` to a PNG file",
        PROGRAM,
        "{processors:.1f} s of processor; {seconds:.1f} s by the clock",
        "player/test_start.py::test_first_picture[hello.fap]",
        chosen=True,
    ),
    Row(
        "the same",
        COLD,
        "{processors:.0f} s of processor; {seconds:.0f} s by the clock",
        "player/test_start.py::test_first_picture_ever[hello.fap]",
    ),
    Row(
        "first picture of a body from a BVH file: `fba render` to a PNG file",
        PROGRAM,
        "{processors:.1f} s of processor; {seconds:.1f} s by the clock",
        "player/test_start.py::test_first_picture[hello.bvh]",
    ),
    Row(
        "the same",
        COLD,
        "{processors:.0f} s of processor; {seconds:.0f} s by the clock",
        "player/test_start.py::test_first_picture_ever[hello.bvh]",
    ),
    Row(
        "window with the first picture of a face: `fba play`",
        PROGRAM,
        "{processors:.1f} s of processor; {seconds:.1f} s by the clock",
        "player/test_start.py::test_first_picture_in_a_window[hello.fap]",
    ),
    Row(
        "window with the first picture of a body from a BVH file: `fba play`",
        PROGRAM,
        "{processors:.1f} s of processor; {seconds:.1f} s by the clock",
        "player/test_start.py::test_first_picture_in_a_window[hello.bvh]",
    ),
    Row(
        "clock of the sound, which the picture follows, against the device",
        "30 s on a null device, which takes samples by the wall clock",
        "within {milliseconds:.0f} ms in 99 % of readings",
        "test_results.py::test_sound_clock",
    ),
    Row(
        "`import fba`",
        f"within {PROGRAM}",
        "{milliseconds:.1f} ms by the clock",
        "player/test_start.py::test_import",
    ),
    Row(
        "`fba --help`",
        PROGRAM,
        "{processors:.2f} s of processor; {seconds:.2f} s by the clock",
        "player/test_start.py::test_help",
    ),
)


class Reasons:
    """A pytest plugin that keeps why a benchmark gave nothing."""

    def __init__(self) -> None:
        self.of: dict[str, str] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        name = report.nodeid.removeprefix("bench/")
        if report.skipped and isinstance(report.longrepr, tuple):
            self.of[name] = report.longrepr[2].removeprefix("Skipped: ")
        elif report.failed:
            self.of[name] = "the benchmark failed"


def figure(row: Row, measured: dict[str, dict[str, Any]], reasons: dict[str, str]) -> str:
    """The row's third column: its figure, or why there is none."""
    if row.benchmark in measured:
        return row.figure.format(**measured[row.benchmark])
    return f"not measured: {reasons.get(row.benchmark, 'the benchmark did not run')}"


def measure(rows: Sequence[Row], output: Path) -> tuple[int, dict[str, dict[str, Any]], dict[str, str]]:
    """Runs the benchmarks of rows: pytest's exit code; by benchmark, extra_info, or why it has none."""
    reasons = Reasons()
    names = dict.fromkeys(f"bench/{row.benchmark}" for row in rows)
    code = pytest.main(["--rootdir", str(ROOT), f"--benchmark-json={output}", *names], plugins=[reasons])
    text = output.read_text(encoding="utf-8") if output.exists() else ""
    entries = json.loads(text)["benchmarks"] if text else []
    measured = {entry["fullname"].removeprefix("bench/"): entry["extra_info"] for entry in entries}
    return code, {name: found for name, found in measured.items() if name not in reasons.of}, reasons.of


def shown_figures() -> list[str]:
    """The figures in the page's table, a row each, in the order of ROWS."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    begin = lines.index(f"| {' | '.join(HEADER)} |") + 2
    return [line.split(" | ")[2] for line in lines[begin : begin + len(ROWS)]]


def agree(shown: str, measured: str) -> bool:
    """Whether two figures say the same: whole numbers exactly, decimals within 3 % or one unit."""
    number = re.compile(r"\d+(?:\.\d+)?")
    if number.sub("#", shown) != number.sub("#", measured):
        return False
    pairs = zip(number.findall(shown), number.findall(measured), strict=True)
    return all(a == b if "." not in a + b else _near(a, b) for a, b in pairs)


def _near(shown: str, measured: str) -> bool:
    place = 10.0 ** -len(shown.partition(".")[2])
    return abs(float(shown) - float(measured)) <= max(1.001 * place, 0.03 * float(shown))


def check() -> int:
    """Compare the figures that are the same on every machine with the page; return 1 if any differs."""
    rows = [row for row in ROWS if row.fixed]
    shown = dict(zip(ROWS, shown_figures(), strict=True))
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(sys.stderr):
        code, measured, reasons = measure(rows, Path(folder) / "measured.json")
    for row in rows:
        now = figure(row, measured, reasons)
        if row.benchmark not in measured or agree(shown[row], now):
            print(f"ok: {row.result}: {now}")
        else:
            print(f"WRONG: {row.result}: {now}; docs/measure.md says {shown[row]}")
            code = 1
    return int(code)


def main() -> int:
    """Prints the table on standard output; what pytest says goes to standard error."""
    if "--check" in sys.argv[1:]:
        return check()
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(sys.stderr):
        code, measured, reasons = measure(ROWS, Path(folder) / "measured.json")
    lines = [row.line(figure(row, measured, reasons)) for row in ROWS]
    print(f"| {' | '.join(HEADER)} |", "|---|---|---|---|", *lines, sep="\n")
    return int(code)


if __name__ == "__main__":
    sys.exit(main())
