"""What the program sets to start sooner does no harm, and stays within its own process."""

import subprocess
import sys

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


def ran(code: str) -> list[str]:
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return result.stdout.split()


def test_a_process_that_calls_main_stays_as_it_is() -> None:
    assert ran(MAIN)[-1] == "True"


def test_garbage_is_still_collected() -> None:
    assert ran(COLLECTED) == ["False", "True"]
