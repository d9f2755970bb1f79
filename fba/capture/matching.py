"""Which source joint is which joint of the standard: families of names, as data (joint_names.csv)."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from fba.errors import ModelError

REQUIRED = ("HumanoidRoot",)
"""Joints without which nothing can be placed."""
FEWEST = 5
"""A family fits where at least so many of its names are found."""


@cache
def families() -> dict[str, dict[str, str]]:
    """Per family: simplified source name -> joint of the standard."""
    result: dict[str, dict[str, str]] = {}
    text = (files(__package__) / "joint_names.csv").read_text(encoding="utf-8")
    for row in csv.DictReader(text.splitlines()):
        result.setdefault(row["family"], {})[simplified(row["source"])] = row["joint"]
    return result


def simplified(name: str) -> str:
    """Letters and digits only, lower case, without a namespace: "mixamorig:LeftUp_Leg" -> "leftupleg"."""
    return re.sub(r"[^a-z0-9]", "", name.rpartition(":")[2].lower())


def match(names: Sequence[str]) -> tuple[str, dict[str, int]]:
    """The family that fits most names, and joint of the standard -> number of the source joint.

    A prefix that all names share ("Bob_Hips", "Bob_Spine") is tried without, too. Where two source
    joints have the same name, the first counts. ModelError where no family fits.
    """
    best: tuple[str, dict[str, int]] = ("", {})
    for prefix in ("", *_shared_prefixes(names)):
        plain = [simplified(name[len(prefix) :]) for name in names]
        for family, table in families().items():
            found: dict[str, int] = {}
            for number, name in enumerate(plain):
                joint = table.get(name)
                if joint is not None:
                    found.setdefault(joint, number)
            if len(found) > len(best[1]) and all(joint in found for joint in REQUIRED):
                best = (family, found)
    if len(best[1]) < FEWEST:
        some = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
        raise ModelError(
            f"no known skeleton family fits these {len(names)} joint names: {some}; "
            "pass joints={source name: joint of the standard}, e.g. joints={'Pelvis': 'HumanoidRoot', ...}"
        )
    return best


def _shared_prefixes(names: Sequence[str]) -> list[str]:
    if len(names) < 2:
        return []
    low, high = min(names), max(names)
    length = 0
    while length < min(len(low), len(high)) and low[length] == high[length]:
        length += 1
    shared = low[:length]
    cut = max(shared.rfind(mark) for mark in "_ .-|")
    return [text for text in (shared[: cut + 1], shared) if text]
