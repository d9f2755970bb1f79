"""Which vectors reach what: `python -m tools.vectors.coverage` prints it, and exits with 1 for gaps.

Two lists: the points of the syntax (every element with the values that matter, every parameter, every code),
and both outcomes of every branch of the independent decoder, observed while it reads the vectors.
"""

from __future__ import annotations

import sys
import warnings
from collections import defaultdict
from collections.abc import Iterable, Mapping

from fba.errors import FbaError, FbaWarning
from fba_conformance.suite.index import Vector, read_vectors
from fba_conformance.trace import Element, trace
from tools.vectors._branches import all_branches, observed
from tools.vectors._points import all_points, points

OBSERVED = 200
"""Last planes of a stream whose branches are observed, which takes ten times as long as reading them."""
SHOWN = 4
"""Vectors that the report names for each line; the others are counted."""
NOT_FOR_VECTORS = {
    "Walker.__init__: if bap_steps not in BAP_STEP_TABLES: yes": "an argument that the caller got wrong",
    "Walker._read_rest: if checks is not None: yes": "this project's mark; the standard has none",
}
"""Branches that no stream reaches, and why."""


def reached(vectors: Iterable[Vector]) -> dict[str, list[str]]:
    """Return the names of the vectors that reach each point and branch, for all that there are."""
    result: dict[str, list[str]] = {name: [] for name in (*all_points(), *all_branches())}
    for vector in vectors:
        for name in sorted(_reached_by(vector)):
            result[name].append(vector.name.removesuffix(".fba"))
    return result


def gaps(found: Mapping[str, list[str]]) -> list[str]:
    """Return points and branches that no vector reaches, but one could."""
    return [name for name, names in found.items() if not names and name not in NOT_FOR_VECTORS]


def _reached_by(vector: Vector) -> set[str]:
    """Return points and branches that a vector reaches."""
    data = vector.data()
    elements: list[Element] = []
    reading = trace(data, bap_steps=vector.bap_steps)
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        unobserved = vector.planes_before - OBSERVED
        while unobserved > 0 and (not elements or (elements[-1].plane or 0) < unobserved):
            elements.append(next(reading))
        with observed() as branches:
            try:
                elements.extend(reading)
            except FbaError:
                damaged = True
            else:
                damaged = False
    return branches() | points(elements, data, vector.bap_steps, damaged=damaged)


def report_lines(found: Mapping[str, list[str]]) -> list[str]:
    """Return the lines of the report: what is reached, by how many vectors, and by which."""
    sections: dict[str, list[str]] = defaultdict(list)
    branches = set(all_branches())
    for name, names in found.items():
        title = "BRANCHES OF THE INDEPENDENT DECODER" if name in branches else "POINTS OF THE SYNTAX"
        shown = ", ".join(names[:SHOWN]) + (", ..." if len(names) > SHOWN else "")
        if not names:
            shown = NOT_FOR_VECTORS.get(name, "NOT REACHED")
        sections[title].append(f"{name}  [{len(names)}]  {shown}")
    missing = gaps(found)
    lines = [f"{len(found) - len(missing)} of {len(found)} points and branches are reached or cannot be."]
    for title, rows in sections.items():
        lines += ["", title, *rows]
    return lines


if __name__ == "__main__":
    all_found = reached(read_vectors())
    sys.stdout.write("\n".join(report_lines(all_found)) + "\n")
    sys.exit(1 if gaps(all_found) else 0)
