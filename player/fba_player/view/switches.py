"""What can be switched on and off in a picture: a table, and the state of one scene's switches."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from importlib.resources import files

from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, fap_numbers, faps

Value = bool | str | int | None
"""Of a flag, whether it is on; of a choice, the chosen word; of a FAP, its number or None."""

ON, OFF = ("on", "yes", "true", "1"), ("off", "no", "false", "0", "none")


@dataclass(frozen=True, slots=True)
class Switch:
    """One switch.

    name: what `Scene.show` calls it. key: label of the key for it, "" for none. label: a few words for a
    panel. kind: "flag", "choice" or "fap". default: its value in a new scene. choices: of a choice, the
    first of them is what it is when it is off. description: one line.
    """

    name: str
    key: str
    label: str
    kind: str
    default: Value
    choices: tuple[str, ...]
    description: str

    def checked(self, value: object) -> Value:
        """The value that a switch gets for True, False, None, a word or a FAP's name or number.

        Raises ValueError for what it cannot be, naming what it can be.
        """
        if self.kind == "flag":
            return self._flag(value)
        if self.kind == "choice":
            return self._choice(value)
        return self._fap(value)

    def next(self, value: Value) -> Value:
        """What a key turns a flag or a choice to; a FAP goes off, or on to open_jaw."""
        if self.kind == "flag":
            return not value
        if self.kind == "choice":
            return self.choices[(self.choices.index(str(value)) + 1) % len(self.choices)]
        return FIRST_LOW_LEVEL_FAP if value is None else None

    def _flag(self, value: object) -> bool:
        word = str(value).lower()
        if value is not None and word not in ON + OFF:
            raise ValueError(f"{self.name} is on or off, not {value!r}")
        return value is not None and word in ON

    def _choice(self, value: object) -> str:
        if value in (None, False, "off"):
            return self.choices[0]
        if value in (True, "on"):
            return self.choices[1]
        if value not in self.choices:
            raise ValueError(f"{self.name} is one of {', '.join(self.choices)}, not {value!r}")
        return str(value)

    def _fap(self, value: object) -> int | None:
        if value is None or value is False or value in ("off", "none", ""):
            return None
        if value is True or value == "on":
            raise ValueError(f"{self.name} needs a FAP: write e.g. {self.name}=open_jaw")
        text = str(value).strip()
        numbers = fap_numbers()
        number = int(text[:9]) if text.isdecimal() else numbers.get(text, 0)
        if not FIRST_LOW_LEVEL_FAP <= number <= FAP_COUNT:
            low = [name for name, number in numbers.items() if number >= FIRST_LOW_LEVEL_FAP]
            near = get_close_matches(text, low, n=3)
            hint = f" (near: {', '.join(near)})" if near else ""
            raise ValueError(
                f"{self.name}: there is no low-level FAP {text!r}{hint}; they have names, or numbers "
                f"{FIRST_LOW_LEVEL_FAP}..{FAP_COUNT}"
            )
        return number


@cache
def _table() -> dict[str, Switch]:
    text = (files(__package__) / "switches.csv").read_text(encoding="utf-8")
    found: dict[str, Switch] = {}
    for row in csv.DictReader(text.splitlines()):
        choices = tuple(row["choices"].split())
        default: Value = {"flag": row["default"] == "on", "choice": row["default"], "fap": None}[row["kind"]]
        name = row["name"]
        found[name] = Switch(
            name, row["key"], row["label"], row["kind"], default, choices, row["description"]
        )
    return found


SWITCHES: Mapping[str, Switch] = _table()
"""All switches by name, in the order of a panel."""


class Switches(Mapping[str, Value]):
    """The switches of one scene: a mapping of names to values, set by `show`.

    version: counts the changes, so that what was drawn before one can be told from what comes after.
    """

    def __init__(self) -> None:
        self._values: dict[str, Value] = {name: switch.default for name, switch in SWITCHES.items()}
        self.version = 0

    def __getitem__(self, name: str) -> Value:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def show(self, name: str, on: object = True) -> None:
        """Set a switch: True, False, a choice's word, or a FAP by name or number (None for none).

        Raises ValueError for a switch that does not exist or a value that it cannot have.
        """
        value = _named(name).checked(on)
        if value != self._values[name]:
            self._values[name] = value
            self.version += 1

    def press(self, name: str) -> None:
        """What the switch's key does: a flag turns over, a choice goes on to its next."""
        self.show(name, _named(name).next(self._values[_named(name).name]))

    @property
    def changed(self) -> dict[str, Value]:
        """Those that are not as in a new scene."""
        return {name: value for name, value in self._values.items() if value != SWITCHES[name].default}

    def text(self, name: str) -> str:
        """A switch's value in a word: "on", "off", a choice, or a FAP's name."""
        value = self._values[name]
        if SWITCHES[name].kind == "fap":
            return "off" if value is None else faps()[int(value) - 1].name
        return str(value) if isinstance(value, str) else "on" if value else "off"


def parse_switch(text: str) -> tuple[str, Value]:
    """NAME or NAME=VALUE as it is written in a command: what to hand to `Scene.show`.

    Raises ValueError as `Switches.show`.
    """
    name, equals, value = text.partition("=")
    name = name.strip()
    return name, _named(name).checked(value.strip() if equals else True)


def _named(name: str) -> Switch:
    if name not in SWITCHES:
        near = get_close_matches(str(name), list(SWITCHES), n=1)
        hint = f" (near: {near[0]})" if near else ""
        raise ValueError(f"there is no switch {name!r}{hint}; there are {', '.join(SWITCHES)}")
    return SWITCHES[name]
