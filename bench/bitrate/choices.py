"""Choices among results: the points of this codec, and the smallest of the others with the same values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from bench.bitrate.results import EVERYTHING, Result

OWN = ""
"""What the column `numbers` says of this codec."""


def group_results(results: Iterable[Result]) -> list[list[Result]]:
    """Return results in groups of the same data and kind, in the order in which they come."""
    found: dict[tuple[str, str], list[Result]] = {}
    for one in results:
        found.setdefault((one.data, one.kind), []).append(one)
    return list(found.values())


def together(group: Iterable[Result]) -> list[Result]:
    """Return the results of a group that sum up all its subjects."""
    return [one for one in group if one.subject == EVERYTHING]


def own_points(results: Iterable[Result]) -> list[Result]:
    """Return this codec's results, the ones with the smallest errors first."""
    return sorted((one for one in results if one.numbers == OWN), key=lambda one: (one.max_mm, one.point))


def smallest_live(results: Iterable[Result]) -> Result | None:
    """Return the result that takes least live; None without any."""
    found = [one for one in results if one.live_rate is not None]
    return min(found, key=lambda one: one.live_rate or 0.0, default=None)


def smallest_file(results: Iterable[Result]) -> Result | None:
    """Return the result that takes least as a file; None without any."""
    found = [one for one in results if one.file_rate is not None]
    return min(found, key=lambda one: one.file_rate or 0.0, default=None)


def smallest_rates(results: Sequence[Result]) -> tuple[float | None, float | None]:
    """Return the smallest rates live and as a file; None without any."""
    live, file = smallest_live(results), smallest_file(results)
    return None if live is None else live.live_rate, None if file is None else file.file_rate


def rivals_of(results: Iterable[Result], own: Result) -> list[Result]:
    """Return the rivals that code the values of one of this codec's points."""
    name = f"{own.method}, {own.point}"
    return [one for one in results if one.numbers != OWN and one.point == name]


class Comparison(NamedTuple):
    """One of this codec's points, and the smallest rivals with its values."""

    own: Result
    live: Result
    file: Result


def compare(group: Sequence[Result]) -> list[Comparison]:
    """Return the points of a group that rivals have, too, the smallest errors first."""
    found = []
    chosen = together(group)
    for own in own_points(chosen):
        rivals = rivals_of(chosen, own)
        live, file = smallest_live(rivals), smallest_file(rivals)
        if live is not None and file is not None:
            found.append(Comparison(own, live, file))
    return found


def best_within(group: Sequence[Result], limit: float) -> Comparison:
    """Return the comparison with the smallest live stream of ours whose error is at most `limit` mm.

    The one with the smallest error where none is.
    """
    compared = compare(group)
    good = [one for one in compared if one.own.max_mm <= limit]
    return min(good, key=lambda one: one.own.live_rate or 0.0) if good else compared[0]
