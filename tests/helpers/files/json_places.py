"""A JSON document with one value replaced, or several at random, for tests of what readers say."""

import copy
from collections.abc import Iterator
from random import Random
from typing import Any

NASTY: list[Any] = [
    None, True, False, 0, 1, -1, 2, 3, 255, 65535, 65536, 2**31 - 1, 2**31, 2**32, 2**53, 10**30, 10**400,
    -(2**31), 0.5, 1e300, 1e308, 3.4e38, 1e39, "", "x", "skin", "open_jaw", "\ud800", "\0", "a" * 1000, [],
    {}, [[]], [0], [1, 2, 3], {"a": 1}, [None] * 5, [0] * 300, "data:;base64,AAAA", "../x", 5126, 5123, 5125,
    "VEC3", "SCALAR", "MAT4",
]  # fmt: skip


class REMOVED:
    """As a value: the member is taken out. A class, as its name makes the same test name in every process."""


def put(root: Any, place: str, value: Any) -> Any:
    """Replace the value at a place such as "meshes/0/name", or remove it; the root again."""
    *steps, last = [int(step) if step.isdigit() else step for step in place.split("/")]
    holder = root
    for step in steps:
        holder = holder[step]
    if value is REMOVED:
        del holder[last]
    else:
        holder[last] = value
    return root


def spoil(root: Any, rng: Random) -> None:
    """Replace, remove, repeat or move one value of a document."""
    spots = list(_walk(root, rng))
    if not spots:
        return
    holder, key = rng.choice(spots)
    action = rng.random()
    if action < 0.6:
        holder[key] = copy.deepcopy(rng.choice(NASTY))
    elif action < 0.75:
        del holder[key]
    elif isinstance(holder, list):
        holder.insert(key, copy.deepcopy(rng.choice(holder)))
    else:
        holder[key] = copy.deepcopy(rng.choice(list(holder.values())))


def _walk(value: Any, rng: Random) -> Iterator[tuple[Any, Any]]:
    """Holders and keys on one random way down from the top."""
    while isinstance(value, dict | list) and value:
        key = rng.choice(list(value)) if isinstance(value, dict) else rng.randrange(len(value))
        yield value, key
        value = value[key]
