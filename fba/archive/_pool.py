"""A function over many items in several processes: a process that is killed takes nothing with it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from itertools import islice
from typing import Any, Generic, TypeVar

from fba.errors import FbaError, FbaWarning

CHUNK = 20
"""Items that a process gets at once: enough that handing them over costs little."""
_AHEAD = 2
"""Chunks for each process that are handed out before their results are taken."""

Item = TypeVar("Item")
Value = TypeVar("Value")

_one_at_a_time = threading.Lock()
"""Warnings and standard output are those of a process: a worker of a cluster may have several threads."""
_stop: Any = None
"""In a process of the pool: the event that is set when it shall take no more items."""


@dataclass(frozen=True)
class Outcome(Generic[Item, Value]):
    """What became of an item. value: the function's result; None if it failed. error: why; "" if it did not.

    warnings: texts of the FbaWarnings that it gave.
    """

    item: Item
    value: Value | None
    error: str = ""
    warnings: tuple[str, ...] = ()


def count_processors() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def for_each(
    function: Callable[[Item], Value], items: Iterable[Item], *, jobs: int = 1, chunk: int = CHUNK
) -> Iterator[Outcome[Item, Value]]:
    """Yield what a function makes of each item, in their order; one that fails does not stop the others.

    function, items: picklable, unless `jobs` is 1, in which case all is done in this process. jobs: number of
    processes. chunk: items that a process gets at once. An item at which a process dies, e.g. because the
    memory is full, is tried once more by itself, and fails if it dies again. At Ctrl-C, and where the caller
    takes no more, every process finishes its item.
    """
    if jobs == 1:
        yield from (run_one(function, item) for item in items)
        return
    rest = iter(items)
    while waiting := list(islice(rest, jobs * _AHEAD * chunk)):
        chunks = [waiting[at : at + chunk] for at in range(0, len(waiting), chunk)]
        yield from _run_all(function, chunks, rest, jobs=jobs, chunk=chunk)


def _run_all(
    function: Callable[[Item], Value],
    chunks: list[list[Item]],
    rest: Iterator[Item],
    *,
    jobs: int,
    chunk: int,
) -> Iterator[Outcome[Item, Value]]:
    """Yield the outcomes of chunks and of the rest, until no item is left or a process has died."""
    context = multiprocessing.get_context("spawn")
    stop = context.Event()
    pool = ProcessPoolExecutor(jobs, context, initializer=_begin, initargs=(stop,))
    running: deque[tuple[list[Item], Future[list[Outcome[Item, Value]]]]] = deque()
    broken = False
    try:
        for one in chunks:
            running.append((one, pool.submit(run_chunk, function, one)))
        while running:
            items, future = running.popleft()
            try:
                yield from future.result()
            except BrokenProcessPool:
                if not broken:
                    broken = True
                    pool.shutdown(wait=True, cancel_futures=True)
                yield from _run_singly(function, items)
            if not broken and (following := list(islice(rest, chunk))):
                try:
                    running.append((following, pool.submit(run_chunk, function, following)))
                except BrokenProcessPool:
                    failed: Future[list[Outcome[Item, Value]]] = Future()
                    failed.set_exception(BrokenProcessPool())
                    running.append((following, failed))
    finally:
        stop.set()
        pool.shutdown(wait=True, cancel_futures=True)


def _run_singly(function: Callable[[Item], Value], items: Sequence[Item]) -> Iterator[Outcome[Item, Value]]:
    """Yield the outcomes of items, at one of which a process died: each fails alone."""
    context = multiprocessing.get_context("spawn")
    pool: ProcessPoolExecutor | None = None
    stop = context.Event()
    try:
        for item in items:
            pool = pool or ProcessPoolExecutor(1, context, initializer=_begin, initargs=(stop,))
            try:
                yield from pool.submit(run_chunk, function, [item]).result()
            except BrokenProcessPool:
                pool.shutdown(wait=True)
                pool = None
                yield Outcome(item, None, "the process that worked on it was ended; is the memory full?")
    finally:
        stop.set()
        if pool is not None:
            pool.shutdown(wait=True, cancel_futures=True)


def _begin(stop: Any) -> None:
    """Prepare a process: Ctrl-C is for the program that started it, which sets the event."""
    global _stop  # noqa: PLW0603 - of a process of the pool, which does nothing else
    _stop = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def run_chunk(function: Callable[[Item], Value], items: Sequence[Item]) -> list[Outcome[Item, Value]]:
    """Return the outcomes of items; of fewer, if the program is ending."""
    outcomes = []
    for item in items:
        if _stop is not None and _stop.is_set():
            break
        with _one_at_a_time:
            outcomes.append(run_one(function, item))
    return outcomes


def run_one(function: Callable[[Item], Value], item: Item) -> Outcome[Item, Value]:
    """Return the outcome of an item."""
    value, text = None, ""
    with warnings.catch_warnings(record=True, action="always", category=FbaWarning) as odd:
        try:
            value = function(item)
        except (FbaError, OSError) as error:
            text = str(error)
        except MemoryError:
            text = "not enough memory for it"
        except Exception as error:  # one file must not end the work on thousands
            text = f"internal error: {type(error).__name__}: {error}"
    told = tuple(str(given.message) for given in odd if issubclass(given.category, FbaWarning))
    return Outcome(item, value, " ".join(text.split()), told)
