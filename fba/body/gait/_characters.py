"""Characters of walkers: four characteristic poses and a posture each, from poses.csv and characters.json.

corrections.csv has corrections of the curves through the poses; `tools/fit_gait.py` fits those of `normal` to
measured people.

Table 5-2 of the source (see `fba.body.gait`). The poses describe half a cycle: `stance` is the leg that
carries the body, `swing` the other one (in the extended pose the rear one, which swings next). In the other
half the sides are exchanged. A cell that a character leaves empty is as in `normal`.
"""

from __future__ import annotations

import difflib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from fba.errors import ModelError
from fba.text_files import packaged_rows

POSES = ("extended", "recoil", "passing", "anticipation")
LEGS = ("stance", "swing")
CYCLE = 32
"""Frames of the source's cycle; its poses are 4 frames apart."""
PHASES = tuple(4 * number / CYCLE for number in range(len(POSES)))
"""Times of the poses, as fractions of the cycle: 0, 12, 25 and 37 % in the source's rounding."""
_FIELDS = ("thigh", "knee", "foot", "out", "down", "forward")
_MAX_DEGREES = 170.0


@dataclass(frozen=True)
class Pose:
    """One leg in one pose, and the palm on its side. Degrees.

    thigh: forward angle from the vertical; used only where the leg swings freely, as elsewhere the stride
    determines it. knee: bend. foot: pitch of the sole, toes up (+) or down (-); 0 is the source's
    hip + knee = ankle. out, down, forward: position of the palm from the shoulder, in lengths of the arm.
    """

    thigh: float
    knee: float
    foot: float
    out: float
    down: float
    forward: float


@dataclass(frozen=True)
class Pelvis:
    """Motion of the pelvis.

    turn: degrees about y by which the side of the front leg is ahead in the extended pose (the source's Z).
    list: degrees about z by which the swinging side drops in the passing pose (the source's Y).
    tilt: degrees by which the whole body leans forward from the hips.
    sway: metres to the side of the leg that carries the body. surge: share by which the speed rises and falls
    twice a cycle.
    """

    turn: float
    list: float
    tilt: float
    sway: float
    surge: float


@dataclass(frozen=True)
class Feet:
    """When a foot rolls over the ground: fractions of the cycle, from its contact on.

    flat: it lies flat. rises: its heel begins to rise. leaves: its toes leave the ground.
    """

    flat: float
    rises: float
    leaves: float


@dataclass(frozen=True)
class Spine:
    """Posture and motion of the spine.

    lumbar, thorax, neck, head: degrees bent forward. turn: largest turn of the shoulders against that of the
    pelvis, degrees; the head keeps looking ahead. lean: degrees of the chest to the side of the leg that
    carries the body. nod: degrees of the head, twice a cycle.
    """

    lumbar: float
    thorax: float
    neck: float
    head: float
    turn: float
    lean: float
    nod: float


@dataclass(frozen=True)
class Arms:
    """Posture of the arms.

    up, forward: degrees of the shoulder girdle. twist: degrees of the upper arm, which turns
    the elbow outward.
    wrist: degrees. trail: degrees by which the hand trails behind the arm as it swings. pronation: degrees by
    which the palm faces backwards. curl: degrees of each finger joint.
    """

    up: float
    forward: float
    twist: float
    wrist: float
    trail: float
    pronation: float
    curl: float


Corrections = Mapping[str, tuple[tuple[float, float], ...]]
"""Corrections of the curves through the poses, by `CORRECTED`: (phase, degrees), while the leg swings."""
CORRECTED = ("thigh", "knee", "foot")
"""Degrees of a swinging thigh, of its knee, and of the pitch of its foot, at phases of that leg's cycle."""


@dataclass(frozen=True)
class Character:
    """A character of walk.

    seconds: of a cycle. stride: metres from one contact of a foot to its next; width: metres between the
    lines of the two feet; both for the default body, whose hips are 0.936 m high. toes_out: degrees.
    poses: by (pose, leg), all eight. corrections: of the curves through them, usually empty.

    ModelError where a pose is missing, or a number is not finite or too large.
    """

    name: str
    about: str
    seconds: float
    stride: float
    width: float
    toes_out: float
    feet: Feet
    pelvis: Pelvis
    spine: Spine
    arms: Arms
    poses: Mapping[tuple[str, str], Pose]
    corrections: Corrections = field(default_factory=dict)

    def __post_init__(self) -> None:
        missing = [f"{pose} {leg}" for pose in POSES for leg in LEGS if (pose, leg) not in self.poses]
        if missing:
            raise ModelError(f"gait character {self.name!r}: no {', '.join(missing)} in its poses")
        for what, value, low, high in (
            ("seconds", self.seconds, 0.2, 20.0),
            ("stride", self.stride, 0.0, 10.0),
            ("width", self.width, -1.0, 2.0),
        ):
            if not low < value < high:
                raise ModelError(
                    f"gait character {self.name!r}: {what} must lie within {low:g}..{high:g}, not {value!r}"
                )
        for group, part in (
            ("feet", self.feet), ("pelvis", self.pelvis), ("spine", self.spine), ("arms", self.arms),
            *((" ".join(key), pose) for key, pose in self.poses.items()),
        ):  # fmt: skip
            for name, value in vars(part).items():
                if not (np.isfinite(value) and abs(value) <= _MAX_DEGREES):
                    raise ModelError(
                        f"gait character {self.name!r}: {group}, {name} must be a number of at most "
                        f"{_MAX_DEGREES:g}, not {value!r}"
                    )
        feet = self.feet
        if not (0.0 < feet.flat < PHASES[1] and feet.flat < feet.rises < 0.5 < feet.leaves < 0.5 + PHASES[1]):
            raise ModelError(
                f"gait character {self.name!r}: feet must lie flat before {PHASES[1]:g} of the cycle, rise "
                f"before 0.5 and leave the ground by {0.5 + PHASES[1]:g}, not at {feet.flat:g}, "
                f"{feet.rises:g} and {feet.leaves:g}"
            )

    @staticmethod
    def named(name: str) -> Character:
        """Return a built-in character by name; ModelError, which lists the names, for an unknown one."""
        table = _characters()
        if not isinstance(name, str) or name not in table:
            close = difflib.get_close_matches(str(name), table, 1)
            hint = f"did you mean {close[0]!r}? " if close else ""
            raise ModelError(f"no gait character {name!r}; {hint}there are {', '.join(table)}")
        return table[name]

    def edited(self, pose: str, leg: str, **changes: float) -> Character:
        """Return the character with changed values in one pose: `edited("passing", "swing", knee=80)`.

        Corrections of these curves are left out: they were fitted to the unchanged poses.
        """
        if (pose, leg) not in self.poses:
            raise ModelError(
                f"no pose {pose!r} of a {leg!r} leg; poses are {', '.join(POSES)}, legs {', '.join(LEGS)}"
            )
        unknown = set(changes) - set(_FIELDS)
        if unknown:
            raise ModelError(f"a pose has no {sorted(unknown)[0]!r}; it has {', '.join(_FIELDS)}")
        poses = dict(self.poses)
        poses[pose, leg] = replace(poses[pose, leg], **changes)
        corrections = {curve: points for curve, points in self.corrections.items() if curve not in changes}
        return replace(self, poses=poses, corrections=corrections)

    def curve(self, field: str) -> list[float]:
        """Return eight values of a field in one cycle of a leg, from the contact of its foot on."""
        return [getattr(self.poses[pose, leg], field) for leg in LEGS for pose in POSES]


def characters() -> tuple[str, ...]:
    """Return the names of all built-in characters, `normal` first."""
    return tuple(_characters())


@cache
def _characters() -> dict[str, Character]:
    text = (files(__package__) / "characters.json").read_text(encoding="utf-8")
    table: dict[str, Any] = json.loads(text)
    poses: dict[tuple[str, str, str], Pose] = {}
    for row in packaged_rows(__package__, "poses.csv"):
        base = poses.get(("normal", row["pose"], row["leg"]))
        cells = {f: float(row[f]) if row[f] else getattr(base, f, 0.0) for f in _FIELDS}
        poses[row["character"], row["pose"], row["leg"]] = Pose(**cells)
    corrections: dict[str, dict[str, tuple[tuple[float, float], ...]]] = {}
    for row in packaged_rows(__package__, "corrections.csv"):
        curves = corrections.setdefault(row["character"], {})
        curves[row["curve"]] = (*curves.get(row["curve"], ()), (float(row["phase"]), float(row["value"])))
    result = {}
    normal = table["normal"]
    for name, row in table.items():
        parts = {key: {**normal[key], **row.get(key, {})} for key in ("feet", "pelvis", "spine", "arms")}
        values = {**normal, **row}
        result[name] = Character(
            name,
            values["about"],
            float(values["seconds"]),
            float(values["stride"]),
            float(values["width"]),
            float(values["toes_out"]),
            Feet(**parts["feet"]),
            Pelvis(**parts["pelvis"]),
            Spine(**parts["spine"]),
            Arms(**parts["arms"]),
            {(p, g): poses.get((name, p, g), poses["normal", p, g]) for p in POSES for g in LEGS},
            corrections.get(name, {}),
        )
    return result
