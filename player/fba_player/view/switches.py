"""Display switches of a scene: the table of all of them, and their state in one scene."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from enum import StrEnum
from functools import cache

from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, fap_numbers, faps
from fba.text_files import packaged_rows

Value = bool | str | int | None
"""A flag's bool, a choice's word, or a FAP's number (None for none)."""

ON = ("on", "yes", "true", "1")
OFF = ("off", "no", "false", "0", "none")


class Quality(StrEnum):
    """FAST pictures have edges smoothed along outlines, FINE ones several samples per pixel."""

    FAST = "fast"
    FINE = "fine"

    @property
    def samples(self) -> int:
        """Samples per pixel; 0 is one, with edges smoothed afterwards."""
        return 4 if self is Quality.FINE else 0


@dataclass(frozen=True, slots=True)
class Switch:
    """One switch.

    name: as in `Scene.show`. key: label of its key, "" for none. label: a few words for a panel. kind:
    "flag", "choice" or "fap". default: its value in a new scene. choices: the words of a choice, the first of
    which means off. description: one line.
    """

    name: str
    key: str
    label: str
    kind: str
    default: Value
    choices: tuple[str, ...]
    description: str

    def parse(self, value: object) -> Value:
        """Return the switch's value for True, False, None, a word, or a FAP's name or number.

        Raises ValueError for an invalid value, and names the valid ones.
        """
        if self.kind == "flag":
            return self._flag(value)
        if self.kind == "choice":
            return self._choice(value)
        return self._fap(value)

    def next(self, value: Value) -> Value:
        """Return the value after `value` when the key is pressed.

        A flag turns over, a choice moves on, a FAP turns off, or on to open_jaw.
        """
        if self.kind == "flag":
            return not value
        if self.kind == "choice":
            return self.choices[(self.choices.index(str(value)) + 1) % len(self.choices)]
        return FIRST_LOW_LEVEL_FAP if value is None else None

    def _flag(self, value: object) -> bool:
        word = str(value).lower()
        if value is not None and word not in ON + OFF:
            raise ValueError(f"{self.name} must be on or off, not {value!r}")
        return value is not None and word in ON

    def _choice(self, value: object) -> str:
        if value in (None, False, "off"):
            return self.choices[0]
        if value in (True, "on"):
            return self.choices[1]
        if value not in self.choices:
            raise ValueError(f"{self.name} must be one of {', '.join(self.choices)}, not {value!r}")
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
                f"{self.name}: no low-level FAP {text!r}{hint}; give a name or a number in "
                f"{FIRST_LOW_LEVEL_FAP}..{FAP_COUNT}"
            )
        return number


@cache
def _table() -> dict[str, Switch]:
    table: dict[str, Switch] = {}
    for row in packaged_rows(__package__, "switches.csv"):
        choices = tuple(row["choices"].split())
        default: dict[str, Value] = {"flag": row["default"] == "on", "choice": row["default"], "fap": None}
        shown = row["name"], row["key"], row["label"], row["kind"]
        table[row["name"]] = Switch(*shown, default[row["kind"]], choices, row["description"])
    return table


SWITCHES: Mapping[str, Switch] = _table()
"""All switches by name, in the order in which a panel lists them."""


def samples_of(switches: Switches, usual: int) -> int:
    """Return the samples per pixel that the switch "quality" asks for; `usual` for "auto"."""
    quality = str(switches["quality"])
    return usual if quality == "auto" else Quality(quality).samples


class Switches(Mapping[str, Value]):
    """The switches of one scene: a mapping of names to values, set by `show`.

    version: increases with every change, so that a picture drawn before can be recognised as outdated.
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
        """Set a switch to True, False, a choice's word, or a FAP by name or number (None for none).

        Raises ValueError for an unknown switch or an invalid value.
        """
        value = _find_switch(name).parse(on)
        if value != self._values[name]:
            self._values[name] = value
            self.version += 1

    def press(self, name: str) -> None:
        """Do what the switch's key does: turn a flag over, move a choice on to its next word."""
        switch = _find_switch(name)
        self.show(name, switch.next(self._values[name]))

    @property
    def changed(self) -> dict[str, Value]:
        """The switches that differ from a new scene's, with their values."""
        return {name: value for name, value in self._values.items() if value != SWITCHES[name].default}

    def text(self, name: str) -> str:
        """Return a switch's value as text: "on", "off", a choice's word, or a FAP's name."""
        value = self._values[name]
        if SWITCHES[name].kind == "fap":
            return "off" if value is None else faps()[int(value) - 1].name
        return str(value) if isinstance(value, str) else "on" if value else "off"


def parse_switch(text: str) -> tuple[str, Value]:
    """Return the arguments of `Scene.show` for NAME or NAME=VALUE as written on a command line.

    Raises ValueError as `Switches.show` does.
    """
    name, equals, value = text.partition("=")
    name = name.strip()
    return name, _find_switch(name).parse(value.strip() if equals else True)


def _find_switch(name: str) -> Switch:
    if name not in SWITCHES:
        near = get_close_matches(str(name), list(SWITCHES), n=1)
        hint = f" (near: {near[0]})" if near else ""
        raise ValueError(f"no switch {name!r}{hint}; choose from {', '.join(SWITCHES)}")
    return SWITCHES[name]
