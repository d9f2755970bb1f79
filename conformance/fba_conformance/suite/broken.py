"""Decoders with one mistake each, and the vectors that find them: `python -m fba_conformance.suite.broken`.

Each is the independent decoder with a line changed (`_mistakes`). The suite is worth what it finds: every
mistake must make at least one vector fail.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import CodeType, ModuleType

from fba.errors import FbaError, FbaWarning
from fba.parameters import BapTable
from fba_conformance import trace
from fba_conformance._values import Listing, PlaneValues, trace_values
from fba_conformance.suite._judgement import find_fault
from fba_conformance.suite._mistakes import Mistake, mistakes
from fba_conformance.suite.index import Vector, read_vectors
from fba_conformance.suite.runner import expected_listing

SHOWN = 4
"""Vectors that the list names for each mistake; the others are counted."""
LONG = 1000
"""Number of planes above which a vector is tried only if no shorter one finds the mistake."""
_PACKAGE = "fba_conformance"
_MODULES = ("_textbook", "_reader", "_part", "listing", "trace")
"""Those of the independent decoder, each behind those that it imports."""
_KEPT = "_KEPT"
"""A dictionary that a mistake may use, empty at the beginning of a stream."""
Decoder = Callable[[bytes, BapTable], Listing]


@contextmanager
def broken_decoder(mistake: Mistake) -> Iterator[Decoder]:
    """Provide a decoder with a mistake: a function of stream and BAP steps that returns what it finds."""
    package = f"{_PACKAGE}_broken"
    names = [f"{package}.{name}" for name in _MODULES]
    try:
        for name in _MODULES:
            source = (Path(trace.__file__).parent / f"{name}.py").read_text(encoding="utf-8")
            if name == mistake.module:
                assert source.count(mistake.old) >= 1, (
                    f"{mistake.name}: no such text in {name}: {mistake.old}"
                )
                source = source.replace(mistake.old, mistake.new) + f"\n{_KEPT}: dict = {{}}\n"
            for other in _MODULES:
                source = source.replace(f"from {_PACKAGE}.{other} import", f"from {package}.{other} import")
            module = ModuleType(f"{package}.{name}")
            sys.modules[f"{package}.{name}"] = module
            if name == _MODULES[0]:
                sys.modules[package] = ModuleType(package)
            exec(_compiled(source, name), module.__dict__)
        walker = sys.modules[names[-1]].__dict__["Walker"]
        kept = [sys.modules[name].__dict__.get(_KEPT, {}) for name in names]

        def decode(data: bytes, bap_steps: BapTable) -> Listing:
            for one in kept:
                one.clear()
            return _decode(walker, data, bap_steps)

        yield decode
    finally:
        for name in (package, *names):
            sys.modules.pop(name, None)


@cache
def _compiled(source: str, name: str) -> CodeType:
    """Return compiled source: all decoders share most of theirs."""
    return compile(source, f"<{name} with a mistake>", "exec")


def _decode(walker: Callable[..., trace.Walker], data: bytes, bap_steps: BapTable) -> Listing:
    """Return what a decoder finds; any exception is an error that it reports."""
    found: list[PlaneValues] = []
    try:
        reading = walker(data, bap_steps=bap_steps)
        while reading.step():
            reading.reader.drain()
            if reading.count > len(found):
                found += trace_values([reading.record])
    except FbaError:
        return Listing(found, len(found))
    except (ArithmeticError, AssertionError, LookupError, TypeError, ValueError):
        return Listing(found, len(found))  # what a program without checks would crash with
    return Listing(found)


def find(mistake: Mistake, vectors: Iterable[tuple[Vector, Listing]]) -> list[str]:
    """Return the names of the vectors that find a mistake. Long ones are tried only if no other does."""
    names: list[str] = []
    with broken_decoder(mistake) as decode, warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)
        for vector, expected in sorted(vectors, key=lambda pair: len(pair[1].planes) > LONG):
            if vector.optional or (names and len(expected.planes) > LONG):
                continue
            found = decode(vector.data(), vector.bap_steps)
            if find_fault(vector, expected, found, failed=False):
                names.append(vector.name.removesuffix(".fba"))
    return names


def main() -> None:
    """Print what finds each mistake; exit status 1 if nothing finds one."""
    vectors = [(vector, expected_listing(vector)) for vector in read_vectors()]
    unfound = 0
    for mistake in mistakes():
        names = find(mistake, vectors)
        unfound += not names
        shown = ", ".join(names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")
        sys.stdout.write(f"{mistake.name}: {mistake.does}: {shown or 'NOT FOUND'}\n")
    sys.exit(1 if unfound else 0)


if __name__ == "__main__":
    main()
