"""A function over many items on a cluster of dask.distributed: nothing is lost, and nothing counts twice."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent import futures
from contextlib import suppress
from itertools import islice
from typing import Any, TypeVar

from fba.archive._pool import Outcome, run_chunk
from fba.errors import FbaError, OptionError

CONNECT_SECONDS = 10.0
"""Time within which the scheduler must answer."""
LOST_SECONDS = 10.0
"""Time after which a scheduler whose connection is lost counts as ended."""
POLL_SECONDS = 0.01
CHUNK = 50
"""Items that a worker gets at once: a task costs the scheduler about a millisecond."""
_CANCELLED = (asyncio.CancelledError, futures.CancelledError)
"""Errors of tasks whose scheduler has ended: one or the other, by the version of distributed."""
_AHEAD = 1000
"""Chunks that are handed out before their results are taken."""

Item = TypeVar("Item")
Value = TypeVar("Value")


def for_each_on(
    address: str, function: Callable[[Item], Value], items: Iterable[Item], *, chunk: int = CHUNK
) -> Iterator[Outcome[Item, Value]]:
    """Yield what a function makes of each item, as soon as it is done, on the workers of a cluster.

    address: of a scheduler, "tcp://host:8786". function, items: picklable; the workers have this package
    installed, and reach the same files. chunk: items that a worker gets at once. What a worker that ends had
    not finished, another does again; an item at which several workers end fails by itself.

    Raises FbaError without the package distributed, if the scheduler does not answer, and if it ends: the
    error says how many items are missing.
    """
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise FbaError(
            'clusters are reached by the package distributed: pip install "mpeg4-fba[cluster]"'
        ) from None
    waiting = list(items)
    missing = len(waiting)
    try:
        client = Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
    except ValueError as error:
        raise OptionError(f"{address!r} is no address of a scheduler: {error}") from error
    except OSError as error:
        raise FbaError(
            f"the scheduler {address} does not answer: {' '.join(str(error).split())[:200]}; start one with "
            "`dask scheduler`"
        ) from error
    chunks = iter([waiting[at : at + chunk] for at in range(0, len(waiting), chunk)])
    try:
        given: dict[Any, list[Item]] = {}
        running = as_completed(loop=client.loop)

        def hand_out(part: list[Item]) -> None:
            future = client.submit(run_chunk, function, part, pure=False)
            given[future] = part
            running.add(future)

        for part in islice(chunks, _AHEAD):
            hand_out(part)
        suspects: list[Item] = []
        alone = False  # whether an item is the only one on the cluster
        while given or suspects:
            if not given:
                alone = True
                hand_out([suspects.pop()])
            future = _next(running, client)
            outcomes = None if future is None else _outcomes(future, client)
            if future is None or outcomes is None:
                raise FbaError(
                    f"the scheduler {address} has ended: {missing} of the files are missing; start it again, "
                    "and the same command, which goes on where it stopped"
                )
            part = given.pop(future)
            if isinstance(outcomes, list):
                missing -= len(outcomes)
                yield from outcomes
            elif len(part) > 1:
                for item in part:
                    hand_out([item])
            elif not alone:  # another item on the same workers may have ended them
                suspects += part
            else:
                missing -= 1
                yield Outcome(part[0], None, outcomes)
            for following in islice(chunks, 1):
                hand_out(following)
    finally:
        with suppress(Exception):  # the scheduler may be gone
            client.close(timeout=CONNECT_SECONDS)


def _next(running: Any, client: Any) -> Any:
    """Return the next future of an `as_completed` that is done; None if the scheduler has ended."""
    lost: float | None = None
    while not running.has_ready():
        time.sleep(POLL_SECONDS)
        if client.status == "running":
            lost = None
        elif lost is None:
            lost = time.monotonic()
        elif time.monotonic() - lost > LOST_SECONDS:
            return None
    return next(running)


def _outcomes(future: Any, client: Any) -> list[Outcome[Any, Any]] | str | None:
    """Return the outcomes of a chunk; why its task failed; None if the scheduler has ended."""
    while client.status == "running" and future.status != "cancelled":
        try:
            if future.status == "error":
                error = future.exception(timeout=LOST_SECONDS)
                if isinstance(error, _CANCELLED):
                    return None
                if type(error).__name__ == "KilledWorker":
                    return "the workers that worked on it were ended; is their memory full?"
                return f"internal error: {type(error).__name__}: {' '.join(str(error).split())}"
            outcomes: list[Outcome[Any, Any]] = future.result(timeout=LOST_SECONDS)
        except _CANCELLED:
            return None
        except (OSError, TimeoutError):  # the worker that had it has ended, and another does it again
            time.sleep(POLL_SECONDS)
        except Exception:  # the worker that had it has ended, and doing it again has failed
            if future.status != "error":
                raise
        else:
            return outcomes
    return None
