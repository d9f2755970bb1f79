"""`fba convert --batch --scheduler` on a cluster of dask: workers that are killed, a scheduler that ends."""

import csv
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("distributed")

from fba.archive import RECORD, Outcome, for_each_on
from fba.archive import _cluster as cluster
from fba.errors import FbaError, OptionError
from ready_programs import BIN

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="signals"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]
SAMPLES = Path(__file__).parents[2] / "fba" / "samples"
Start = Callable[..., subprocess.Popen[bytes]]


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


@contextmanager
def program(*words: object) -> Iterator[subprocess.Popen[bytes]]:
    """A program of dask, until the block ends; then its processes are gone."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    environment["DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES"] = "1"
    process = subprocess.Popen(
        [str(BIN / "dask"), *map(str, words)], env=environment, stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    try:
        yield process
    finally:
        end(process)


def end(process: subprocess.Popen[bytes]) -> None:
    """Kill a program with its processes, as a machine that fails does."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@contextmanager
def started(
    workers: int, folder: Path
) -> Iterator[tuple[str, subprocess.Popen[bytes], list[subprocess.Popen[bytes]]]]:
    """A scheduler's address, the scheduler, and workers."""
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    with ExitStack() as stack:
        scheduler = stack.enter_context(
            program("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard", "--no-show")
        )
        while True:
            try:
                socket.create_connection(("127.0.0.1", port)).close()
                break
            except OSError:
                assert scheduler.poll() is None
                time.sleep(0.05)
        yield address, scheduler, [
            stack.enter_context(
                program("worker", address, "--nthreads", "1", "--no-dashboard", "--local-directory", folder)
            )
            for _ in range(workers)
        ]  # fmt: skip


def note(item: tuple[str, int]) -> int:
    """Write down that an item was done; item 5 waits until a file is there, item 9 ends its worker."""
    folder, number = item
    with open(Path(folder) / f"{number}", "a") as file:
        file.write(".")
    if number == 5 and not (Path(folder) / "go").exists():
        while not (Path(folder) / "go").exists():
            time.sleep(0.02)
    if number == 9:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


@pytest.mark.slow
def test_workers_that_end_lose_nothing(tmp_path: Path) -> None:
    items = [(str(tmp_path), number) for number in range(40)]
    with started(2, tmp_path) as (address, _, workers):
        outcomes: list[Outcome[tuple[str, int], int]] = []
        killed = False
        for outcome in for_each_on(address, note, items, chunk=4):
            outcomes.append(outcome)
            if not killed and (tmp_path / "5").exists():
                killed = True
                end(workers[0])
                (tmp_path / "go").touch()
    assert sorted(one.item[1] for one in outcomes) == list(range(40))  # nothing lost, nothing twice
    failed = {one.item[1]: one.error for one in outcomes if one.error}
    assert list(failed) == [9]
    assert "were ended; is their memory full?" in failed[9]
    assert {one.item[1]: one.value for one in outcomes if not one.error} == {
        number: number * number for number in range(40) if number != 9
    }


def test_workers_that_end_before_outcomes_are_fetched() -> None:
    """The chunk is done once more, and that fails while its outcomes are awaited."""

    from distributed.scheduler import KilledWorker

    ended = KilledWorker("a chunk", None, 1)

    class Late:
        status = "finished"

        def result(self, timeout: float) -> list[object]:
            self.status = "error"
            raise ended

        def exception(self, timeout: float) -> Exception:
            return ended

    client = SimpleNamespace(status="running")
    assert (
        cluster._outcomes(Late(), client) == "the workers that worked on it were ended; is their memory full?"
    )


def test_a_scheduler_that_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "LOST_SECONDS", 0.5)
    items = [(str(tmp_path), number) for number in range(8)]
    with started(1, tmp_path) as (address, scheduler, _):
        done: list[int] = []

        def work() -> None:
            for outcome in for_each_on(address, note, items, chunk=1):
                done.append(outcome.item[1])
                if (tmp_path / "5").exists() and scheduler.poll() is None:
                    end(scheduler)

        with pytest.raises(FbaError, match=r"of the files are missing; start it again") as raised:
            work()
    assert f"{8 - len(done)} of the files are missing" in str(raised.value)


def test_a_folder_converted_on_a_cluster(tmp_path: Path) -> None:
    captures, out = tmp_path / "captures", tmp_path / "out"
    captures.mkdir()
    for number in range(30):
        shutil.copy(SAMPLES / "hello.fap", captures / f"{number:02}.fap")
    (captures / "bad.fap").write_text("x")
    with started(1, tmp_path) as (address, _, _):
        command = [BIN / "fba", "convert", "--batch", captures, out, "--to", "fba", "--scheduler", address]
        first = subprocess.run(command, capture_output=True, text=True, check=False)
        again = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "30 converted, 0 there before, 1 failed" in first.stdout, first.stderr
    assert "0 converted, 30 there before, 1 failed" in again.stdout
    assert len({path.read_bytes() for path in out.glob("*.fba")}) == 1


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("stopped", ["Ctrl-C", "the scheduler ends"])
def test_what_a_stopped_batch_has_recorded_is_not_converted_again(tmp_path: Path, stopped: str) -> None:
    captures, out = tmp_path / "captures", tmp_path / "out"
    captures.mkdir()
    for number in range(3 * cluster.CHUNK):
        shutil.copy(SAMPLES / "hello.fap", captures / f"{number:03}.fap")
    command = [BIN / "fba", "convert", "--batch", captures, out, "--to", "fba", "--scheduler"]
    with started(1, tmp_path) as (address, scheduler, _):
        first = subprocess.Popen([*command, address], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        while len(recorded(out)) < cluster.CHUNK:
            assert first.poll() is None
            time.sleep(0.02)
        if stopped == "Ctrl-C":
            first.send_signal(signal.SIGINT)
        else:
            end(scheduler)
        _, said = first.communicate()
    assert first.returncode == (130 if stopped == "Ctrl-C" else 1), said
    done = recorded(out)
    assert cluster.CHUNK <= len(done) < 3 * cluster.CHUNK
    times = {name: (out / name).stat().st_mtime_ns for name in done}
    with started(1, tmp_path) as (address, _, _):
        again = subprocess.run([*command, address], capture_output=True, text=True, check=False)
    rest = 3 * cluster.CHUNK - len(done)
    assert f"{rest} converted, {len(done)} there before, 0 failed" in again.stdout, again.stderr
    assert {name: (out / name).stat().st_mtime_ns for name in done} == times
    assert len(recorded(out)) == 3 * cluster.CHUNK


def recorded(folder: Path) -> list[str]:
    """Return the names of the results that a table of conversions lists; a line may be half written."""
    if not (folder / RECORD).exists():
        return []
    rows = list(csv.reader((folder / RECORD).read_text().splitlines()[1:]))
    return [row[1] for row in rows if len(row) == 6]


def test_addresses_without_a_scheduler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.5)
    with pytest.raises(FbaError, match="does not answer"):
        list(for_each_on(f"tcp://127.0.0.1:{free_port()}", note, []))
    with pytest.raises(OptionError, match="is no address of a scheduler"):
        list(for_each_on("nonsense://x", note, []))
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(FbaError, match=r"mpeg4-fba\[cluster\]"):
        list(for_each_on("tcp://127.0.0.1:1", note, []))
