"""Start-up times, best of five: printed, and a failure only at three times the limit, as machines differ."""

import subprocess
import sys
import time

python, fba = sys.argv[1:]
INSIDE = "import time; t = time.perf_counter(); import fba; print(time.perf_counter() - t)"


def import_time() -> float:
    return float(subprocess.run([python, "-c", INSIDE], capture_output=True, check=True).stdout)


def help_time() -> float:
    begin = time.perf_counter()
    subprocess.run([fba, "--help"], capture_output=True, check=True)
    return time.perf_counter() - begin


failed = False
for name, limit, measure in (("import fba", 0.1, import_time), ("fba --help", 0.25, help_time)):
    best = min(measure() for _ in range(5))
    verdict = "ok" if best <= limit else "slow" if best <= 3 * limit else "FAR TOO SLOW"
    failed |= best > 3 * limit
    print(f"{name}: {best:.3f} s (limit {limit} s): {verdict}")
sys.exit(failed)
