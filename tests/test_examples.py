"""Every example runs as it is."""

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

import graphics

EXAMPLES = Path(__file__).parents[1] / "examples"

pytestmark = pytest.mark.skipif(
    not EXAMPLES.is_dir(), reason="the examples are not beside the tests; they come with a checkout"
)


EXPECTED = {
    "01_read_and_write.py": r"240 frames at 25 frames/s.*first_second\.fba: \d+ bytes, 25 frames",
    "02_inspect.py": r"240 frames at 25 frames/s\n6\.\d+ kbit/s\nface: 44 FAPs.*BitstreamError: plane 0",
    "03_encode_and_decode.py": r"quantiser 1: 7\d{3} bytes\nquantiser 4: \d+ bytes\nlargest error: \d+ units",
    "04_quantisers_and_size.py": r"quantiser +bytes",
    "05_stream_in_chunks.py": r"latency: \d\.\d+ frames.*received 240 frames in all",
    "06_arrays_in.py": r"50 frames at 25 frames/s.*FAP 3 peaks at (399|400)\n",
    "07_visemes_and_expressions.py": r"frame 24: open_jaw \d+, vertices move up to \d\d\.\d mm",
    "08_capture_to_baps.py": r"39 bones.*decoded again: 240 frames",
    "09_walk.py": r"normal: .*sneaking: .*proud: 2\.\d+ m forward",
    "10_render_a_picture.py": r"out/strip\.png: 640x180",
    "11_render_a_film.py": r"out/film\.mp4: \d+ bytes\nout/marked\.mp4: \d+ bytes",
    "12_compare.py": r"240 times compared\nfap \d+ \w+: \d+ \w+ at \d\.\d\d s\n",
    "13_captured_face.py": r"50 markers, found by regions50; 47 FAPs.*66 mm apart and \d\.\d mm open.*kbit/s",
    "14_speak.py": r"visemes: \d+ frames, \d+ bytes\nfaps: \d+ frames.*visemes: 0 1 14 2 ",
}
"""What each example prints, as a regular expression."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("reader")


@pytest.fixture
def run(programs: Path, folder: Path) -> Callable[[str], str]:
    """Return a function that runs an example in a folder, as a process of its own, and returns its output."""
    return lambda name: output_of(name, programs, folder)


def output_of(name: str, programs: Path, folder: Path) -> str:
    """Return what an example prints."""
    done = subprocess.run(
        [str(programs / "python"), str(EXAMPLES / name)],
        cwd=folder, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    if "DisplayError" in done.stderr and graphics.missing_opengl():
        graphics.skip(graphics.missing_opengl())
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("name", [name for name in EXPECTED if not name.startswith(("04", "05", "10"))])
def test_example(name: str, run: Callable[[str], str]) -> None:
    assert re.search(EXPECTED[name], run(name), re.DOTALL)


def test_quantisers_trade_size_for_errors(run: Callable[[str], str]) -> None:
    table = [line.split() for line in run("04_quantisers_and_size.py").splitlines()[2:]]
    assert [int(row[0]) for row in table] == [1, 2, 4, 8, 16, 31]
    sizes = [int(row[1]) for row in table]
    errors = [float(row[3]) for row in table]
    assert sizes == sorted(sizes, reverse=True)
    assert errors == sorted(errors)


def test_frames_arrive_soon_after_they_are_sent(run: Callable[[str], str]) -> None:
    printed = run("05_stream_in_chunks.py")
    assert re.search(EXPECTED["05_stream_in_chunks.py"], printed, re.DOTALL)
    latency = re.search(r"latency: ([0-9.]+) frames", printed)
    assert 0 < float(latency[1]) <= 3


def test_a_strip_of_pictures(run: Callable[[str], str], folder: Path) -> None:
    from PIL import Image

    assert re.search(EXPECTED["10_render_a_picture.py"], run("10_render_a_picture.py"))
    with Image.open(folder / "out" / "strip.png") as image:
        assert image.size == (640, 180)
        assert len(image.getcolors(1 << 20) or ()) > 500


def test_examples_are_numbered_short_and_all_tested() -> None:
    paths = sorted(EXAMPLES.glob("*.py"))
    assert [path.name for path in paths] == list(EXPECTED)
    assert [int(path.name[:2]) for path in paths] == list(range(1, len(paths) + 1))
    for path in paths:
        assert 10 <= len(path.read_text(encoding="utf-8").splitlines()) <= 40, path.name
