"""Every example runs as it is."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import graphics

EXAMPLES = Path(__file__).parents[1] / "examples"

pytestmark = pytest.mark.skipif(
    not EXAMPLES.is_dir(), reason="the examples are not beside the tests; they come with a checkout"
)


def run(name: str, *arguments: object) -> str:
    """What an example prints, run by a Python of its own."""
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / name), *map(str, arguments)],
        capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    if "DisplayError" in done.stderr and graphics.missing_opengl():
        graphics.skip(graphics.missing_opengl())
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_encode_a_capture(tmp_path: Path) -> None:
    sample = EXAMPLES.parent / "fba" / "samples" / "hello.bvh"
    stream = tmp_path / "out.fba"
    printed = run("encode_a_capture.py", sample, stream)
    assert f"{stream}: {stream.stat().st_size} bytes" in printed
    assert "decoded again: 240 frames" in printed


def test_stream_in_chunks() -> None:
    printed = run("stream_in_chunks.py", 16)
    received = re.search(r"received (\d+) frames while sending, (\d+) at the end", printed)
    assert received is not None
    assert int(received[1]) + int(received[2]) == 240
    latency = re.search(r"latency: ([0-9.]+) frames", printed)
    assert latency is not None
    assert 0 < float(latency[1]) <= 3


def test_offscreen_picture(tmp_path: Path) -> None:
    from PIL import Image

    path = tmp_path / "strip.png"
    run("offscreen_picture.py", path)
    with Image.open(path) as image:
        assert image.size == (1280, 360)
        assert len(image.getcolors(1 << 20) or ()) > 500


def test_compare_quantisers() -> None:
    table = [line.split() for line in run("compare_quantisers.py").splitlines()[2:]]
    assert [int(row[0]) for row in table] == [1, 2, 4, 8, 16, 31]
    sizes = [int(row[1]) for row in table]
    errors = [float(row[3]) for row in table]
    assert sizes == sorted(sizes, reverse=True)
    assert errors == sorted(errors)


def test_all_examples_are_tested() -> None:
    tested = Path(__file__).read_text(encoding="utf-8")
    elsewhere = {"make_samples.py"}  # tests/test_samples.py
    for path in EXAMPLES.glob("*.py"):
        assert path.name in tested or path.name in elsewhere, path.name
