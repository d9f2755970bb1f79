"""The programs that start at once do what the installed ones do."""

import os
import subprocess
from pathlib import Path

import pytest

from ready_programs import BIN, ROOT


def sh(programs: Path, command: str, folder: Path) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a shell's command; "IN" leads to the samples."""
    done = subprocess.run(
        ["sh", "-c", command.replace("IN", str(ROOT / "fba" / "samples"))],
        cwd=folder, env={**os.environ, "WORD": "spoken", "PATH": f"{programs}:{os.environ['PATH']}"},
        input="print('typed')\n", capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    "command",
    [
        "fba info IN/hello.fap; echo $?; fba info missing.fap; echo $?; fba --nonsense",
        "fba encode IN/hello.fap -o one.fba && fba decode one.fba --fap - | fba info - | head -n 2; ls",
        "python -c 'import os, sys; print(os.environ[\"WORD\"], sys.argv, os.getcwd()); sys.exit(\"n\")'",
        "python -c 'print(1 // 0)' 2>&1 | tail -n 1",
        'python -c \'import sys; print("fba" in sys.modules, "tests" in "".join(sys.path)); import fba\'',
        "python; python -m fba --version; echo 'import sys; print(sys.argv)' >one.py; python one.py x",
    ],
)  # fmt: skip
def test_the_same_as_the_installed_one(programs: Path, tmp_path: Path, command: str) -> None:
    found = []
    for number, one in enumerate((BIN, programs)):
        folder = tmp_path / str(number)
        folder.mkdir()
        code, out, err = sh(one, command, folder)
        found.append((code, out.replace(str(folder), "."), err))
    assert found[0] == found[1]


def test_settings_that_change_what_is_imported_start_a_program_of_its_own(
    programs: Path, tmp_path: Path
) -> None:
    show = "python -c 'from fba.compiled import is_compiled; print(is_compiled())'"
    assert sh(programs, f"NUMBA_DISABLE_JIT=1 {show}; {show}", tmp_path)[1] in {
        "False\nTrue\n",
        "False\nFalse\n",
    }
