"""What is said while a command takes long: that it compiles, and how far it is.

What the program sets to start sooner does no harm, and stays within its own process.
"""

import io
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import fba
from command_line import Run
from fba import Animation
from fba.cli.main import COMPILED_FUNCTIONS, CompileNotice
from fba.cli.printing import Progress
from fba.compiled import is_compiled

COLLECTED = """
import gc, weakref
from fba.cli import startup
startup.collect_less()
class Cycle: pass
cycle = Cycle()
cycle.itself, gone = cycle, weakref.ref(cycle)
del cycle
print(gone() is None)
kept = [[] for _ in range(gc.get_threshold()[0] + 1000)]
print(gone() is None)
"""

MAIN = """
import gc
from fba.cli import main
before = gc.get_threshold()
try:
    main.main(["--version"])
finally:
    print(gc.get_threshold() == before)
"""


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def on_terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Standard error as a terminal; in the test itself, since pytest sets it again before each."""
    found = Terminal()
    monkeypatch.setattr(sys, "stderr", found)
    monkeypatch.setenv("TERM", "xterm")
    return found


def test_compiling_is_said_once_and_only_where_it_takes_long(capsys: pytest.CaptureFixture[str]) -> None:
    notice = CompileNotice("render")
    for _ in range(COMPILED_FUNCTIONS - 1):
        notice()
    assert capsys.readouterr().err == ""
    for _ in range(50):
        notice()
    assert capsys.readouterr().err == "fba: compiling, once (up to about 35 s)\n"


@pytest.mark.slow
@pytest.mark.skipif(not is_compiled(), reason="nothing is compiled here")
def test_the_first_use_says_that_it_compiles_the_second_does_not(tmp_path: Path, face: Animation) -> None:
    fba.write(tmp_path / "face.fba", face)
    command = [sys.executable, "-m", "fba", "stats", str(tmp_path / "face.fba")]  # which compiles least
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "numba"), "FBA_CACHE": str(tmp_path)}
    first, second = (
        subprocess.run(command, env=environment, capture_output=True, text=True, check=True) for _ in range(2)
    )
    assert first.stderr.count("compiling, once") == 1
    assert second.stderr == ""
    assert first.stdout == second.stdout


def until_drawn(terminal: Terminal, text: str) -> None:
    """Wait until the bar, which another thread draws again and again, shows a text."""
    end = time.monotonic() + 60
    while text not in terminal.getvalue():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_bar_without_a_total_only_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = on_terminal(monkeypatch)
    with Progress("fitting", None):
        until_drawn(terminal, "0:00:00")
    assert "fitting" in terminal.getvalue()
    assert "/?" not in terminal.getvalue()
    assert "0:00:00" in terminal.getvalue()


def test_a_bar_counts_as_soon_as_the_total_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = on_terminal(monkeypatch)
    with Progress("rendering", None) as step:
        step.show(3, 8)
        until_drawn(terminal, "3/8")


@pytest.mark.skipif(sys.platform != "linux", reason="only X11 and Wayland can be absent")
def test_without_a_display_nothing_else_is_tried(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("glfw")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    (tmp_path / "broken.fba").write_bytes(b"nothing")
    refused = run("play", tmp_path / "broken.fba", code=1)
    assert "DISPLAY" in refused.err
    assert "broken" not in refused.err


def ran(code: str) -> list[str]:
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return result.stdout.split()


def test_a_process_that_calls_main_stays_as_it_is() -> None:
    assert ran(MAIN)[-1] == "True"


def test_garbage_is_still_collected() -> None:
    assert ran(COLLECTED) == ["False", "True"]
