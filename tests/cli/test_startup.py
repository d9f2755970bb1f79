"""What the program leaves out to start sooner is there for others, and is not missed."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec

import pytest

COMPILED = """
import sys
from fba.cli._startup import hasten
hasten()
import numba
assert numba.njit(lambda array: array.sum())(__import__("numpy").arange(4.0)) == 6
print(*(name in sys.modules for name in ("scipy.linalg", "cffi", "numba.np.arraymath")))
import numba.np.arraymath
assert numba.np.arraymath.__loader__ is numba.np.arraymath.__spec__.loader
assert numba.np.arraymath.__loader__.get_source("numba.np.arraymath")
import scipy.linalg
print(scipy.linalg.det([[2.0, 0.0], [0.0, 3.0]]))
"""

COLLECTED = """
import gc, weakref
from fba.cli import startup
usual = gc.get_threshold()
startup.hasten()
print(gc.get_threshold() == usual)
kept = [[] for _ in range(startup.MANY * (startup.OFTEN + 1))]
print(gc.get_threshold() == usual, gc.callbacks)
class Cycle: pass
cycle = Cycle()
cycle.itself, gone = cycle, weakref.ref(cycle)
del cycle
kept += [[] for _ in range(2 * usual[0])]
print(gone() is None)
"""

MAIN = """
import gc, sys
from fba.cli import main
before = gc.get_threshold(), list(sys.meta_path)
main.group.callback = lambda: None
try:
    main.main(["--version"])
finally:
    print((gc.get_threshold(), list(sys.meta_path)) == before)
"""


def ran(code: str) -> list[str]:
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return result.stdout.split()


@pytest.mark.skipif(find_spec("numba") is None or find_spec("scipy") is None, reason="needs numba and scipy")
def test_numba_comes_without_what_no_loop_needs() -> None:
    assert ran(COMPILED) == ["False", "False", "True", "6.0"]


def test_a_process_that_calls_main_stays_as_it_is() -> None:
    assert ran(MAIN)[-1] == "True"


def test_after_the_start_garbage_is_collected_as_ever() -> None:
    assert ran(COLLECTED) == ["False", "True", "[]", "True"]
