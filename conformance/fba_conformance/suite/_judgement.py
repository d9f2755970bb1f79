"""Whether what a decoder found in a vector is right."""

from __future__ import annotations

from fba_conformance._values import Listing
from fba_conformance.suite.index import Vector


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
