"""The FIT (FAP interpolation table): functions that give unsent FAPs from sent ones.

ISO/IEC 14496-1, node FIT. Directed links connect sets of FAPs; a link gives each FAP of its destination
set as a rational function of the numbers of its source set:

    sum_i( when_i  c_i  prod_j F_j ** l_ij ) / sum_i( b_i  prod_j F_j ** m_ij )

where `when_i`, the impulse of a term, is 1 or 0: whether a select of the source set has a certain value
("the expression is joy").

As lists and dicts, for JSON, where "powers", "when" and an empty "denominator" may be absent:

    {"links": [{"source": ["expression"],
                "destination": {"raise_l_cornerlip": {
                    "numerator": [{"coefficient": 0.6, "powers": {"expression_intensity1": 1},
                                   "when": {"expression_select1": 6}}],
                    "denominator": []}}}]}
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

from fba.errors import ModelError
from fba.face.interpolation import _node
from fba.face.interpolation._node import EXPONENT_MAX, TERMS_MAX, Function, Link, Term, to_float
from fba.parameters import (
    EXPRESSION_FIELDS,
    EXPRESSION_SELECT_MAX,
    FAP_COUNT,
    FIRST_LOW_LEVEL_FAP,
    VISEME_FIELDS,
    VISEME_SELECT_MAX,
    fap_numbers,
    faps,
)


@dataclass(frozen=True)
class InterpolationTable:
    """Functions that give unsent FAPs from sent ones.

    links: the links to a FAP are tried in this order; the first is used whose source FAPs are all known
    (sent, or themselves interpolated) and whose function has a value: no denominator of zero, and a finite
    result within 32 bits. A FAP that no link gives copies its mate.

    Raises ModelError for links in a circle, empty sets, FAPs that are unknown, listed twice or high-level
    in a destination set, wrong exponents, term counts, impulses and coefficients.
    """

    links: Sequence[Link]

    def __post_init__(self) -> None:
        object.__setattr__(self, "links", tuple(_check_link(link, i) for i, link in enumerate(self.links, 1)))
        circle = find_circle(self.links)
        if circle:
            raise ModelError(
                f"the links of the FIT form a circle: {' -> '.join(circle)}; "
                "no FAP may be computed from itself"
            )

    @classmethod
    def from_node(cls, node: Mapping[str, Sequence[float]]) -> InterpolationTable:
        """Return the table described by the fields of a BIFS node FIT, by name; ModelError for wrong ones."""
        return cls(_node.links_from_node(node))

    def to_node(self) -> dict[str, list[int] | list[float]]:
        """Return the fields of a BIFS node FIT; `from_node` reads them back."""
        return _node.node_from_links(self.links)

    @classmethod
    def from_dict(cls, data: object) -> InterpolationTable:
        """Return the table that `to_dict` wrote. Raises ModelError naming the entry that is wrong."""
        return cls(_links_from_dict(data))

    def to_dict(self) -> dict[str, Any]:
        """Return the table as lists, dicts, strings and numbers, for JSON."""
        return _dict_from_links(self.links)

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Destination FAPs, each after those that it may be computed from."""
        done: dict[int, None] = {}
        sources = sources_of(self.links)
        while len(done) < len(sources):
            for fap, needed in sources.items():
                if fap not in done and all(n in done or n not in sources for n in needed):
                    done[fap] = None
        return tuple(done)

    @cached_property
    def links_to(self) -> dict[int, tuple[Link, ...]]:
        """Links to each destination FAP, in the order in which they are tried."""
        return {
            fap: tuple(link for link in self.links if faps()[fap - 1].name in link.functions)
            for fap in sources_of(self.links)
        }


def sources_of(links: Iterable[Link]) -> dict[int, set[int]]:
    """Return the source FAPs of all links to each destination FAP."""
    numbers = fap_numbers()
    sources: dict[int, set[int]] = {}
    for link in links:
        for name in link.functions:
            sources.setdefault(numbers[name], set()).update(numbers[source] for source in link.source)
    return sources


def find_circle(links: Iterable[Link]) -> list[str]:
    """Return the names of FAPs that depend on one another in a circle, the first also last; else []."""
    sources = sources_of(links)
    unvisited, path = set(sources), list[int]()
    while unvisited:
        path = [min(unvisited)]
        while path:
            further = next((n for n in sorted(sources[path[-1]]) if n in unvisited), None)
            if further is None:
                unvisited.discard(path.pop())
            elif further in path:
                circle = [*path[path.index(further) :], further]
                return [faps()[number - 1].name for number in reversed(circle)]
            else:
                path.append(further)
    return []


@cache
def select_limits() -> dict[str, int]:
    """Return the largest value of each select that an impulse may ask for."""
    limits = {name: VISEME_SELECT_MAX for name in VISEME_FIELDS if "select" in name}
    return limits | {name: EXPRESSION_SELECT_MAX for name in EXPRESSION_FIELDS if "select" in name}


def _check_link(link: Link, number: int) -> Link:
    """Return the link with its numbers normalised; ModelError where something in it is wrong."""
    where = f"link {number} of the FIT"
    if not isinstance(link, Link):
        raise ModelError(f"{where} is {type(link).__name__}, not a Link")
    for what, names in (("source", tuple(link.source)), ("destination", tuple(link.functions))):
        if not names:
            raise ModelError(f"{where}: its {what} set is empty")
        for name in names:
            if name not in fap_numbers():
                raise ModelError(f"{where}: its {what} set names {name!r}, which is no FAP")
            if names.count(name) > 1:
                raise ModelError(f"{where}: its {what} set names {name} twice")
            if what == "destination" and fap_numbers()[name] < FIRST_LOW_LEVEL_FAP:
                raise ModelError(
                    f"{where}: {name} cannot be interpolated, only FAPs "
                    f"{FIRST_LOW_LEVEL_FAP}..{FAP_COUNT} can"
                )
    numbers = Link(tuple(link.source), {}).numbers
    functions = {
        name: Function(
            _check_terms(function.numerator, numbers, f"{where}, numerator of {name}", True),
            _check_terms(function.denominator, numbers, f"{where}, denominator of {name}", False),
        )
        for name, function in link.functions.items()
    }
    return Link(tuple(link.source), functions)


def _check_terms(
    terms: Sequence[Term], numbers: tuple[str, ...], where: str, impulses: bool
) -> tuple[Term, ...]:
    if len(terms) > TERMS_MAX:
        raise ModelError(f"{where}: {len(terms)} terms, but there may be {TERMS_MAX} at most")
    return tuple(
        _check_term(term, numbers, f"{where}, term {i}", impulses) for i, term in enumerate(terms, 1)
    )


def _check_term(term: Term, numbers: tuple[str, ...], where: str, impulses: bool) -> Term:
    coefficient = to_float(term.coefficient)
    if not math.isfinite(coefficient):
        raise ModelError(f"{where}: the coefficient {term.coefficient!r} is not a finite number")
    for name, exponent in term.powers.items():
        if name not in numbers:
            raise ModelError(f"{where}: {name!r} is not in the source set ({', '.join(numbers)})")
        if isinstance(exponent, bool) or not isinstance(exponent, int) or not 0 <= exponent <= EXPONENT_MAX:
            raise ModelError(
                f"{where}: the exponent of {name} must be a whole number 0..{EXPONENT_MAX}, not {exponent!r}"
            )
    if term.when is not None:
        if not impulses:
            raise ModelError(f"{where}: only a numerator may have an impulse")
        select, value = term.when
        limit = select_limits().get(select, -1) if select in numbers else -1
        if limit < 0:
            raise ModelError(
                f"{where}: the impulse asks for {select!r}, which is no select of the source set"
            )
        if not isinstance(value, int) or not 0 <= value <= limit:
            raise ModelError(f"{where}: the impulse asks for {select} = {value!r}, which must be 0..{limit}")
    powers = {name: int(term.powers[name]) for name in numbers if term.powers.get(name)}
    return Term(coefficient, powers, None if term.when is None else (term.when[0], int(term.when[1])))


def _dict_from_links(links: Sequence[Link]) -> dict[str, Any]:
    """Return links as lists, dicts, strings and numbers."""
    return {
        "links": [
            {
                "source": list(link.source),
                "destination": {
                    name: {
                        "numerator": [_term_data(term) for term in function.numerator],
                        "denominator": [_term_data(term) for term in function.denominator],
                    }
                    for name, function in link.functions.items()
                },
            }
            for link in links
        ]
    }


def _links_from_dict(data: object) -> list[Link]:
    """Return the links in what `_dict_from_links` wrote. Raise ModelError naming the entry that is wrong."""
    top = _object(data, "the FIT", {"links"})
    links = []
    for number, entry in enumerate(_list(top.get("links"), "the links of the FIT"), 1):
        where = f"link {number} of the FIT"
        link = _object(entry, where, {"source", "destination"})
        source = _list(link.get("source"), f"{where}: source")
        if not all(isinstance(name, str) for name in source):
            raise ModelError(f"{where}: source must be a list of names of FAPs")
        functions = {
            name: _function(function, f"{where}, {name}")
            for name, function in _object(link.get("destination"), f"{where}: destination", None).items()
        }
        links.append(Link(tuple(source), functions))
    return links


def _term_data(term: Term) -> dict[str, Any]:
    data: dict[str, Any] = {"coefficient": term.coefficient}
    if term.powers:
        data["powers"] = dict(term.powers)
    if term.when is not None:
        data["when"] = {term.when[0]: term.when[1]}
    return data


def _function(data: object, where: str) -> Function:
    parts = _object(data, where, {"numerator", "denominator"})
    return Function(
        *(
            tuple(
                _term(term, f"{where}, {part}, term {i}")
                for i, term in enumerate(_list(parts.get(part, []), f"{where}: {part}"), 1)
            )
            for part in ("numerator", "denominator")
        )
    )


def _term(data: object, where: str) -> Term:
    term = _object(data, where, {"coefficient", "powers", "when"})
    if "coefficient" not in term:
        raise ModelError(f"{where} has no coefficient")
    when = _object(term.get("when", {}), f"{where}: when", None)
    if len(when) > 1:
        raise ModelError(f"{where}: when must name one select, not {len(when)}")
    return Term(
        term["coefficient"],
        _object(term.get("powers", {}), f"{where}: powers", None),
        next(iter(when.items()), None),
    )


def _object(data: object, where: str, keys: set[str] | None) -> dict[str, Any]:
    if not isinstance(data, dict) or not all(isinstance(key, str) for key in data):
        raise ModelError(f"{where} must be an object of names, not {type(data).__name__}")
    unknown = sorted(set(data) - keys) if keys is not None else []
    if unknown:
        raise ModelError(
            f"{where}: {unknown[0]!r} is unknown here; there are {', '.join(sorted(keys or ()))}"
        )
    return data


def _list(data: object, where: str) -> list[Any]:
    if not isinstance(data, (list, tuple)):
        raise ModelError(f"{where} must be a list, not {type(data).__name__}")
    return list(data)
