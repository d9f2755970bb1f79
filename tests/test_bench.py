"""Tables of results: docs/measure.md, README.md, what `./dev bench --summary` prints, and the benchmarks.

The study of losses: `python -m bench.codec.loss`, shortened.
"""

import os
import re
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from random import Random

import numpy as np
import pytest
from click.testing import CliRunner

from bench import summary
from bench.codec import loss
from bench.summary import HEADER, ROWS, Row
from fba import Animation, FbaWarning, decode
from fba.cli.main import group
from tools import synthetic_motion as motion

ONCE, SECOND = loss.SETTINGS[0], loss.Setting("every second", Fraction(1))
pytest.importorskip("pytest_benchmark")

ROOT = Path(__file__).parents[1]


def table_of(page: Path) -> list[list[str]]:
    """The cells of a page's table of results, its header first."""
    lines = page.read_text(encoding="utf-8").splitlines()
    begin = lines.index(f"| {' | '.join(HEADER)} |")
    length = next(number for number, line in enumerate(lines[begin:]) if not line.startswith("|"))
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[begin : begin + length]]


def pattern(figure: str) -> str:
    """A regular expression for what a format string gives, any numbers in it."""
    parts = re.split(r"\{[^}]*\}", figure)
    return r"\d[\d,]*(\.\d+)?".join(re.escape(part) for part in parts)


def test_the_page_shows_every_row_as_it_is_printed_and_the_readme_ten_of_them() -> None:
    shown = table_of(summary.PAGE)[2:]
    assert [(cells[0], cells[1], cells[3]) for cells in shown] == [
        (row.result, row.conditions, row.source) for row in ROWS
    ]
    for cells, row in zip(shown, ROWS, strict=True):
        assert re.fullmatch(f"{pattern(row.figure)}|not measured: .+", cells[2]), f"{row.result}: {cells[2]}"
    chosen = [cells for cells, row in zip(shown, ROWS, strict=True) if row.chosen]
    assert table_of(ROOT / "README.md")[2:] == chosen
    assert len(chosen) == 10


def test_every_row_names_a_benchmark_that_exists() -> None:
    command = [sys.executable, "-m", "pytest", "bench", "--collect-only", "-q", "-o", "addopts="]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    collected = {line.removeprefix("bench/") for line in done.stdout.splitlines() if "::" in line}
    assert collected, done.stdout + done.stderr
    # A module that needs a package which is missing here is not collected; its function is looked up.
    for name in (row.benchmark for row in ROWS):
        file, _, test = name.partition("::")
        if any(other.startswith(f"{file}::") for other in collected):
            assert name in collected
        else:
            assert f"def {test.partition('[')[0]}(" in (ROOT / "bench" / file).read_text(encoding="utf-8")


@pytest.mark.parametrize("command", sorted({row.command for row in ROWS if row.command}))
def test_every_command_named_exists(command: str) -> None:
    program, *words = command.split()
    assert program == "fba"
    options = [word for word in words if word.startswith("-")]
    names = [word for word in words if word.isalpha() and word.islower()]
    told = CliRunner().invoke(group, [*[name for name in names if name != "faps"], "--help"])
    assert told.exit_code == 0, told.output
    for option in options:
        assert option in told.output


@pytest.mark.parametrize(
    ("shown", "measured", "same"),
    [
        ("177 of 177", "177 of 177", True),
        ("177 of 177", "176 of 177", False),
        ("0.33 degrees", "0.34 degrees", True),
        ("0.33 degrees", "0.36 degrees", False),
        ("22.0 mm", "22.6 mm", True),
        ("22.0 mm", "10.6 mm", False),
        ("22.0 mm", "22.0 cm", False),
    ],
)
def test_figures_of_the_readme_agree_with_what_is_measured(shown: str, measured: str, same: bool) -> None:
    assert summary.agree(shown, measured) is same


def test_the_size_of_the_first_stream_is_what_the_readme_says(tmp_path: Path) -> None:
    samples = [str(ROOT / "fba" / "samples" / name) for name in ("hello.fap", "hello.bvh")]
    out = tmp_path / "hello.fba"
    assert CliRunner().invoke(group, ["encode", *samples, "-o", str(out), "--fps", "25"]).exit_code == 0
    (said,) = re.findall(r"one stream of (\d+) kB", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert round(out.stat().st_size / 1000) == int(said)


def test_a_row_without_a_figure_says_why() -> None:
    row = Row("speed", "warm", "{rate:,.0f} a second", "test_a.py::test_b[c]", "fba bench FILE")
    assert summary.figure(row, {row.benchmark: {"rate": 12345.6}}, {}) == "12,346 a second"
    assert summary.figure(row, {}, {row.benchmark: "no display"}) == "not measured: no display"
    assert summary.figure(row, {}, {}) == "not measured: the benchmark did not run"
    assert row.line("1 a second") == (
        "| speed | warm | 1 a second | `fba bench FILE`, `test_a.py::test_b[c]` |"
    )


def test_the_summary_is_measured_and_printed(tmp_path: Path) -> None:
    """On benchmarks of its own: one that measures, one that is skipped, one that fails."""
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench" / "test_small.py").write_text(
        "import pytest\n"
        "def test_quick(benchmark):\n"
        "    benchmark.pedantic(lambda: None, rounds=2)\n"
        "    benchmark.extra_info['count'] = 7\n"
        "def test_absent(benchmark):\n"
        "    pytest.skip('no such thing here')\n"
        "def test_wrong(benchmark):\n"
        "    benchmark.pedantic(lambda: None)\n"
        "    benchmark.extra_info['count'] = 8\n"
        "    assert False\n",
        encoding="utf-8",
    )
    script = f"""
import sys
from pathlib import Path
sys.path.insert(0, {str(ROOT)!r})
from bench import summary
summary.ROOT = Path.cwd()
summary.ROWS = tuple(
    summary.Row(name, "here", "{{count}} of them", f"test_small.py::test_{{name}}")
    for name in ("quick", "absent", "wrong")
)
sys.exit(summary.main())
"""
    # side by side with other tests, pytest-benchmark would measure nothing
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1, done.stderr
    assert done.stdout.splitlines() == [
        "| result | conditions | measured | by |",
        "|---|---|---|---|",
        "| quick | here | 7 of them | `test_small.py::test_quick` |",
        "| absent | here | not measured: no such thing here | `test_small.py::test_absent` |",
        "| wrong | here | not measured: the benchmark failed | `test_small.py::test_wrong` |",
    ]


@pytest.fixture(scope="module")
def performance() -> Animation:
    return motion.animation(motion.face(150, faps_sent=(3, 4, 48, 49)))


def test_packets_are_the_stream_in_pieces_of_a_plane(performance: Animation) -> None:
    data = loss.encode(performance, SECOND.options)
    packets = loss.split_planes(data)
    assert b"".join(packets) == data
    assert len(packets) == 150
    with pytest.warns(FbaWarning, match="the end code"):
        part = decode(b"".join(packets[:25]), bap_steps="visage", on_error="salvage")
    assert len(part) == 25


@pytest.mark.parametrize(("share", "burst"), [(0.05, 1), (0.2, 1), (0.2, 10)])
def test_channels_lose_what_they_say(share: float, burst: int) -> None:
    packets = [bytes([n % 256]) for n in range(20_000)]
    arrived = loss.lose(share, burst)(packets, Random(1))
    assert 1 - len(arrived) / len(packets) == pytest.approx(share, rel=0.2)
    flipped = loss.flip(1e-3)([b"\0" * 20_000], Random(1))
    count = int(np.unpackbits(np.frombuffer(flipped, dtype=np.uint8)).sum())
    assert count == pytest.approx(160, rel=0.3)


def test_a_lost_plane_is_forgotten_within_one_period(performance: Animation) -> None:
    """With one I plane only, the error stays."""
    error = loss.recovery(performance, SECOND, seconds=2, rounds=12)
    assert error[:5].mean() > 0
    assert error[25:].max() == 0
    assert loss.recovery(performance, ONCE, seconds=2, rounds=12)[25:].min() > 0


def test_short_periods_bring_more_frames_home(performance: Animation) -> None:
    channels = [loss.CHANNELS[1], loss.CHANNELS[5]]
    results = loss.run(performance, [ONCE, SECOND], channels, rounds=6, seed=2)
    assert results == loss.run(performance, [ONCE, SECOND], channels, rounds=6, seed=2)
    few, _, many, _ = results
    assert few.right < 0.5 < many.right
    assert few.outage > many.outage
    assert few.error > many.error > 0
    for one in results:
        assert one.right + one.held + one.wrong == pytest.approx(1)
        assert one.wrong < 0.1
    lines = loss.tables(results)
    assert lines[0].startswith("| frames shown right: I planes | size | planes lost, 5 % |")
    assert lines[3].startswith(f"| every second | +{100 * many.bytes / few.bytes - 100:.0f} % |")
