"""Format a trace as text for people, or as dictionaries for programs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from fba_conformance._reader import START_CODE_BITS, TRAILING_BYTES_SHOWN, Element, Levels

HEADER = f"{'bit':>9} {'bits':>6} {'plane':>6}  element"
NAMES_SHOWN = 8
"""Most levels other than 0 that a line names; further ones are counted."""


def format_trace(elements: Iterable[Element], *, values: bool = False) -> Iterator[str]:
    """Yield a heading, then a line for each element: bit, bits, plane, name = value.

    The line of an arithmetic segment has the number of its parameters and the first levels that are not 0.
    values: add a line with level and value for each parameter.
    """
    yield HEADER
    for element in elements:
        plane = "" if element.plane is None else str(element.plane)
        yield f"{element.bit:9d} {element.bits:6d} {plane:>6}  {element.name} = {_text(element)}"
        if values and isinstance(element.value, Levels):
            content = element.value
            for label, level, value in zip(content.parameters, content.levels, content.values, strict=True):
                yield f"{'':23}    {label}: level {level}, value {value}"


def element_dict(element: Element) -> dict[str, Any]:
    """Return an element as a dictionary for JSON; levels and values of a segment by parameter."""
    record: dict[str, Any] = {
        "bit": element.bit,
        "bits": element.bits,
        "plane": element.plane,
        "section": element.section,
        "name": element.name,
    }
    if isinstance(element.value, Levels):
        content = element.value
        record["value"] = {
            "inserted_bits": content.inserted,
            "levels": dict(zip(content.parameters, content.levels, strict=True)),
            "values": dict(zip(content.parameters, content.values, strict=True)),
        }
    else:
        record["value"] = element.value
    return record


def _text(element: Element) -> str:
    """Return the value of an element as text."""
    content = element.value
    if isinstance(content, Levels):
        return _summary(content)
    if element.name == "trailing data":
        return (
            f"{content}{'...' if element.bits > 8 * TRAILING_BYTES_SHOWN else ''} ({element.bits // 8} bytes)"
        )
    if element.bits == START_CODE_BITS and element.section == "object":
        return f"0x{content:08x}"
    return str(content)


def _summary(content: Levels) -> str:
    """Return the number of levels of a segment, and the first that are not 0."""
    changed = [
        f"{label} {level:+d}"
        for label, level in zip(content.parameters, content.levels, strict=True)
        if level
    ]
    count = len(content.parameters)
    text = f"{count} level{'' if count == 1 else 's'}, {len(changed)} not 0"
    if changed:
        more = len(changed) - NAMES_SHOWN
        text += ": " + ", ".join(changed[:NAMES_SHOWN]) + (f", and {more} more" if more > 0 else "")
    if content.inserted:
        text += f"; {content.inserted} inserted bit{'' if content.inserted == 1 else 's'}"
    return text
