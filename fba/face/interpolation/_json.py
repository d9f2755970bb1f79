"""The FIT as lists and dicts, for JSON.

    {"links": [{"source": ["expression"],
                "destination": {"raise_l_cornerlip": {
                    "numerator": [{"coefficient": 0.6, "powers": {"expression_intensity1": 1},
                                   "when": {"expression_select1": 6}}],
                    "denominator": []}}}]}

"powers", "when" and an empty "denominator" may be absent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fba.errors import ModelError
from fba.face.interpolation.terms import Function, Link, Term


def dict_from_links(links: Sequence[Link]) -> dict[str, Any]:
    """Links as lists, dicts, strings and numbers."""
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


def links_from_dict(data: object) -> list[Link]:
    """The links in what `dict_from_links` wrote. Raises ModelError naming the entry that is wrong."""
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
