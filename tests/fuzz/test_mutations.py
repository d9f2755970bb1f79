"""Damaged streams, each made from its number: an error of ours, or a valid result. Part of them runs with
bounds checks in the compiled loops, which find what would otherwise read or write beside an array.

`./dev fuzz` tries 20,000 (`FBA_FUZZ=long`); among the other tests, the first 1,500 run.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from fba_conformance import fuzz

COUNT, CHECKED = (20_000, 1_500) if os.environ.get("FBA_FUZZ") == "long" else (1_500, 150)
SEED = 20_000
SLOWEST = 5.0
"""Seconds that one small stream may take on a machine that is busy with other things."""

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def checked_process(
    tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config
) -> Iterator[subprocess.Popen[str]]:
    """The fuzzer with every array access checked; it compiles and runs while the others are at work.

    What it compiles is kept in pytest's cache, if there is one: `fba._numba_cache` sees when that is too old.
    """
    try:
        cache = pytestconfig.cache.mkdir("fuzz-numba")  # type: ignore[union-attr]
    except (AttributeError, OSError):  # -p no:cacheprovider, or a checkout that may only be read
        cache = tmp_path_factory.mktemp("numba")
    process = subprocess.Popen(
        [sys.executable, "-m", "fba_conformance.fuzz", "--count", str(CHECKED), "--seed", str(SEED + 1)],
        cwd=ROOT,
        env={**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(cache)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    yield process
    process.kill()
    process.communicate()


@pytest.mark.slow
def test_mutated_streams(checked_process: subprocess.Popen[str]) -> None:
    fuzz.fuzz(20, SEED)  # compiles what is not compiled yet
    report = fuzz.fuzz(COUNT, SEED, compare_every=100)
    assert not report.findings, report.findings[0].reason
    assert report.count == COUNT
    assert report.decoded + report.refused == COUNT
    assert min(report.decoded, report.salvaged) > COUNT // 100  # the mutations reach all kinds of ends
    assert report.compared > COUNT // 250
    assert report.worst < SLOWEST, f"number {report.slowest} of seed {SEED}"
    output, _ = checked_process.communicate(timeout=300)
    assert checked_process.returncode == 0, output
    assert f"{CHECKED} streams" in output
    assert output.rstrip().endswith("0 findings")


def test_mutations_are_made_from_their_numbers() -> None:
    streams = fuzz.base_streams()
    one = [fuzz.mutate(streams, fuzz.Random(f"5 {number}")) for number in range(200)]
    again = [fuzz.mutate(streams, fuzz.Random(f"5 {number}")) for number in range(200)]
    assert one == again
    assert len(set(one)) > 150
    assert sum(stream in streams for stream in one) < 40
    assert all(len(stream) < 1000 for stream in streams)


def test_the_fuzzer_finds_what_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    """A decoder with a defect does not get past it, and the finding can be made again."""
    true_push = fuzz.Decoder.push_blocks

    def faulty(self: fuzz.Decoder, chunk: bytes) -> list[fuzz.Block]:
        if self.planes > 2:
            raise IndexError("a defect put in for this test")
        return true_push(self, chunk)

    monkeypatch.setattr(fuzz.Decoder, "push_blocks", faulty)
    report = fuzz.fuzz(100, 1)
    assert report.findings
    finding = report.findings[0]
    assert "a defect put in for this test" in finding.reason
    again = fuzz.fuzz(1, finding.seed, first=finding.number)
    assert again.findings[0].data == finding.data


def test_command_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    stream = tmp_path / "one.fba"
    stream.write_bytes(fuzz.base_streams()[0])
    assert fuzz.main(["--count", "5", "--seed", "3", str(stream)]) == 0
    assert capsys.readouterr().out.startswith("5 streams: ")
