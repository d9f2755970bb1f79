"""How soon there is something to see: a picture in a file, or a window with its first picture and all panels;
and how long importing fba and `fba --help` take.

Each is a process of its own. Warm: compiled code and what is kept of models are on disk already. Cold: both
folders are empty, as on the first run; Python's own compiled modules are there.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from statistics import median
from typing import Any

import pytest

SAMPLES = ("hello.fap", "hello.bvh")
WARM = 2
"""Runs that do not count: the second is the first that finds everything."""
WINDOW = """
import os, sys
import glfw
from fba.cli.main import main

def shown(window, swap=glfw.swap_buffers):
    swap(window)
    os._exit(0)

glfw.swap_buffers = shown
main()
os._exit(1)
"""
"""`fba play` until its first picture is on the screen."""


@pytest.fixture
def display() -> Iterator[str]:
    """A virtual display."""
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed")
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1600x1000x24"]
    quiet = subprocess.DEVNULL
    server = subprocess.Popen(command, pass_fds=[write], stdout=quiet, stderr=quiet)
    os.close(write)
    try:
        with os.fdopen(read) as pipe:
            number = pipe.readline().strip()
        if not number:
            pytest.skip("Xvfb did not start")
        yield f":{number}"
    finally:
        server.terminate()
        server.wait(10)


@pytest.mark.parametrize("name", SAMPLES)
def test_first_picture(benchmark: Any, name: str, report: Callable[[str], None], tmp_path: Path) -> None:
    pytest.importorskip("PIL")
    command = ["-m", "fba", "render", str(files("fba") / "samples" / name), "-o", str(tmp_path / "one.png")]
    took, spent = measured(benchmark, command, {})
    report(f"first picture of {name}: {took:.2f} s, of the processors {spent:.2f} s")
    assert spent < 30


@pytest.mark.parametrize("name", SAMPLES)
def test_first_picture_ever(benchmark: Any, name: str, report: Callable[[str], None], tmp_path: Path) -> None:
    """Cold, once: nothing compiled, nothing kept of any model."""
    pytest.importorskip("PIL")
    command = ["-m", "fba", "render", str(files("fba") / "samples" / name), "-o", str(tmp_path / "one.png")]
    empty = {"NUMBA_CACHE_DIR": str(tmp_path / "compiled"), "FBA_CACHE": str(tmp_path / "kept")}
    took, spent = measured(benchmark, command, empty, warm=0, rounds=1)
    assert any(path.is_file() for path in (tmp_path / "kept").rglob("*"))  # it did start with empty folders
    report(
        f"first picture of {name}, nothing compiled or kept: {took:.1f} s, of the processors {spent:.1f} s"
    )


def test_import(benchmark: Any, report: Callable[[str], None]) -> None:
    """The import alone, without the start of Python."""
    code = "import time; start = time.perf_counter(); import fba; print(time.perf_counter() - start)"
    times: list[float] = []

    def one() -> None:
        run = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
        times.append(float(run.stdout))

    benchmark.pedantic(one, rounds=11, warmup_rounds=WARM)
    took = median(times[WARM:])
    benchmark.extra_info.update(milliseconds=took * 1e3)
    report(f"import fba: {took * 1e3:.1f} ms")


def test_help(benchmark: Any, report: Callable[[str], None]) -> None:
    took, spent = measured(benchmark, ["-m", "fba", "--help"], {}, rounds=11)
    report(f"fba --help: {took:.2f} s, of the processors {spent:.2f} s")


@pytest.mark.parametrize("name", SAMPLES)
def test_first_picture_in_a_window(
    benchmark: Any, name: str, report: Callable[[str], None], display: str
) -> None:
    pytest.importorskip("imgui_bundle", exc_type=ImportError)
    command = ["-c", WINDOW, "play", str(files("fba") / "samples" / name)]
    took, spent = measured(benchmark, command, {"DISPLAY": display})
    report(f"window with {name}: {took:.2f} s, of the processors {spent:.2f} s")
    assert spent < 30


def measured(
    benchmark: Any, arguments: list[str], more: dict[str, str], *, warm: int = WARM, rounds: int = 5
) -> tuple[float, float]:
    """Seconds until Python has ended, and seconds of all processors: medians. Skips where it fails."""
    environment = {**os.environ, **more}
    for name in ("PYTHONDONTWRITEBYTECODE", "WAYLAND_DISPLAY"):
        environment.pop(name, None)
    command = [sys.executable, *arguments]
    for _ in range(warm):
        if subprocess.run(command, capture_output=True, check=False, env=environment).returncode:
            pytest.skip("no picture can be made here")
    spent = []

    def one() -> None:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, capture_output=True, check=True, env=environment)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)

    benchmark.pedantic(one, rounds=rounds)
    took = median(benchmark.stats.stats.data)
    benchmark.extra_info.update(seconds=took, processors=median(spent))
    return took, median(spent)
