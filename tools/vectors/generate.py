"""Write the test vectors: `python -m tools.vectors.generate [FOLDER]`.

The streams come from `cases` and `stream_writer`. The independent decoder reads each, and the digest of its
values goes into the index: the tested codec has no part in what is right. A valid stream is an error here
unless readers that look for start codes at byte boundaries find the same planes.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from fba.errors import BitstreamError, FbaError, FbaWarning, UnsupportedError
from fba.parameters import BapTable
from fba_conformance._values import Listing, PlaneValues, trace_values
from fba_conformance.suite.index import SHIPPED_VECTORS, index_text
from fba_conformance.trace import Walker, planes
from tools.vectors.definitions.case import Case, Fault
from tools.vectors.definitions.cases import cases
from tools.vectors.definitions.faults import faults

Made = tuple[dict[str, Any], bytes, Listing]
"""The entry of a vector in the index, the stream, and the values that a decoder must find."""
DAMAGE = "damage"
"""Group of the damaged streams."""


def write_vectors(folder: Path, vectors: Iterable[Made]) -> int:
    """Write vectors and their index into a folder; return their number."""
    entries = []
    for entry, data, _ in vectors:
        path = folder / entry["stream"]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        entries.append(entry)
    (folder / "index.json").write_text(index_text(entries), encoding="utf-8", newline="\n")
    return len(entries)


def made_vectors() -> Iterator[Made]:
    """Yield all vectors, made anew."""
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        for group, case in cases():
            data = case.make()
            yield valid_entry(group, case, data)
        for fault in faults():
            yield damaged_entry(fault, fault.make())


def valid_entry(group: str, case: Case, data: bytes) -> Made:
    """Return what `made_vectors` yields for a valid stream. AssertionError if it is not one."""
    listing = Listing(trace_values(planes(data, bap_steps=case.bap_steps), times=case.times))
    aligned = _planes_of_aligned_reader(data, case.bap_steps)
    assert case.optional or aligned == len(listing.planes), (
        f"{case.name}: {aligned} planes at byte boundaries"
    )
    entry: dict[str, Any] = {
        "stream": f"valid/{case.name}.fba",
        "group": group,
        "tests": case.tests,
        "bap_steps": case.bap_steps,
        "planes": len(listing.planes),
        "values": listing.digest(),
        "times": case.times,
        "same_bytes": case.encodes,
    }
    if case.optional:
        entry["optional"] = case.optional
    return entry, data, listing


def damaged_entry(fault: Fault, data: bytes) -> Made:
    """Return what `made_vectors` yields for a damaged stream. AssertionError if it is whole."""
    before: list[PlaneValues] = []
    found: FbaError | None = None
    try:
        for plane in planes(data):
            before += trace_values([plane], times=fault.times)
    except (BitstreamError, UnsupportedError) as error:
        found = error
    assert isinstance(found, BitstreamError | UnsupportedError), f"{fault.name}: no error"
    assert len(before) == fault.before, f"{fault.name}: {len(before)} planes before the damage"
    assert (fault.kind == "unsupported") == isinstance(found, UnsupportedError), fault.name
    after = trace_values(planes(fault.after()), times=fault.times) if fault.after is not None else []
    listing = Listing([*before, *after], fault.before)
    entry = {
        "stream": f"damaged/{fault.name}.fba",
        "group": DAMAGE,
        "tests": fault.tests,
        "bap_steps": "iso",
        "planes": len(listing.planes),
        "values": listing.digest(),
        "times": fault.times,
        "error": {"kind": fault.kind, "plane": fault.before, "bit": found.bit},
    }
    return entry, data, listing


def _planes_of_aligned_reader(data: bytes, bap_steps: BapTable) -> int | None:
    """Return how many planes a byte-aligned reader finds; None for an error."""
    walker = Walker(data, bap_steps=bap_steps, byte_aligned=True)
    try:
        while walker.step():
            walker.reader.drain()
    except FbaError:
        return None
    return walker.count


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else SHIPPED_VECTORS
    count = write_vectors(target, made_vectors())
    sys.stdout.write(f"{count} vectors in {target}\n")
