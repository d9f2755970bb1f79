"""Terms, functions and links of an interpolation table (FIT); its BIFS node's flat lists, ISO/IEC 14496-1."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from fba.errors import ModelError
from fba.parameters import EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS, fap_numbers, faps

EXPONENT_MAX = 15
"""Largest exponent in a FIT node."""
TERMS_MAX = 10
"""Most terms of a numerator or denominator in a FIT node."""
HIGH_LEVEL_NUMBERS = {"viseme": VISEME_FIELDS[:3], "expression": EXPRESSION_FIELDS[:4]}
"""The numbers that FAP 1 and FAP 2 stand for in a source set."""


@dataclass(frozen=True)
class Term:
    """coefficient x product of powers if the impulse is met, else 0.

    coefficient: finite. powers: exponent 0..15 of each number of the source set, by name; absent is 0.
    when: (select, value), such as ("expression_select1", 1), or None for always; numerators only.
    """

    coefficient: float = 1.0
    powers: Mapping[str, int] = field(default_factory=dict)
    when: tuple[str, int] | None = None


@dataclass(frozen=True)
class Function:
    """A destination FAP as numerator (empty: 0) / denominator (empty: 1), sums of at most 10 terms."""

    numerator: Sequence[Term] = ()
    denominator: Sequence[Term] = ()


@dataclass(frozen=True)
class Link:
    """A link from one set of FAPs to another.

    source: names of its FAPs, such as ("lower_t_midlip", "raise_b_midlip"). "viseme" stands for the
    numbers viseme_select1, viseme_select2 and viseme_blend, "expression" for expression_select1,
    expression_intensity1, expression_select2 and expression_intensity2 (both 0..63 as sent).
    functions: the destination set, each of its FAPs with its function.
    """

    source: Sequence[str]
    functions: Mapping[str, Function]

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of the numbers that the functions may use, in order."""
        return tuple(n for name in self.source for n in HIGH_LEVEL_NUMBERS.get(name, (name,)))


def to_float(value: object) -> float:
    """Return the value as a float; NaN if it is not a number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.nan


INTEGER_FIELDS = {
    "FAPs": (-1, FAP_COUNT),
    "Graph": (0, FAP_COUNT),
    "numeratorExp": (0, EXPONENT_MAX),
    "denominatorExp": (0, EXPONENT_MAX),
    "numeratorImpulse": (0, 1023),
    "numeratorTerms": (0, TERMS_MAX),
    "denominatorTerms": (0, TERMS_MAX),
}
"""Fields of the node with their bounds."""
FLOAT_FIELDS = ("numeratorCoefs", "denominatorCoefs")
NONE = -1
"""Ends a set in FAPs."""


def links_from_node(node: Mapping[str, Sequence[float]]) -> list[Link]:
    """Return the links in the fields of a node, by their names in the standard; absent fields are empty.

    Raises ModelError naming the field where counts do not fit together or a number is out of bounds.
    """
    unknown = sorted(set(node) - {*INTEGER_FIELDS, *FLOAT_FIELDS})
    if unknown:
        raise ModelError(f"a FIT node has no field {unknown[0]!r}")
    fields = {name: _read_field(name, node.get(name, ())) for name in (*INTEGER_FIELDS, *FLOAT_FIELDS)}
    sets = _sets(fields["FAPs"])
    links: list[Link] = []
    graph = fields["Graph"]
    if graph.left % 2:
        raise ModelError(f"Graph of the FIT holds {graph.left} numbers; it must be pairs")
    base = 0 if 0 in graph.numbers else 1
    while graph.left:
        where = f"link {len(links) + 1} of the FIT"
        source, destination = (_set(sets, int(number) - base, where) for number in graph.take(2, ""))
        links.append(_link(source, destination, fields, where))
    for rest in fields.values():
        if rest.left:
            raise ModelError(f"{rest.name} of the FIT holds {rest.left} numbers more than its links need")
    return links


def node_from_links(links: Sequence[Link]) -> dict[str, list[int] | list[float]]:
    """Return the fields of a node; equal sets are listed once."""
    integers: dict[str, list[int]] = {name: [] for name in INTEGER_FIELDS}
    coefficients: dict[str, list[float]] = {name: [] for name in FLOAT_FIELDS}
    sets: dict[tuple[str, ...], int] = {}
    for link in links:
        for names in (tuple(link.source), tuple(link.functions)):
            if names not in sets:
                sets[names] = len(sets) + 1
                integers["FAPs"] += [*(fap_numbers()[name] for name in names), NONE]
            integers["Graph"].append(sets[names])
        for function in link.functions.values():
            for part, terms in (("numerator", function.numerator), ("denominator", function.denominator)):
                integers[f"{part}Terms"].append(len(terms))
                coefficients[f"{part}Coefs"] += [term.coefficient for term in terms]
                for term in terms:
                    integers[f"{part}Exp"] += [term.powers.get(number, 0) for number in link.numbers]
            if _high_level(link.source):
                for term in function.numerator:
                    select, value = term.when or ("", 0)
                    position = link.numbers.index(select) + 1 if select else 0
                    integers["numeratorImpulse"] += [position, value]
    if len(sets) > FAP_COUNT:
        raise ModelError(f"the FIT has {len(sets)} different sets; a node can number {FAP_COUNT} at most")
    return {**integers, **coefficients}


@dataclass
class _Field:
    """One list of the node, of which `used` numbers have been taken."""

    name: str
    numbers: list[float]
    used: int = 0

    @property
    def left(self) -> int:
        return len(self.numbers) - self.used

    def take(self, count: int, why: str) -> list[float]:
        """Return the next numbers; ModelError where too few are left, which says why they are needed."""
        if self.left < count:
            raise ModelError(
                f"{self.name} of the FIT ends after {len(self.numbers)} numbers: {why} needs {count} more, "
                f"and {self.left} are left"
            )
        self.used += count
        return self.numbers[self.used - count : self.used]


def _read_field(name: str, values: Sequence[float]) -> _Field:
    """Return the numbers of a field; ModelError where one is out of bounds."""
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise ModelError(f"{name} of the FIT must be a list of numbers, not {type(values).__name__}")
    numbers = [to_float(value) for value in values]
    is_integer = name in INTEGER_FIELDS
    low, high = INTEGER_FIELDS.get(name, (-math.inf, math.inf))
    for position, (number, value) in enumerate(zip(numbers, values, strict=True), 1):
        if (is_integer and not number.is_integer()) or not math.isfinite(number) or not low <= number <= high:
            wanted = f"a whole number {low}..{high}" if is_integer else "finite"
            text = str(value) if isinstance(value, float) else repr(value)[:40]
            raise ModelError(f"{name} of the FIT: number {position} is {text}, which must be {wanted}")
    return _Field(name, numbers)


def _sets(field: _Field) -> list[tuple[str, ...]]:
    sets, names = list[tuple[str, ...]](), list[str]()
    for number in map(int, field.take(field.left, "")):
        if number == NONE:
            if not names:
                raise ModelError(f"FAPs of the FIT: set {len(sets) + 1} is empty")
            sets.append(tuple(names))
            names = []
        elif number == 0:
            raise ModelError(f"FAPs of the FIT: set {len(sets) + 1} names FAP 0; there are 1..{FAP_COUNT}")
        else:
            names.append(faps()[number - 1].name)
    if names:
        raise ModelError(f"FAPs of the FIT: set {len(sets) + 1} is not ended by {NONE}")
    return sets


def _set(sets: list[tuple[str, ...]], index: int, where: str) -> tuple[str, ...]:
    if not 0 <= index < len(sets):
        raise ModelError(f"{where} asks for set {index + 1}, but FAPs lists {len(sets)}")
    return sets[index]


def _high_level(source: Sequence[str]) -> bool:
    return any(name in HIGH_LEVEL_NUMBERS for name in source)


def _link(
    source: tuple[str, ...], destination: tuple[str, ...], fields: dict[str, _Field], where: str
) -> Link:
    numbers = Link(source, {}).numbers
    functions = {}
    for name in destination:
        if name in functions:
            raise ModelError(f"{where}: its destination set names {name} twice")
        functions[name] = Function(
            *(
                tuple(_terms(part, numbers, _high_level(source), fields, f"{where}, {name}"))
                for part in ("numerator", "denominator")
            )
        )
    return Link(source, functions)


def _terms(
    part: str, numbers: tuple[str, ...], high_level: bool, fields: dict[str, _Field], where: str
) -> list[Term]:
    count = int(fields[f"{part}Terms"].take(1, where)[0])
    terms = []
    for _ in range(count):
        exponents = fields[f"{part}Exp"].take(len(numbers), where)
        when = None
        if high_level and part == "numerator":
            position, value = map(int, fields["numeratorImpulse"].take(2, where))
            if position > len(numbers) or (position == 0 and value):
                raise ModelError(
                    f"{where}: the impulse ({position}, {value}) does not name one of the "
                    f"{len(numbers)} numbers of the source set"
                )
            when = (numbers[position - 1], value) if position else None
        powers = {name: int(e) for name, e in zip(numbers, exponents, strict=True) if e}
        terms.append(Term(float(fields[f"{part}Coefs"].take(1, where)[0]), powers, when))
    return terms
