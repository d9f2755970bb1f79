"""Ctrl-C at the worst moments."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fba.compiled import is_compiled
from started_programs import started

IN_A_CALLBACK = """
import ctypes, signal, sys, time
import fba.cli.commands.info
from fba.cli.main import group, main
callback = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))
signal.signal(signal.SIGINT, signal.default_int_handler)

@group.command("long")
def long():
    callback()
    {afterwards}
    print("done")

group.get_command = lambda context, name: long
main(["long"])
"""


IMPORTING = """
import signal, sys
class Finder:
    def find_spec(self, name, path, target=None):
        if name == "{module}":
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Finder())
signal.signal(signal.SIGINT, signal.{handler})
sys.argv = ["fba", "info", "--help"]
from fba.__main__ import main
main()
"""

ENDING = """
import atexit, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.argv = ["fba", "--version"]
from fba.__main__ import main
atexit.register(signal.raise_signal, signal.SIGINT)
main()
"""


LOADING = """
import signal, sys, time
from fba.cli.main import group, main
signal.signal(signal.SIGINT, signal.default_int_handler)
steps = []
names = {"signal": signal, "steps": steps, "__name__": "llvmlite.binding.executionengine"}
exec("def load():\\n signal.raise_signal(signal.SIGINT)\\n steps.append('loaded')", names)

@group.command("long")
def long():
    names["load"]()
    while True:
        time.sleep(0.01)

group.get_command = lambda context, name: long
try:
    main(["long"])
finally:
    print(*steps)
"""


SWALLOWED = """
import signal, sys, time
from fba.cli import interruptions
from fba.cli.main import group, main
interruptions.CHECK_AFTER = 0.1
signal.signal(signal.SIGINT, signal.default_int_handler)

@group.command("long")
def long():
    try:
        signal.raise_signal(signal.SIGINT)
    except:
        pass
    try:
        time.sleep(100)
    finally:
        time.sleep(0.3)
        print("cleaned up")

group.get_command = lambda context, name: long
main(["long"])
"""


def ran(code: str) -> tuple[int, str, str]:
    command = [sys.executable, "-c", code]
    result = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    return result.returncode, result.stdout, result.stderr


@pytest.mark.parametrize(
    "module",
    ["fba.cli.main", "click", "inspect", "fba.cli.interruptions", "fba.cli.options", "fba.cli.commands.info"],
)
def test_ctrl_c_while_the_program_is_imported_leaves_no_traceback(module: str) -> None:
    code, out, err = ran(IMPORTING.format(module=module, handler="default_int_handler"))
    assert (code, out, err.strip()) == (130, "", "fba: interrupted")


def test_a_program_that_shall_ignore_ctrl_c_ignores_it() -> None:
    code, out, err = ran(IMPORTING.format(module="click", handler="SIG_IGN"))
    assert (code, err) == (0, "")
    assert out.startswith("Usage: ")


def test_ctrl_c_while_the_program_ends_leaves_no_traceback() -> None:
    code, _, err = ran(ENDING)
    assert (code, err) == (130, "fba: interrupted\n")


def test_fragile_work_is_finished_before_the_end() -> None:
    command = [sys.executable, "-c", LOADING]
    result = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert (result.returncode, result.stdout.strip(), result.stderr.strip()) == (
        130, "loaded", "fba: interrupted",
    )  # fmt: skip


@pytest.mark.parametrize(
    "afterwards",
    [
        pytest.param("[time.sleep(0.01) for _ in range(1000)]", id="work goes on"),
        pytest.param("raise RuntimeError('the callback did not do its work')", id="what needed it fails"),
        pytest.param(
            "raise SystemError('a result with an exception set') from KeyboardInterrupt()", id="cause"
        ),
    ],
)
def test_ctrl_c_inside_a_callback_of_c_code_is_not_lost(afterwards: str) -> None:
    code = IN_A_CALLBACK.format(afterwards=afterwards)
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60
    )
    assert (result.returncode, result.stdout, result.stderr.strip()) == (130, "", "fba: interrupted")


def test_ctrl_c_that_a_library_swallows_comes_again_and_disturbs_no_cleaning_up() -> None:
    assert ran(SWALLOWED) == (130, "cleaned up\n", "\nfba: interrupted\n")


CAPTURING = """
import os, signal, sys
def interrupt(*_):
    signal.raise_signal(signal.{name})
def interrupt_llvm():
    # as where LLVM loads machine code: nothing can be raised there
    exec("interrupt()", {{"interrupt": interrupt, "__name__": "llvmlite.binding"}})
class Finder:
    def find_spec(self, name, path, target=None):
        if name == "{module}":
            interrupt()
sys.meta_path.insert(0, Finder())
signal.signal(signal.SIGINT, signal.default_int_handler)
{place}
sys.argv = ["fba", "capture", "livelink", "--port", "0", "--host", "127.0.0.1", "-o", "out.fba"]
from fba.__main__ import main
main()
"""
COMPILES = "import fba.compiled; fba.compiled._listeners.append(interrupt)"
LOADS = """
import fba._numba_cache
load = fba._numba_cache.MachineCode.load_overload
def loaded(*arguments):
    interrupt_llvm()
    return load(*arguments)
fba._numba_cache.MachineCode.load_overload = loaded
"""
LAST = """
import fba.live.recording
warm_up = fba.live.recording.warm_up
def warmed(*targets, **options):
    warm_up(*targets, **options)
    interrupt_llvm()
fba.live.recording.warm_up = warmed
"""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize(
    ("module", "place"),
    [
        pytest.param("fba.cli.commands.live.capture", "", id="imports"),
        pytest.param("fba.live.recording", "", id="later imports"),
        pytest.param("", COMPILES, id="compiling"),
        pytest.param("", LOADS, id="loading machine code"),
        pytest.param("", LAST, id="just before it listens"),
    ],
)
@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of Unix")
def test_a_capture_ends_however_early_the_signal_comes(
    tmp_path: Path, name: str, module: str, place: str
) -> None:
    if place and not is_compiled():
        pytest.skip("nothing is compiled here")
    environment = {**os.environ, "FBA_CACHE": str(tmp_path)}
    if place == COMPILES:
        environment["NUMBA_CACHE_DIR"] = str(tmp_path / "numba")  # empty
    code = CAPTURING.format(name=name, module=module, place=place)
    with started([sys.executable, "-c", code], cwd=tmp_path, env=environment) as program:
        _, err = program.communicate()
    text, status = ("interrupted", 130) if name == "SIGINT" else ("terminated", 143)
    assert (program.returncode, err.strip().splitlines()[-1]) == (status, f"fba: {text}"), err
    assert "listening" not in err
    assert not (tmp_path / "out.fba").exists()
