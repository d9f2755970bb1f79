"""Results of vectors: as lines, as a table by group, as JSON and as JUnit XML."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any
from xml.etree import ElementTree

_WORDS = {True: "exact", False: "WRONG", None: "-"}


@dataclass(frozen=True)
class Result:
    """Result of a vector.

    decoded, encoded: whether values and bytes, or what they decode to, are exact; None where that was not
    tried. message: what was wrong, or what else is to be said. optional: why a decoder may fail, "" if it
    must not. skipped: why the vector was not tried, "" if it was. seconds: time that it took.
    """

    name: str
    decoded: bool | None
    encoded: bool | None
    message: str = ""
    group: str = ""
    optional: str = ""
    skipped: str = ""
    seconds: float = 0.0

    @property
    def exact(self) -> bool:
        """Whether everything that was tried is exact."""
        return self.decoded is not False and self.encoded is not False

    @property
    def passed(self) -> bool:
        """Whether it is exact, or may fail."""
        return self.exact or bool(self.optional)

    def to_dict(self) -> dict[str, Any]:
        """Return the result for JSON."""
        return {**asdict(self), "seconds": round(self.seconds, 3), "passed": self.passed}

    def line(self) -> str:
        """Return the result in one line of text."""
        if self.skipped:
            return f"{self.name}: skipped: {self.skipped}"
        text = f"{self.name}: decoded {_WORDS[self.decoded]}, encoded {_WORDS[self.encoded]}"
        if not self.exact and self.optional:
            text += " (may fail)"
        return f"{text}: {self.message}" if self.message else text


def table(results: Sequence[Result]) -> Iterator[str]:
    """Yield a line for each group: how many vectors, how many decoded and encoded exactly."""
    groups = list(dict.fromkeys(result.group for result in results))
    width = max([5, *map(len, groups)])
    yield f"{'group':{width}}  vectors  decoded  encoded  skipped"
    for group in groups:
        own = [result for result in results if result.group == group]
        skipped = sum(bool(result.skipped) for result in own)
        columns = [_share([result.decoded for result in own]), _share([result.encoded for result in own])]
        yield f"{group:{width}}  {len(own):7}  {columns[0]:>7}  {columns[1]:>7}  {skipped or '-':>7}"


def summary(results: Sequence[Result]) -> str:
    """Return the counts of all results in one line."""
    tried = [result for result in results if not result.skipped]
    passed = sum(result.passed for result in tried)
    decoded = sum(result.decoded is True for result in tried)
    encoded = sum(result.encoded is True for result in tried)
    text = f"{passed} of {len(tried)} vectors pass: {decoded} decoded, {encoded} encoded"
    excused = sum(result.passed and not result.exact for result in tried)
    if excused:
        text += f"; {excused} fail that may"
    skipped = len(results) - len(tried)
    return f"{text}; {skipped} skipped" if skipped else text


def junit(results: Sequence[Result], tested: str) -> bytes:
    """Return the results as JUnit XML. tested: what was tested."""
    suite = ElementTree.Element(
        "testsuite",
        name=_printable(tested),
        tests=str(len(results)),
        failures=str(sum(not result.passed for result in results)),
        errors="0",
        skipped=str(sum(bool(result.skipped) for result in results)),
        time=f"{sum(result.seconds for result in results):.3f}",
    )
    for result in results:
        name = result.name + " (encode)" * (result.decoded is None and result.encoded is not None)
        one = ElementTree.SubElement(
            suite, "testcase", classname=result.group, name=name, time=f"{result.seconds:.3f}"
        )
        if result.skipped:
            ElementTree.SubElement(one, "skipped", message=_printable(result.skipped))
        elif not result.passed:
            ElementTree.SubElement(one, "failure", message=_printable(result.message))
        elif not result.exact:
            ElementTree.SubElement(one, "system-out").text = _printable(result.line())
    ElementTree.indent(suite)
    text: bytes = ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _share(found: Sequence[bool | None]) -> str:
    """Return "3 of 4", "4" if all are exact, "-" if none was tried."""
    tried = [one for one in found if one is not None]
    if not tried:
        return "-"
    return str(len(tried)) if all(tried) else f"{sum(tried)}/{len(tried)}"


def _printable(text: str) -> str:
    """Return text without the control characters that XML does not have."""
    return "".join(one if one.isprintable() else " " for one in text)
