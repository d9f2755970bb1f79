"""Choices among results: the points of this codec, and the smallest of the others with the same values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from fba.study.results import Result

EVERYTHING = "all"
OWN = ""


def of_kind(results: Iterable[Result], kind: str) -> list[Result]:
    """Return the results of all faces, or of all bodies, together."""
    return [one for one in results if one.kind == kind and one.subject == EVERYTHING]


def own_points(results: Iterable[Result]) -> list[Result]:
    """Return this codec's results, the ones with the smallest errors first."""
    return sorted((one for one in results if one.numbers == OWN), key=lambda one: (one.max_mm, one.point))


def smallest_live(results: Iterable[Result]) -> Result | None:
    """Return the result that takes least live; None without any."""
    found = [one for one in results if one.live_bytes is not None]
    return min(found, key=lambda one: one.live_rate or 0.0, default=None)


def smallest_file(results: Iterable[Result]) -> Result | None:
    """Return the result that takes least as a file; None without any."""
    found = [one for one in results if one.file_bytes is not None]
    return min(found, key=lambda one: one.file_rate or 0.0, default=None)


def rivals_of(results: Iterable[Result], own: Result) -> list[Result]:
    """Return the rivals that code the values of one of this codec's points."""
    name = f"{own.method}, {own.point}"
    return [one for one in results if one.numbers != OWN and one.point == name]


class Comparison(NamedTuple):
    """One of this codec's points, and the smallest rivals with its values."""

    own: Result
    live: Result
    file: Result


def compare(results: Sequence[Result]) -> list[Comparison]:
    """Return the points that rivals have, too, the smallest errors first. results: of one kind."""
    found = []
    for own in own_points(results):
        rivals = rivals_of(results, own)
        live, file = smallest_live(rivals), smallest_file(rivals)
        if live is not None and file is not None:
            found.append(Comparison(own, live, file))
    return found
