"""Options of commands from fields: those of dataclasses, and the parameters of the command itself.

A field or parameter with `option` becomes an option with its name, type and default. A field or parameter
whose type is a dataclass stands for all options of that dataclass::

    @dataclass(frozen=True, kw_only=True)
    class Walk:
        stride: float | None = option(metavar="METRES", help="Length of two steps.")
        in_place: bool = option(default=False, help="Walk on the spot.")

    @click.command()
    @with_options
    def command(walk: Walk, as_json: bool = option(default=False, help="Print JSON.")) -> None: ...
"""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Iterator
from dataclasses import MISSING, Field, field, fields, is_dataclass
from fractions import Fraction
from typing import Any, Literal, cast, get_args, get_origin, get_type_hints

import click

from fba.cli.command import Decorated

_OPTION, _GROUP = "option", "group"
"""Keys of the metadata of fields."""


def option(*flags: str, default: Any = None, typed: str = "", required: bool = False, **settings: Any) -> Any:
    """Return a dataclass field, or a default of a parameter, that is an option of a command.

    flags: as the user types them; by default the name of the field: --in-place for `in_place`. A bool is a
    switch: with the default False it has this flag alone, else also --no-.... typed: the default as the user
    types it, if its type has another text. settings: of `click.Option`; they replace those of the type.
    Dataclasses may share a field under the same name, if all are `kw_only`.
    """
    if required:
        settings["required"] = True
    if typed:
        settings["default"] = typed
    return field(default=MISSING if required else default, metadata={_OPTION: (flags, settings)})


def option_like(kind: type, name: str, *flags: str, by_default: str = "", **settings: Any) -> Any:
    """Return an option with the default and the text of a field of a dataclass of the library.

    The text is that of the field in the docstring of the dataclass. by_default: the effect of the default
    None, added to the text. settings: as for `option`, in place of these.
    """
    default = next(each.default for each in fields(kind) if each.name == name)
    text = documented(kind, name) + (f" Default: {by_default}." if by_default else "")
    return option(*flags, **{"default": default, "help": text, **settings})


def group(*names: str, **changed: Any) -> Any:
    """Return a field, or a default of a parameter, that stands for the options of the dataclass of its type.

    names: fields that are options here, by default all. changed: other options for some of them.
    """
    return field(metadata={_GROUP: (names, changed)})


def documented(kind: type, name: str) -> str:
    """Return the text of a field in the docstring of a dataclass: the paragraph that begins "name: "."""
    pattern = rf"^(?:\w+, )*{name}(?:, \w+)*: (.*(?:\n {{4}}.*)*)"
    # Python 3.13 takes the indentation off docstrings itself.
    match = re.search(pattern, inspect.cleandoc(kind.__doc__ or ""), re.MULTILINE)
    text = " ".join(match[1].split()) if match else ""
    return text[:1].upper() + text[1:]


def with_options(command: Decorated) -> Decorated:
    """Add the options of the parameters of a function, which gets their values.

    Other parameters get the values of other decorators.
    """
    parameters = inspect.signature(command).parameters
    hints = {name: _resolved(each.annotation, command) for name, each in parameters.items()}
    asked = {
        name: (hints[name], _field(parameter.default))
        for name, parameter in parameters.items()
        if isinstance(parameter.default, Field) or is_dataclass(hints[name])
    }

    @functools.wraps(command)
    def calling(**values: Any) -> Any:
        made = {name: _value(name, hint, used, values) for name, (hint, used) in asked.items()}
        return command(**made, **values)

    decorated: Any = calling
    for add in reversed([add for name, (hint, used) in asked.items() for add in _options(name, hint, used)]):
        decorated = add(decorated)
    return cast("Decorated", decorated)


def _field(default: Any) -> Field[Any]:
    """Return the field that is the default of a parameter, else a field for all options of a dataclass."""
    return cast("Field[Any]", default if isinstance(default, Field) else group())


def _resolved(annotation: Any, command: Callable[..., Any]) -> Any:
    """Return the type of an annotation; None for a name that only type checkers know."""
    if not isinstance(annotation, str):
        return annotation
    try:
        return eval(annotation, inspect.unwrap(command).__globals__)
    except NameError:
        return None


def _members(kind: type, group_field: Field[Any]) -> Iterator[tuple[str, Any, Field[Any]]]:
    """Yield name, type and field of the members of a dataclass that are options or groups of options."""
    names, changed = group_field.metadata.get(_GROUP, ((), {}))
    hints = get_type_hints(kind)
    inherited_last = sorted(fields(kind), key=lambda member: member.name not in kind.__annotations__)
    for member in inherited_last:
        name, hint = member.name, hints[member.name]
        used: Field[Any] = changed.get(name, member)
        is_option = _OPTION in used.metadata or _GROUP in used.metadata or is_dataclass(hint)
        if is_option and (not names or name in names or name in changed):
            yield name, hint, used


def _options(name: str, hint: Any, used: Field[Any]) -> Iterator[Callable[[Any], Any]]:
    """Yield the decorators of click for an option, or for all options of a dataclass."""
    if _OPTION not in used.metadata:
        for member in _members(hint, used):
            yield from _options(*member)
        return
    flags, given = used.metadata[_OPTION]
    settings = _settings(hint, used.default) | given
    if settings.get("multiple"):
        del settings["default"]  # that of click is ()
    both = settings.pop("both", False)
    if not flags:
        flag = name.replace("_", "-")
        flags = (f"--{flag}/--no-{flag}" if both else f"--{flag}",)
    yield click.option(name, *flags, **settings)


def _value(name: str, hint: Any, used: Field[Any], values: dict[str, Any]) -> Any:
    """Take the value of an option, or an instance of a dataclass, out of the values of a command."""
    if _OPTION in used.metadata:
        return values.pop(name)
    made = {member: _value(member, kind, field, values) for member, kind, field in _members(hint, used)}
    made |= {each.name: values.pop(each.name) for each in fields(hint) if each.name in values}
    return hint(**made)


def _settings(hint: Any, default: Any) -> dict[str, Any]:
    """Return the settings of `click.Option` that follow from a type and a default."""
    settings: dict[str, Any] = {}
    if default is not MISSING:
        shown = default not in (None, False, "") and isinstance(default, str | float | int | Fraction)
        settings = {"default": default, "show_default": shown}
    parts = [part for part in get_args(hint) if part is not type(None)]
    if type(None) in get_args(hint) and len(parts) == 1:
        hint = parts[0]
    if get_origin(hint) is tuple and get_args(hint)[-1] is Ellipsis:
        hint = get_args(hint)[0]
        settings["multiple"] = True
    if get_origin(hint) is Literal:
        return settings | {"type": click.Choice(get_args(hint))}
    if hint is bool:
        return settings | ({"is_flag": True} if default is False else {"both": True})
    return settings | ({"type": hint} if hint in (int, float, str) else {})
