"""Check other decoders and encoders, which read and write files. docs/test-a-codec.md has the contract."""

from __future__ import annotations

import contextlib
import os
import shlex
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO

from fba.errors import FbaError, FbaWarning, FormatError
from fba.parameters import BapTable
from fba_conformance._values import Listing, read_values, trace_values
from fba_conformance.suite.index import Vector
from fba_conformance.suite.result import Result
from fba_conformance.suite.runner import expected_listing
from fba_conformance.trace import decode_values, planes

SECONDS = 20.0
"""Default time limit of a program for a vector, seconds."""
FILES = ("in", "out")
DECODER_PLACES = (*FILES, "bap_steps")
ENCODER_PLACES = (*DECODER_PLACES, "rate", "fap_quant", "bap_quant")
DEFAULT_STEPS = "iso"
OUTPUT_LIMIT = 64 << 20
"""Bytes of output at which a program is stopped; the longest listing of the suite has 0.3 million."""
_POLL = 0.02
"""Seconds between two checks of the size of the output."""
_TAIL = 4096
"""Bytes of standard error that are kept."""
_SHOWN = 200
"""Characters of it that a message shows."""


@dataclass(frozen=True)
class Program:
    """A program to test. words: its command line with {in}, {out} and others. seconds: its time limit."""

    words: tuple[str, ...]
    seconds: float = SECONDS

    def has_place(self, name: str) -> bool:
        """Return whether the command line has "{name}"."""
        return any(f"{{{name}}}" in word for word in self.words)

    def run(self, values: Mapping[str, str], output: Path) -> Run:
        """Run it. Raises FormatError if it cannot be started."""
        words = fill_in(list(self.words), values)
        try:
            return run_program(words, output, self.seconds)
        except OSError as error:
            raise FormatError(f"could not be started: {error.strerror or error}", path=words[0]) from error


def parse_program(command: str, *, seconds: float = SECONDS) -> Program:
    """Return the program of a command line. ValueError unless it has {in} and {out}."""
    program = Program(tuple(split_command(command)), seconds)
    missing = [f"{{{name}}}" for name in FILES if not program.has_place(name)]
    if missing:
        raise ValueError(
            f"the command needs {' and '.join(missing)}, in whose place the names of files come: "
            "'mydecoder {in} {out}'"
        )
    return program


def check_decoder(program: Program, vector: Vector) -> Result:
    """Return the result of a decoder: the values that it writes must be those expected."""
    begin = time.perf_counter()
    if vector.bap_steps != DEFAULT_STEPS and not program.has_place("bap_steps"):
        reason = f"needs the BAP steps {vector.bap_steps}, and the command has no {{bap_steps}}"
        result = Result(vector.name, None, None, skipped=reason)
    else:
        try:
            expected = expected_listing(vector)
            with tempfile.TemporaryDirectory(prefix="fba-conformance-") as folder:
                output = Path(folder) / "out.txt"
                stream = (vector.folder / vector.name).resolve()
                values = {"in": str(stream), "out": str(output), "bap_steps": vector.bap_steps}
                wrong = _judge(vector, expected, program.run(values, output), output)
        except (FbaError, OSError) as error:
            wrong = str(error)
        result = Result(vector.name, not wrong, None, wrong)
    return replace(result, group=vector.group, optional=vector.optional, seconds=time.perf_counter() - begin)


def check_encoder(program: Program, vector: Vector) -> Result:
    """Return the result of an encoder: our decoder must decode what it writes to the values given."""
    begin = time.perf_counter()
    try:
        wrong, skipped = _try_encoder(program, vector)
    except (FbaError, OSError) as error:
        wrong, skipped = str(error), ""
    result = Result(vector.name, None, None if skipped else not wrong, wrong, skipped=skipped)
    return replace(result, group=vector.group, optional=vector.optional, seconds=time.perf_counter() - begin)


def _judge(vector: Vector, expected: Listing, run: Run, output: Path) -> str:
    """Return what is wrong with a decoder's output, "" if nothing is."""
    if run.crash or (run.failure and not vector.damaged):
        return run.failure
    if vector.damaged and run.failure and not (output.is_file() and output.stat().st_size):
        return ""  # it refused the stream
    found = _read_output(output)
    if isinstance(found, str):
        return found
    return find_fault(vector, expected, found, failed=bool(run.failure))


def _read_output(output: Path) -> Listing | str:
    """Return the listing that a program wrote, or what is wrong with it."""
    if not output.is_file():
        return "wrote no file"
    if output.stat().st_size > OUTPUT_LIMIT:
        return f"wrote more than {OUTPUT_LIMIT >> 20} MB"
    try:
        return read_values(output.read_text(encoding="utf-8"))
    except UnicodeDecodeError as error:
        return f"what it wrote is not text: byte {error.start} is {error.object[error.start]:#04x}"
    except FormatError as error:
        return f"what it wrote cannot be read: {error}"


def _try_encoder(program: Program, vector: Vector) -> tuple[str, str]:
    """Return what is wrong with an encoder, and why it was not tried; "" and "" if it is right."""
    if vector.damaged or vector.optional or not vector.times:
        return "", "not for encoders: damaged, optional or of doubtful times"
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        records = decode_values(vector.data(), bap_steps=vector.bap_steps)
    expected = Listing(trace_values(records))
    places: dict[str, set[str]] = {
        "bap_steps": {vector.bap_steps},
        "rate": {str(record["rate"]) for record in records},
    }
    for name, part in (("fap_quant", 1), ("bap_quant", 2)):
        places[name] = {str(record[name]) for record in records if record["parts"] & part} or {"1"}
    several = [name for name, held in places.items() if len(held) > 1]
    if several:
        return "", f"not for encoders: more than one {several[0].replace('_', ' ')}"
    values = {name: held.pop() for name, held in places.items()}
    for name, default in (("bap_steps", DEFAULT_STEPS), ("fap_quant", "1"), ("bap_quant", "1")):
        if values[name] != default and not program.has_place(name):
            return "", f"needs {name} {values[name]}, and the command has no {{{name}}}"
    with tempfile.TemporaryDirectory(prefix="fba-conformance-") as folder:
        source, output = Path(folder) / "in.txt", Path(folder) / "out.fba"
        source.write_text(expected.text(), encoding="utf-8", newline="\n")
        run = program.run({**values, "in": str(source), "out": str(output)}, output)
        if run.failure:
            return run.failure, ""
        if not output.is_file():
            return "wrote no file", ""
        return _stream_difference(expected, output.read_bytes(), vector.bap_steps), ""


def _stream_difference(expected: Listing, data: bytes, bap_steps: BapTable) -> str:
    """Return how a stream that an encoder wrote differs from the values given to it, "" if in nothing."""
    found = []
    try:
        with warnings.catch_warnings(action="ignore", category=FbaWarning):
            for plane in planes(data, bap_steps=bap_steps):
                found += trace_values([plane])
                if len(found) > len(expected.planes):
                    break
    except FbaError as error:
        return f"the stream that it wrote is damaged: {error}"
    return expected.difference(Listing(found))


def unknown_places(program: Program, known: Iterable[str]) -> list[str]:
    """Return the places, such as "{input}", in a command line that nothing fills."""
    names = {part.partition("}")[0] for word in program.words for part in word.split("{")[1:] if "}" in part}
    return sorted(f"{{{name}}}" for name in names - set(known) if name.isidentifier())


def find_fault(vector: Vector, expected: Listing, found: Listing, *, failed: bool) -> str:
    """Return what is wrong with what a decoder found, "" if nothing is. failed: its exit status was not 0.

    In a damaged stream it must report the damage, by a line `error` or by its exit status, and may give all
    planes that can be salvaged, or only some of those before the damage; never another plane.
    """
    if not vector.damaged:
        if found.error_after is not None:
            return f"reports damage in plane {found.error_after}, which has none"
        if not found.ended:
            return f"the output breaks off behind {len(found.planes)} planes: its last line is not `end`"
        return expected.difference(found)
    given = list(found.planes)
    if found.error_after is None:
        if not failed:
            return f"reports no error; the stream is damaged in plane {vector.planes_before}"
        if not found.ended:
            given = given[:-1]  # it may have ended within a plane
    if not expected.difference(Listing(given)):
        return ""
    before = Listing(expected.planes[: min(len(given), vector.planes_before)])
    wrong = before.difference(Listing(given))
    return f"{wrong} (the damage is in plane {vector.planes_before})" if wrong else ""


@dataclass(frozen=True)
class Run:
    """How a program ended.

    exit_status: negative for the signal that killed it, None if it was stopped. stopped: why, "" if it was
    not. said: the last line that it wrote to standard error.
    """

    exit_status: int | None
    stopped: str = ""
    said: str = ""

    @property
    def crash(self) -> str:
        """How it crashed or why it was stopped; "" if it ended by itself."""
        if self.stopped:
            return self.stopped
        assert self.exit_status is not None
        if self.exit_status >= 0:
            return ""
        name = str(-self.exit_status)
        with contextlib.suppress(ValueError):
            name = signal.Signals(-self.exit_status).name
        return f"crashed (signal {name})"

    @property
    def failure(self) -> str:
        """How it crashed, or its exit status and what it said; "" for exit status 0."""
        text = self.crash or (f"ended with exit status {self.exit_status}" if self.exit_status else "")
        return f"{text}: {self.said}" if text and self.said else text


def split_command(command: str) -> list[str]:
    """Return the words of a command line. Raises ValueError for open quotes and for no word at all."""
    words = shlex.split(command, posix=sys.platform != "win32")
    if not words:
        raise ValueError("the command is empty")
    return words


def fill_in(words: list[str], values: Mapping[str, str]) -> list[str]:
    """Return words with values in place of "{name}"."""
    for name, value in values.items():
        words = [word.replace(f"{{{name}}}", value) for word in words]
    return words


def run_program(words: list[str], output: Path, seconds: float) -> Run:
    """Run a program; stop it, and all that it started, when its time is over.

    output: a file that it writes; if that grows beyond `OUTPUT_LIMIT`, the program is stopped, too. Its
    standard output is thrown away. Raises OSError if it cannot be started.
    """
    process = subprocess.Popen(
        words,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=os.name == "posix",
    )
    assert process.stderr is not None
    tail = bytearray()
    reader = threading.Thread(target=_keep_tail, args=(process.stderr, tail), daemon=True)
    reader.start()
    stopped = ""
    try:
        stopped = _wait(process, output, seconds)
    finally:
        _stop(process)
        reader.join(1)  # takes longer only if something that it started has left its session
    return Run(None if stopped else process.returncode, stopped, _last_line(bytes(tail)))


def _wait(process: subprocess.Popen[bytes], output: Path, seconds: float) -> str:
    """Wait for a program; return why it must be stopped, "" if it has ended."""
    end = time.monotonic() + seconds
    while True:
        try:
            process.wait(min(_POLL, max(end - time.monotonic(), 0)))
        except subprocess.TimeoutExpired:
            pass
        else:
            return ""
        if time.monotonic() >= end:
            return f"took longer than {seconds:g} s and was stopped"
        with contextlib.suppress(OSError):
            if output.stat().st_size > OUTPUT_LIMIT:
                return f"wrote more than {OUTPUT_LIMIT >> 20} MB and was stopped"


def _stop(process: subprocess.Popen[bytes]) -> None:
    """End a program, if it still runs, and what it started."""
    if os.name == "posix":
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    elif process.poll() is None:
        process.kill()
    process.wait()


def _keep_tail(source: IO[bytes], tail: bytearray) -> None:
    """Read until the end, and keep the last bytes."""
    with contextlib.suppress(OSError, ValueError):
        while chunk := os.read(source.fileno(), _TAIL):
            tail += chunk
            del tail[:-_TAIL]
        source.close()


def _last_line(said: bytes) -> str:
    """Return the last line of text that is not empty."""
    lines = [line.strip() for line in said.decode("utf-8", "replace").splitlines() if line.strip()]
    return lines[-1][:_SHOWN] if lines else ""
