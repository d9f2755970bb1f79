"""A program that reads each hostile file in a process of its own, and prints time and memory as JSON.

`python measured_reading.py FOLDER SMALL LARGE`: sizes in bytes. It needs /proc, as Linux has.
"""

import gc
import json
import os
import signal
import sys
import time
import warnings
from pathlib import Path
from typing import Any

from hostile_files import HostileFile, hostile_files

SLOWER, SPARE_SECONDS = 8.0, 0.3
"""A file four times as long may take this many times as long, and this much more."""
REPEATS = 3
"""The least of so many times counts, if the first is too long."""
LONGEST = 60
"""Seconds after which a reader is ended."""


def main(folder: Path, sizes: tuple[int, int]) -> None:
    """Print a JSON list of name, bytes, seconds, peak memory in bytes and outcome, each for both sizes."""
    warnings.simplefilter("ignore")
    for file in hostile_files().values():  # whatever a reader needs only once is not counted
        _outcome(file, file.write(folder / "first", 200)[0])
    gc.collect()
    gc.freeze()  # so that the processes do not look through what was imported
    result = []
    for name, file in hostile_files().items():
        small, large = (_measure(file, folder / f"{name.replace(' ', '_')}-{size}", size) for size in sizes)
        for _ in range(REPEATS - 1):
            if large["seconds"] <= SLOWER * small["seconds"] + SPARE_SECONDS:
                break
            again = _measure(file, folder / f"{name.replace(' ', '_')}-{sizes[1]}", sizes[1])
            large["seconds"] = min(large["seconds"], again["seconds"])
        result.append({"name": name, "small": small, "large": large})
    json.dump(result, sys.stdout)


def _measure(file: HostileFile, folder: Path, size: int) -> dict[str, Any]:
    path, total = file.write(folder, size)
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        signal.alarm(LONGEST)
        Path("/proc/self/clear_refs").write_text("5")  # the peak counts from here
        before, start = _memory("VmRSS"), time.process_time()
        outcome = _outcome(file, path)
        seconds = time.process_time() - start
        answer = {"seconds": seconds, "memory": _memory("VmHWM") - before, "outcome": outcome}
        os.write(writing, json.dumps(answer).encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        said = pipe.read()
    os.waitpid(child, 0)
    ended = {"seconds": float(LONGEST), "memory": 0, "outcome": "was ended"}
    return {"bytes": total, **(json.loads(said) if said else ended)}


def _outcome(file: HostileFile, path: Path) -> str:
    """Return "" for a file that was read, or refused by an error of ours; else the other error."""
    from fba.errors import FbaError

    try:
        file.read(path)
    except FbaError:
        return ""
    except BaseException as error:
        return f"{type(error).__name__}: {error}"[:200]
    return ""


def _memory(key: str) -> int:
    """Return a number of bytes from this process's status."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(key)) * 1024


if __name__ == "__main__":
    main(Path(sys.argv[1]), (int(sys.argv[2]), int(sys.argv[3])))
