"""Ctrl-C at the worst moments."""

from __future__ import annotations

import subprocess
import sys

import pytest

IN_A_CALLBACK = """
import ctypes, signal, sys, time
import fba.cli.info
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


def test_what_must_not_be_left_halfway_is_finished_first() -> None:
    command = [sys.executable, "-c", LOADING]
    result = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
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
