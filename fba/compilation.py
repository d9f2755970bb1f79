"""Tells whoever asked for it that something is about to be compiled, which takes seconds the first time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

_listeners: list[Callable[[], None]] = []


@contextmanager
def heard(listener: Callable[[], None] | None) -> Iterator[None]:
    """While the block runs, the listener, if any, is called before each function that has to be compiled."""
    if listener is None:
        yield
        return
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def announce() -> None:
    """A function is about to be compiled: the listeners hear of it."""
    for listener in tuple(_listeners):
        listener()
