"""Decoders with one mistake each, and the vectors that find them: `python -m tools.vectors.broken`.

Each is the independent decoder with a line changed, as mistakes.toml says. The suite is worth what it finds:
every mistake must make at least one vector fail. `python -m tools.vectors.broken NAME IN OUT [BAP_STEPS]`
decodes a stream with a mistake, as a program that `fba conformance --decoder` can test.
"""

from __future__ import annotations

import sys
import tomllib
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import CodeType, ModuleType
from typing import NamedTuple

from fba.errors import FbaError, FbaWarning
from fba.parameters import BapTable
from fba_conformance import trace
from fba_conformance._values import Listing, PlaneValues, trace_values
from fba_conformance.suite.index import Vector, read_vectors
from fba_conformance.suite.programs import find_fault
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


class Mistake(NamedTuple):
    """What a decoder with a mistake does, and the text in one of its modules that is replaced by another.

    found_by: a vector that must find it.
    """

    name: str
    does: str
    found_by: str
    module: str
    old: str
    new: str


@cache
def mistakes() -> tuple[Mistake, ...]:
    """Return all mistakes, from mistakes.toml."""
    text = Path(__file__).with_name("mistakes.toml").read_text(encoding="utf-8")
    return tuple(Mistake(**row) for row in tomllib.loads(text)["mistake"])


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
    with broken_decoder(mistake) as decode, warnings.catch_warnings(action="ignore", category=FbaWarning):
        for vector, expected in sorted(vectors, key=lambda pair: len(pair[1].planes) > LONG):
            if vector.optional or (names and len(expected.planes) > LONG):
                continue
            found = decode(vector.data(), vector.bap_steps)
            if find_fault(vector, expected, found, failed=False):
                names.append(vector.name.removesuffix(".fba"))
    return names


def main() -> None:
    """Decode a file with a mistake; without arguments, print what finds each, and exit with 1 for gaps."""
    if len(sys.argv) > 1:
        name, stream, values, bap_steps = [*sys.argv[1:], "iso"][:4]
        warnings.simplefilter("ignore", FbaWarning)
        with broken_decoder(next(mistake for mistake in mistakes() if mistake.name == name)) as decode:
            table: BapTable = "visage" if bap_steps == "visage" else "iso"
            listing = decode(Path(stream).read_bytes(), table)
        Path(values).write_text(listing.text(), encoding="utf-8")
        return
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
