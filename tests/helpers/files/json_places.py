"""A JSON document with one value replaced, for tests of what readers say."""

from typing import Any


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
