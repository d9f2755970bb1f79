"""The skeleton that body animation parameters move: joints, parents, centres.

Frame: origin on the ground between the feet, +x the subject's left, +y up, +z forward; metres. The
default posture stands with the feet forward, arms at the sides, palms towards the thighs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from fba.arrays import Float64, Int64
from fba.errors import ModelError
from fba.parameters import joints

MAX_JOINTS = 10_000
ROOT = "HumanoidRoot"
SIDES = ("l", "r")
"""How names of joints of the left and of the right begin."""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Joints of a body in the default posture.

    names: J joint names, unique, parents before children; BAPs move those that are named as in the
        standard. parents: int64 (J,), -1 for the one root, which comes first. centres: float64 (J, 3),
        metres.

    Raises ModelError where the parts contradict each other: no joints, several roots, cycles, a parent
    after its child, a centre that is not finite.
    """

    names: tuple[str, ...]
    parents: Int64
    centres: Float64
    _numbers: dict[str, int] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        names = tuple(self.names)
        parents = np.array(self.parents, dtype=np.int64)
        centres = np.array(self.centres, dtype=np.float64)
        count = len(names)
        if not 1 <= count <= MAX_JOINTS:
            raise ModelError(f"Skeleton: needs 1 to {MAX_JOINTS} joints, found {count}")
        if parents.shape != (count,) or centres.shape != (count, 3):
            raise ModelError(
                f"Skeleton: {count} names need parents of shape ({count},) and centres of shape "
                f"({count}, 3), found {parents.shape} and {centres.shape}"
            )
        numbers = {name: number for number, name in enumerate(names)}
        if len(numbers) != count:
            twice = next(name for name in names if names.count(name) > 1)
            raise ModelError(f"Skeleton: two joints are called {twice!r}; names must be unique")
        if parents[0] != -1:
            raise ModelError(
                f"Skeleton: the first joint, {names[0]!r}, must be the root (parent -1), "
                f"not a child of {parents[0]}"
            )
        for number in range(1, count):
            if not 0 <= parents[number] < number:
                raise ModelError(
                    f"Skeleton: joint {names[number]!r} (number {number}) has parent {parents[number]}; "
                    "there is one root, and every other joint comes after its parent"
                )
        if not np.isfinite(centres).all():
            bad = int(np.argmin(np.isfinite(centres).all(axis=1)))
            raise ModelError(f"Skeleton: the centre of {names[bad]!r} is not finite: {centres[bad].tolist()}")
        parents.flags.writeable = False
        centres.flags.writeable = False
        for name, value in (
            ("names", names),
            ("parents", parents),
            ("centres", centres),
            ("_numbers", numbers),
        ):
            object.__setattr__(self, name, value)

    @staticmethod
    def default() -> Skeleton:
        """Return the default body: 87 joints of H-Anim, 1.64 m at the skull base. One shared instance."""
        return _default()

    @classmethod
    def from_parents(
        cls, parents: Mapping[str, str | None], centres: Mapping[str, Sequence[float]]
    ) -> Skeleton:
        """Return a skeleton from each joint's parent and centre, by name, in any order.

        parents: None for the root. centres: metres. Raises ModelError for an unknown parent or a cycle of
        joints.
        """
        order: list[str] = []
        children: dict[str | None, list[str]] = {}
        for name, parent in parents.items():
            if parent is not None and parent not in parents:
                raise ModelError(f"Skeleton: joint {name!r} has the parent {parent!r}, which does not exist")
            children.setdefault(parent, []).append(name)
        waiting = list(reversed(children.get(None, [])))
        while waiting:
            name = waiting.pop()
            order.append(name)
            waiting.extend(reversed(children.get(name, [])))
        if len(order) != len(parents):
            loose = next(name for name in parents if name not in set(order))
            raise ModelError(f"Skeleton: joint {loose!r} is part of a cycle and not connected to the root")
        numbers = {name: number for number, name in enumerate(order)}
        return cls(
            tuple(order),
            np.array([-1 if (p := parents[n]) is None else numbers[p] for n in order], dtype=np.int64),
            np.array([centres[n] for n in order], dtype=np.float64).reshape(len(order), 3),
        )

    def __len__(self) -> int:
        return len(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self._numbers

    def number(self, name: str) -> int:
        """Return the number of a joint; KeyError for an unknown name."""
        return self._numbers[name]

    def bone(self, start: str, end: str) -> Float64:
        """Return the vector (3,) from a joint to another in the default posture, metres."""
        vector: Float64 = self.centres[self._numbers[end]] - self.centres[self._numbers[start]]
        return vector

    def descendants(self, joint: int) -> list[int]:
        """Return the numbers of a joint and all joints below it, parents first."""
        below = [joint]
        for number, parent in enumerate(self.parents.tolist()):
            if parent in below:
                below.append(number)
        return below

    @property
    def offsets(self) -> Float64:
        """float64 (J, 3), metres: vector from the parent's centre to the joint's; for the root its centre."""
        result = self.centres.copy()
        result[1:] -= self.centres[self.parents[1:]]
        return result


@cache
def _default() -> Skeleton:
    table = joints()
    return Skeleton.from_parents({j.name: j.parent for j in table}, {j.name: j.centre for j in table})
