"""Machine code on disk: found again where it is whole and up to date, made anew where it is not."""

import importlib.util
import os
import random
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from fba.compiled import compilation_listener, is_compiled

pytestmark = pytest.mark.skipif(not is_compiled(), reason="nothing is compiled here")

SOURCE = """
from fba.compiled import compiled
from {helper} import helped, FACTOR

@compiled
def total(values, more):
    found = 0.0
    for k in range(len(values)):
        found += helped(values[k]) * FACTOR + more
    return found
"""
HELPER = """
from fba.compiled import inlined
FACTOR = {factor}
@inlined
def helped(value):
    return value {sign} 1
"""
PROGRAM = """
import sys
import numpy as np
{before}
from {name} import total
print(total(np.ones(3), 1))
"""


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., ModuleType]:
    """Loads the module of `SOURCE` anew, as another process would, with its machine code in tmp_path."""
    import numba

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.syspath_prepend(str(tmp_path))
    name, helper = f"loops_{tmp_path.name}", f"helper_{tmp_path.name}"

    def load(factor: float = 2.0, sign: str = "+") -> ModuleType:
        (tmp_path / f"{helper}.py").write_text(HELPER.format(factor=factor, sign=sign))
        (tmp_path / f"{name}.py").write_text(SOURCE.format(helper=helper))
        modules = []
        for one in (helper, name):
            spec = importlib.util.spec_from_file_location(one, tmp_path / f"{one}.py")
            assert spec.loader is not None
            modules.append(importlib.util.module_from_spec(spec))
            monkeypatch.setitem(sys.modules, one, modules[-1])
            exec(
                compile((tmp_path / f"{one}.py").read_text(), str(tmp_path / f"{one}.py"), "exec"),
                modules[-1].__dict__,
            )  # no stale .pyc
        from fba._numba_cache import _source

        _source.cache_clear()
        return modules[-1]

    return load


def compiled_and_called(module: ModuleType) -> tuple[float, int]:
    """The total of three ones, and how many functions were compiled for it."""
    import numpy as np

    heard_of: list[int] = []
    with compilation_listener(lambda: heard_of.append(1)):
        found = float(module.total(np.ones(3), 1.0))
    return found, len(heard_of)


def files(tmp_path: Path) -> list[Path]:
    return sorted((tmp_path / "cache").rglob("*.fbc"))


def test_what_was_compiled_is_found_again(program: Callable[..., ModuleType], tmp_path: Path) -> None:
    assert compiled_and_called(program()) == (15.0, 2)
    assert len(files(tmp_path)) == 2
    assert compiled_and_called(program()) == (15.0, 0)


def test_another_constant_or_helper_is_compiled_anew(program: Callable[..., ModuleType]) -> None:
    assert compiled_and_called(program())[0] == 15.0
    assert compiled_and_called(program(factor=3.0))[0] == 21.0
    assert compiled_and_called(program(sign="-"))[0] == 3.0


READS_BEYOND = """
import sys
import numpy as np
from fba.compiled import compilation_listener
from {name} import beyond
with compilation_listener(lambda: print("compiles")):
    print(beyond(np.arange(8.0)[:4], 6))
"""


@pytest.mark.parametrize("order", [("", "1"), ("1", "")])
def test_code_that_checks_bounds_and_code_that_does_not_are_kept_apart(
    tmp_path: Path, order: tuple[str, str]
) -> None:
    source = (
        "from fba.compiled import compiled\n\n@compiled\ndef beyond(values, at):\n    return values[at]\n"
    )
    (tmp_path / "reads_beyond.py").write_text(source)

    def run(checked: str) -> tuple[bool, bool]:
        """Whether the function was compiled, and whether it refused a place behind the end."""
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(tmp_path)}
        environment.pop("NUMBA_BOUNDSCHECK", None)
        environment |= {"NUMBA_BOUNDSCHECK": checked} if checked else {}
        done = subprocess.run(
            [sys.executable, "-c", READS_BEYOND.format(name="reads_beyond")],
            env=environment, capture_output=True, text=True, timeout=300, check=False,
        )  # fmt: skip
        assert ("IndexError" in done.stderr) == (done.returncode != 0), done.stderr
        return "compiles" in done.stdout, "IndexError" in done.stderr

    assert [run(checked) for checked in (*order, *order)] == [
        (True, order[0] == "1"), (True, order[1] == "1"), (False, order[0] == "1"), (False, order[1] == "1"),
    ]  # fmt: skip


@pytest.mark.parametrize("fault", ["cut", "empty", "garbage", "flipped", "folder", "unreadable", "other"])
def test_a_faulty_file_is_made_anew(program: Callable[..., ModuleType], tmp_path: Path, fault: str) -> None:
    assert compiled_and_called(program()) == (15.0, 2)
    for path in files(tmp_path):
        good = path.read_bytes()
        if fault == "folder":
            path.unlink()
            path.mkdir()
        elif fault == "unreadable":
            path.chmod(0)
        else:
            bad = {
                "cut": good[: len(good) // 2],
                "empty": b"",
                "garbage": bytes(reversed(good)),
                "flipped": good[:-100] + bytes([good[-100] ^ 4]) + good[-99:],
                "other": files(tmp_path)[0].read_bytes(),
            }[fault]
            path.write_bytes(bad)
    assert compiled_and_called(program())[0] == 15.0
    if fault in ("cut", "empty", "garbage", "flipped"):
        assert compiled_and_called(program()) == (15.0, 0)


def test_no_flipped_bit_is_loaded(program: Callable[..., ModuleType], tmp_path: Path) -> None:
    from fba._numba_cache import CodeFiles

    module = program()
    compiled_and_called(module)
    function = module.total.py_func
    store = CodeFiles(str(tmp_path), "one", function)
    store.save("key", {"code": bytes(range(256)) * 20})
    assert store.load("key") == {"code": bytes(range(256)) * 20}
    (path,) = tmp_path.glob("one.*.fbc")
    good = path.read_bytes()
    for bit in random.Random(7).sample(range(8 * len(good)), 2000):
        bad = bytearray(good)
        bad[bit // 8] ^= 1 << bit % 8
        path.write_bytes(bad)
        assert store.load("key") is None, bit
    for length in range(0, len(good), 50):
        path.write_bytes(good[:length])
        assert store.load("key") is None, length


def ran(tmp_path: Path, before: str, **environment: str) -> Any:
    code = PROGRAM.format(before=before, name=f"loops_{tmp_path.name}")
    given = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), **environment}
    given["PYTHONPATH"] = os.pathsep.join([str(tmp_path), *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", code], env=given, capture_output=True, text=True, check=False
    )
    return done.stdout, done.stderr


@pytest.mark.skipif(os.name == "nt", reason="limits of POSIX")
def test_no_room_on_the_disk_is_no_error(program: Callable[..., ModuleType], tmp_path: Path) -> None:
    program()
    before = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))"
    assert ran(tmp_path, before, PYTHONDONTWRITEBYTECODE="1") == ("15.0\n", "")
    assert not [path for path in (tmp_path / "cache").rglob("*") if path.is_file()]


def test_a_file_in_place_of_the_folder_is_no_error(
    program: Callable[..., ModuleType], tmp_path: Path
) -> None:
    program()
    (tmp_path / "cache").write_text("in the way")
    assert ran(tmp_path, "") == ("15.0\n", "")


def test_no_listener_hears_after_its_block(program: Callable[..., ModuleType]) -> None:
    heard_of: list[int] = []
    with compilation_listener(lambda: heard_of.append(1)):
        pass
    compiled_and_called(program())
    assert heard_of == []
