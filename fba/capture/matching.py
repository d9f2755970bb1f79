"""Which source joint is which joint of the standard: families of names, as data (joint_names.csv).

A source "(Left|Right)Arm" stands for both sides, its joint "?_shoulder" for l_shoulder and r_shoulder.
Besides the families of the file, the standard's own names are one, "h-anim".
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from fba.errors import ModelError, Remedy
from fba.parameters import joints

REQUIRED = ("HumanoidRoot",)
"""Joints without which nothing can be placed."""
FEWEST = 5
"""A family fits where at least so many of its names are found."""


PREFIX_NAMES = 8
"""Of the first so many names, each may be the beginning of the others: "Bip01", "Bip01 Pelvis"."""


@cache
def families() -> dict[str, dict[str, str]]:
    """Per family: simplified source name -> joint of the standard."""
    result: dict[str, dict[str, str]] = {}
    text = (files(__package__) / "joint_names.csv").read_text(encoding="utf-8")
    for row in csv.DictReader(text.splitlines()):
        family = result.setdefault(row["family"], {})
        sides = re.search(r"\((\w+)\|(\w+)\)", row["source"])
        if sides is None:
            family[simplified(row["source"])] = row["joint"]
            continue
        for side, word in zip("lr", sides.groups(), strict=True):
            source = row["source"].replace(sides[0], word)
            family[simplified(source)] = row["joint"].replace("?", side)
    result["h-anim"] = {simplified(joint.name): joint.name for joint in joints()}
    return result


def simplified(name: str) -> str:
    """Letters and digits only, lower case, without a namespace: "mixamorig:LeftUp_Leg" -> "leftupleg"."""
    return re.sub(r"[^a-z0-9]", "", name.rpartition(":")[2].lower())


def match(names: Sequence[str]) -> tuple[str, dict[str, int]]:
    """The family that fits most names, and joint of the standard -> number of the source joint.

    A prefix that most names share ("Bob_Hips", "Bob_Spine") is tried without, too. Where two source
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
            f"no known skeleton family fits these {len(names)} joint names: {some}"
        ).with_remedies(
            Remedy(
                "joints",
                "name each joint's counterpart in the standard with {}",
                "{'Pelvis': 'HumanoidRoot', ...}",
            )
        )
    return best


def _shared_prefixes(names: Sequence[str]) -> list[str]:
    """Beginnings, up to and with a separator, or the whole of a name, that half of the names or more
    share."""
    counts: Counter[str] = Counter()
    for name in names:
        counts.update({name[: mark.end()] for mark in re.finditer(r"[_ .|-]+", name)})
    counts.update({name: sum(n.startswith(name) for n in names) for name in names[:PREFIX_NAMES]})
    many = [prefix for prefix, count in counts.items() if 2 * count >= len(names) > 1]
    return sorted(many, key=len)
