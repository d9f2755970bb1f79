"""Body definition parameters: the joint centres of the sender's body.

Three behaviours of a decoder (K. Karpouzis, Adaptive parametric models of human faces and bodies, chapter 4):
"simple" ignores the definition and moves its own generic body; "calibration" scales the generic body's
segments to the sent joint centres; and "predictable" replaces it with the sent body.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from fba.arrays import Float64, Int64
from fba.body._skeleton import MAX_JOINTS, Skeleton
from fba.errors import ModelError
from fba.source import Path, read_whole

MAX_BYTES = 1 << 24
"""Largest file of a definition: 4096 joints take less than 1 MB."""
Profile = Literal["simple", "calibration", "predictable"]


@dataclass(frozen=True)
class BodyDefinition:
    """Joints of a sender's body.

    centres: name -> (3,) metres, default posture, origin on the ground. parents: name -> parent, None for the
    root; empty where only centres were sent. Raises ModelError where a centre is not three finite numbers.
    """

    centres: Mapping[str, Sequence[float]]
    parents: Mapping[str, str | None] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if len(self.centres) > MAX_JOINTS:
            raise ModelError(f"BodyDefinition: {len(self.centres)} joints are more than {MAX_JOINTS}")
        for name, centre in self.centres.items():
            if (
                not isinstance(centre, Sequence | np.ndarray)
                or len(centre) != 3
                or not all(map(_finite, centre))
            ):
                raise ModelError(
                    f"BodyDefinition: the centre of {str(name)[:60]!r} must be 3 finite numbers, "
                    f"not {_short(centre)}"
                )

    @classmethod
    def load(cls, path: Path) -> BodyDefinition:
        """Load JSON: {"joints": {"l_hip": {"centre": [x, y, z], "parent": "sacroiliac"}, ...}}.

        "parent" may be left out of all joints. Raises FormatError where the file cannot be read, ModelError
        where its content is different.
        """
        file = os.fspath(path) if isinstance(path, str | os.PathLike) else "the file"
        data = read_whole(path)
        if len(data) > MAX_BYTES:
            raise ModelError(f"{file}: is {len(data)} bytes long, more than the {MAX_BYTES} that can be read")
        try:
            document = json.loads(data)
        except (ValueError, RecursionError) as error:
            raise ModelError(f"{file}: is not JSON: {error}") from None
        joints = document.get("joints") if isinstance(document, dict) else None
        if not isinstance(joints, dict) or not all(
            isinstance(j, dict) and "centre" in j for j in joints.values()
        ):
            raise ModelError(f'{file}: expected {{"joints": {{name: {{"centre": [x, y, z]}}}}}}')
        parents: dict[str, Any] = {
            name: joint["parent"] for name, joint in joints.items() if "parent" in joint
        }
        if not all(parent is None or isinstance(parent, str) for parent in parents.values()):
            raise ModelError(f"{file}: a parent must be the name of a joint, or null for the root")
        return cls({name: joint["centre"] for name, joint in joints.items()}, parents)

    def skeleton(self, profile: Profile = "calibration", generic: Skeleton | None = None) -> Skeleton:
        """Return the skeleton that a decoder of this profile moves.

        profile: a `Profile`. generic: the decoder's body, by default the built-in one. Raises
        ModelError for "predictable" if parents are missing or contradict each other.
        """
        if profile not in get_args(Profile):
            raise ValueError(f"profile must be one of {', '.join(get_args(Profile))}, not {profile!r}")
        generic = generic if generic is not None else Skeleton.default()
        if profile == "simple":
            return generic
        if profile == "calibration":
            return calibrate(generic, self.centres)
        missing = [name for name in self.centres if name not in self.parents]
        if missing or not self.centres:
            raise ModelError(
                "BodyDefinition: a predictable body needs the parents of all joints; "
                f"missing: {', '.join(missing[:5]) or 'all'} (profile 'calibration' needs centres only)"
            )
        lacking = [name for name in self.parents if name not in self.centres]
        if lacking:
            raise ModelError(f"BodyDefinition: joint {lacking[0]!r} has a parent, but no centre")
        return Skeleton.from_parents(self.parents, self.centres)


def calibrate(generic: Skeleton, centres: Mapping[str, Sequence[float]]) -> Skeleton:
    """Return the skeleton with its segments scaled so that joints are at the given centres (metres).

    A joint between two given joints keeps its relative position along the line between them; a joint beyond
    the last given joint keeps its direction from it, at that joint's scale. Unknown joints are ignored.
    """
    given = {generic.number(name): np.array(place, dtype=np.float64) for name, place in centres.items()
             if name in generic}  # fmt: skip
    if not given:
        return generic
    old, parents = generic.centres, generic.parents
    first_below = _first_given_below(parents, given)
    scale_of_body = (
        _extent(np.array([given[n] for n in given])) / max(_extent(old[list(given)]), 1e-12) or 1.0
    )
    positions = np.zeros_like(old)
    scales = np.full(len(generic), scale_of_body)
    for number in range(len(generic)):
        parent, below = int(parents[number]), first_below[number]
        if parent < 0:
            rooted = number in given
            positions[number] = (
                given[number] if rooted else given[below] + scale_of_body * (old[number] - old[below])
            )
            continue
        if number in given:
            positions[number] = given[number]
        elif below < 0:
            positions[number] = positions[parent] + scales[parent] * (old[number] - old[parent])
        else:
            share = _share_along(old, parent, number, below)
            line = given[below] - positions[parent]
            turned = _component_across(old[number] - old[parent], old[below] - old[parent], line)
            positions[number] = positions[parent] + share * line + turned
        before = float(np.linalg.norm(old[number] - old[parent]))
        after = float(np.linalg.norm(positions[number] - positions[parent]))
        scales[number] = after / before if before > 1e-6 else scales[parent]
    return Skeleton(generic.names, parents, positions)


def _first_given_below(parents: Int64, given: Mapping[int, Float64]) -> list[int]:
    """Return, for each joint, the closest given joint among itself and its descendants, -1 for none."""
    result = [-1] * len(parents)
    depth = [0] * len(parents)
    for number in range(len(parents) - 1, -1, -1):
        if number in given:
            result[number], depth[number] = number, 0
        parent = int(parents[number])
        closer = result[parent] < 0 or depth[number] + 1 <= depth[parent]
        if parent >= 0 and parent not in given and result[number] >= 0 and closer:
            result[parent], depth[parent] = result[number], depth[number] + 1
    return result


def _share_along(old: Float64, parent: int, number: int, below: int) -> float:
    """Return a joint's position, 0 to 1, from its parent to a given joint below, in the generic body."""
    line = old[below] - old[parent]
    length = float(line @ line)
    return float((old[number] - old[parent]) @ line) / length if length > 1e-12 else 1.0


def _component_across(offset: Float64, line: Float64, new_line: Float64) -> Float64:
    """Return the component of an offset across the line, at the scale of the new line."""
    length = float(line @ line)
    if length <= 1e-12:
        return np.zeros(3)
    return (offset - line * (offset @ line) / length) * math.sqrt(float(new_line @ new_line) / length)


def _extent(positions: Float64) -> float:
    """Return the extent of joints: the diagonal of their box, or the height of a single one."""
    if len(positions) == 1:
        return abs(float(positions[0, 1]))
    return float(np.linalg.norm(np.ptp(positions, axis=0)))


def _finite(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number beyond all floats
        return False


def _short(value: object) -> str:
    """Return a value as the text of an error shows it."""
    try:
        text = repr(value)
    except ValueError:  # Python writes no number of more than 4300 digits
        text = "a huge number"
    return text if len(text) <= 60 else text[:57] + "..."
