"""The recorder: its thread, what it does when things go wrong, and that nothing is left half-written."""

import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from fba.errors import FormatError, UnsupportedError
from fba_player.export._recorder import MAX_WAITING_PICTURES, Recorder

pytest.importorskip("av")

SIZE = (16, 16)
BLACK = np.zeros((16, 16, 4), dtype=np.uint8)


class Slow:
    """A sink whose first picture waits until it is told to go on."""

    def __init__(self) -> None:
        self.go, self.busy = threading.Event(), threading.Event()
        self.stopped = False
        self.numbers: list[int] = []
        self.aborted = 0

    def write(self, pixels: np.ndarray, number: int) -> None:
        self.busy.set()
        assert self.go.wait(20)
        self.numbers.append(number)

    def finish(self, count: int) -> Path:
        return Path(str(count))

    def abort(self) -> None:
        self.aborted += 1


class Full(Slow):
    """A sink that finds the disk full at its third picture."""

    def write(self, pixels: np.ndarray, number: int) -> None:
        if number == 2:
            raise FormatError("could not be written: No space left on device", path="a.mp4")


def test_a_window_does_not_wait(tmp_path: Path) -> None:
    sink = Slow()
    recorder = Recorder(tmp_path / "x", SIZE, rate=10, sink=sink)
    taken = [recorder.add(BLACK, number / 10, wait=False) for number in range(MAX_WAITING_PICTURES + 3)]
    assert taken == [True] * MAX_WAITING_PICTURES + [False] * 3
    assert recorder.dropped == 3
    assert recorder.frames == MAX_WAITING_PICTURES
    sink.go.set()
    assert recorder.close() == Path(str(MAX_WAITING_PICTURES))
    assert sink.numbers == list(range(MAX_WAITING_PICTURES))


def test_waiting_adds_every_picture(tmp_path: Path) -> None:
    sink = Slow()
    threading.Timer(0.05, sink.go.set).start()
    with Recorder(tmp_path / "x", SIZE, rate=10, sink=sink) as recorder:
        assert all(recorder.add(BLACK) for _ in range(3 * MAX_WAITING_PICTURES))
    assert sink.numbers == list(range(3 * MAX_WAITING_PICTURES))
    assert sink.aborted == 0


def test_pictures_are_copied(tmp_path: Path) -> None:
    seen = []

    class Looking(Slow):
        def write(self, pixels: np.ndarray, number: int) -> None:
            super().write(pixels, number)
            seen.append(int(pixels[0, 0, 0]))

    sink, pixels = Looking(), BLACK.copy()
    with Recorder(tmp_path / "x", SIZE, rate=10, sink=sink) as recorder:
        for value in range(4):
            pixels[:] = value
            recorder.add(pixels)
        sink.go.set()
    assert seen == [0, 1, 2, 3]


def test_what_the_encoder_met_is_raised_soon_and_at_the_end(tmp_path: Path) -> None:
    sink = Full()
    recorder = Recorder(tmp_path / "x", SIZE, rate=10, sink=sink)

    def many() -> None:
        for _ in range(10 * MAX_WAITING_PICTURES):
            recorder.add(BLACK)
            time.sleep(0.001)

    with pytest.raises(FormatError, match="No space left"):
        many()
    assert sink.aborted == 1
    recorder.close()
    other = Recorder(tmp_path / "x", SIZE, rate=10, sink=Full())
    for _ in range(3):
        other.add(BLACK)
    with pytest.raises(FormatError, match="No space left"):
        other.close()


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_an_aborted_or_failed_film_leaves_the_old_file(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(b"old")
    recorder = Recorder(path, SIZE)
    recorder.add(BLACK)
    recorder.abort()
    recorder.abort()
    with pytest.raises(ValueError, match="finite"), Recorder(path, SIZE) as second:
        second.add(BLACK, float("inf"))
    assert recorder.close() is None
    with pytest.raises(ValueError, match="closed"):
        recorder.add(BLACK)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_without_a_picture_there_is_no_film(tmp_path: Path, name: str) -> None:
    recorder = Recorder(tmp_path / name, SIZE)
    assert recorder.close() is None
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_closing_after_a_picture_makes_a_film(tmp_path: Path, name: str) -> None:
    recorder = Recorder(tmp_path / name, SIZE)
    recorder.add(BLACK, 0)
    assert recorder.close() == tmp_path / name
    assert recorder.close() == tmp_path / name
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).stat().st_size > 50


def test_impossible_paths_and_sizes_are_refused(tmp_path: Path) -> None:
    (tmp_path / "folder.mp4").mkdir()
    with pytest.raises(FormatError, match="folder"):
        Recorder(tmp_path / "folder.mp4", SIZE)
    with pytest.raises(FormatError, match="No such file"):
        Recorder(tmp_path / "nowhere" / "a.gif", SIZE)
    with pytest.raises(UnsupportedError, match=r"\.mp4 or \.gif"):
        Recorder(tmp_path / "a.avi", SIZE)
    for size, rate, text in (((1, 1), 25, "2x2"), (SIZE, 0, "above 0"), (SIZE, 1001, "at most at 1000")):
        with pytest.raises(ValueError, match=text):
            Recorder(tmp_path / "a.mp4", size, rate=rate)
    with pytest.raises(ValueError, match="finite"), Recorder(tmp_path / "a.mp4", SIZE) as recorder:
        recorder.add(BLACK, float("nan"))
    assert [path.name for path in tmp_path.iterdir()] == ["folder.mp4"]


FORGET = """
import sys
import numpy as np
from fba_player.export._recorder import Recorder
recorder = Recorder(sys.argv[1], (16, 16))
recorder.add(np.zeros((16, 16, 4), dtype=np.uint8))
"""


def test_a_recorder_left_open_leaves_no_file(tmp_path: Path) -> None:
    script = [sys.executable, "-c", FORGET, str(tmp_path / "a.mp4")]
    done = subprocess.run(script, capture_output=True, text=True, timeout=300, check=True)
    assert done.stderr == ""
    assert list(tmp_path.iterdir()) == []


FILL = """
import resource, signal, sys
import numpy as np
from fba.errors import FbaError
from fba_player.export._recorder import Recorder
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
noise = np.random.default_rng(1).integers(0, 256, (64, 64, 4), dtype=np.uint8)
recorder = Recorder(sys.argv[1], (64, 64))
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))  # the disk is full after 4 KiB
try:
    for number in range(90):
        recorder.add(np.roll(noise, number, 0))
    recorder.close()
except FbaError as error:
    print(type(error).__name__, error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of file sizes are those of Unix")
@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_no_room_is_a_clear_error(tmp_path: Path, name: str) -> None:
    script = [sys.executable, "-c", FILL, str(tmp_path / name)]
    done = subprocess.run(script, capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout.startswith(f"FormatError {tmp_path / name}: could not be written: File too large")
    assert list(tmp_path.iterdir()) == []
