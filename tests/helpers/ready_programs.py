"""`fba` and `python` on the PATH of a test, that start at once: each run is a fork of a process that has
imported everything already.

A run has its own process, folder, environment, standard streams and exit code, as if it were started anew; of
a start, only the imports are spared, and for `fba` the loading of machine code. `python` starts without any
module of this project, so that what a script forgets to import is missing. A run whose environment could
change what was imported (`NUMBA_...`, `PYTHON...`, `FBA_...`), or a Python with other options than -c and -m,
is started as usual.
"""

import atexit
import contextlib
import json
import os
import runpy
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import types
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent
FOREIGN = (
    "numpy", "numba", "scipy.interpolate", "scipy.optimize", "scipy.sparse.csgraph", "scipy.sparse.linalg",
    "scipy.spatial.transform", "click",
    "moderngl", "av", "PIL.Image", "PIL.PngImagePlugin",
)  # fmt: skip
"""Modules of others that both programs find imported, those of them that are installed."""

SHIM = """\
#!{python} -IS
import json, os, socket, sys
mine = {{key: value for key, value in os.environ.items() if key.startswith(("NUMBA", "PYTHON", "FBA"))}}
if mine != {settings!r} or {name!r} == "python" and sys.argv[1:2] and sys.argv[1][:1] == "-" \\
        and sys.argv[1] not in ("-c", "-m"):
    os.execv({real!r}, [{real!r}, *sys.argv[1:]])
server = socket.socket(socket.AF_UNIX)
server.connect({address!r})
what = json.dumps([sys.argv, os.getcwd(), dict(os.environ)]).encode()
socket.send_fds(server, [len(what).to_bytes(8, "big")], [0, 1, 2])
server.sendall(what)
sys.exit(int(server.recv(16) or b"70"))  # 70: the run ended without a word
"""


@contextlib.contextmanager
def ready_programs() -> Iterator[Path]:
    """A folder for the PATH with `fba` and `python`, as long as the block runs."""
    if not (hasattr(os, "fork") and hasattr(socket, "send_fds") and sys.platform == "linux"):
        yield BIN
        return
    folder = Path(tempfile.mkdtemp(prefix="ready-"))
    (folder / "bin").mkdir()
    command = [sys.executable, str(Path(__file__)), str(folder)]
    server = subprocess.Popen(
        command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, start_new_session=True
    )
    try:
        assert server.stdout.readline() == b"ready\n", "the ready programs did not start"
        settings = {
            key: value for key, value in os.environ.items() if key.startswith(("NUMBA", "PYTHON", "FBA"))
        }
        for name in ("fba", "python"):
            shim = folder / "bin" / name
            shim.write_text(SHIM.format(
                python=os.path.realpath(sys.executable), name=name, settings=settings,
                real=str(BIN / name), address=str(folder / name),
            ))  # fmt: skip
            shim.chmod(0o755)
        yield folder / "bin"
    finally:
        os.killpg(server.pid, signal.SIGTERM)  # a session of its own: both servers and whatever still runs
        server.wait(10)
        if server.stdout is not None:
            server.stdout.close()
        shutil.rmtree(folder, ignore_errors=True)


def prepare() -> None:
    """Import all that the command line may need, and run a little of it."""
    import click

    from fba.cli.main import _COMMANDS, group

    for name in _COMMANDS:
        group.get_command(click.Context(group), name)
    import numpy as np

    import fba
    from fba import player
    from fba.face import Deformer, FaceModel

    for name in player.__all__:
        with contextlib.suppress(ImportError):  # pyrender
            getattr(player, name)
    for name in fba.__all__:
        getattr(fba, name)
    samples = ROOT / "fba" / "samples"
    Deformer(FaceModel.default())(np.zeros(68))
    for sample in (fba.read(samples / "hello.fap"), fba.read(samples / "hello.bvh")):
        fba.decode(fba.encode(sample))
        for view in ("figure", "points"):
            player.Scene(sample, view=view).view_at(0.5)


def serve(door: socket.socket, program: str) -> None:
    """Fork for every run that is asked for. Does not return."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for the forks below
    while True:
        caller, _ = door.accept()
        if os.fork() == 0:
            door.close()
            attend(caller, program)
        caller.close()


def attend(caller: socket.socket, program: str) -> None:
    """Run what a caller asks for in one more fork, and tell its exit code. Does not return."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    head, streams, _, _ = socket.recv_fds(caller, 8, 3)
    size = int.from_bytes(head, "big")
    with caller.makefile("rb") as file:
        arguments, folder, environment = json.loads(file.read(size))
    run = os.fork()
    if run == 0:
        caller.close()
        os._exit(work(program, arguments, folder, environment, streams))
    code = os.waitstatus_to_exitcode(os.waitpid(run, 0)[1])
    with contextlib.suppress(OSError):  # who called is gone
        caller.sendall(str(code if code >= 0 else 128 - code).encode())
    os._exit(0)


def work(
    program: str, arguments: list[str], folder: str, environment: dict[str, str], streams: list[int]
) -> int:
    """Run one of the programs in this process: its exit code."""
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    sys.stdin, sys.stdout = open(0, closefd=False), open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", buffering=1, errors="backslashreplace", closefd=False)  # noqa: SIM115
    sys.__stdin__, sys.__stdout__, sys.__stderr__ = sys.stdin, sys.stdout, sys.stderr
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    code: object = 0
    try:
        if program == "fba":
            from fba.__main__ import main

            sys.argv = arguments
            main()
        else:
            interpret(arguments[1:])
    except SystemExit as stop:
        code = stop.code
        if not isinstance(code, int | None):
            sys.stderr.write(f"{code}\n")
            code = 1
    except BaseException:
        sys.excepthook(*sys.exc_info())
        code = 1
    atexit._run_exitfuncs()
    try:
        sys.stdout.flush()
    except OSError:
        code = 120
    return int(code or 0)  # type: ignore[call-overload, no-any-return]


def interpret(arguments: list[str]) -> None:
    """`python -c CODE`, `python -m MODULE` or `python FILE`, each with arguments."""
    if arguments[:1] == ["-m"]:
        sys.argv = arguments[1:]
        sys.path[0] = os.getcwd()
        runpy.run_module(arguments[1], run_name="__main__", alter_sys=True)
    elif arguments[:1] == ["-c"]:
        sys.argv = ["-c", *arguments[2:]]
        sys.path[0] = ""
        module = types.ModuleType("__main__")
        sys.modules["__main__"] = module
        exec(compile(arguments[1], "<string>", "exec"), vars(module))
    else:
        sys.argv = arguments or [""]
        sys.path[0] = os.path.dirname(os.path.abspath(sys.argv[0]))
        source = Path(arguments[0]).read_bytes() if arguments else sys.stdin.read()
        module = types.ModuleType("__main__")
        module.__file__ = sys.argv[0]
        sys.modules["__main__"] = module
        exec(compile(source, sys.argv[0] or "<stdin>", "exec"), vars(module))


def start(folder: Path) -> None:
    """The servers of one folder: two processes, of which only one knows this project. Does not return."""
    sys.path[0] = ""  # not tests/, which a reader does not have
    doors = {}
    for name in ("fba", "python"):
        doors[name] = socket.socket(socket.AF_UNIX)
        doors[name].bind(str(folder / name))
        doors[name].listen(16)
    for name in FOREIGN:
        with contextlib.suppress(ImportError):
            import_module(name)
    with contextlib.suppress(ImportError):
        import numba

        numba.njit(lambda number: number)(0)  # its own tables, which it fills before the first function
    assert not {"fba", "fba_player", "fba_conformance"} & set(sys.modules)
    out = os.dup(1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    if os.fork() == 0:
        doors.pop("python").close()
        prepare()
        os.write(out, b"ready\n")
        os.close(out)
        serve(doors["fba"], "fba")
    os.close(out)
    doors.pop("fba").close()
    serve(doors["python"], "python")


if __name__ == "__main__":
    start(Path(sys.argv[1]))
