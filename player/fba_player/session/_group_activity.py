"""Which groups of parameters move when: mouth, eyes, brows, head, arms, and so on.

Parameters of different units are compared by their `reach`: a motion that is strong and plausible.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.animation import Animation
from fba.arrays import Array, Float64, Intp, UInt8
from fba.face import FaceSettings, Resolver
from fba.parameters import BAP_STANDARD_COUNT, FIRST_LOW_LEVEL_FAP, Bap, bap_numbers, baps, faps
from fba.text_files import packaged_rows
from fba.tracks import hold

TYPICAL_ANGLE = 45.0
"""Degrees of a BAP that count as much as the typical motion of a FAP."""
TYPICAL_SHIFT = 300.0
"""Millimetres of a BAP that count as much."""
FRAMES_AT_ONCE = 1024
"""Frames processed at once."""
FULL_SPEED = 5.0
"""Strong motions in a second that are drawn in full colour."""
LEAST = 0.12
"""Share of the full colour that a group must reach once to have a row: below, it only trembles."""
FACE_GROUPS = {
    2: "mouth", 3: "eyes", 4: "brows", 5: "cheeks", 6: "tongue", 7: "head", 8: "mouth", 9: "nose", 10: "ears",
}  # fmt: skip
"""Names by the groups of FAPs."""
BODY_GROUPS = {
    1: "trunk", 2: "legs", 3: "legs", 4: "legs", 5: "legs", 6: "arms", 7: "arms", 8: "arms", 9: "arms",
    19: "root",
}  # fmt: skip
"""Names by the groups of BAPs; spine and hands follow from the joint."""
ORDER = (
    "mouth", "tongue", "cheeks", "nose", "eyes", "brows", "ears", "head", "neck", "trunk", "arms", "hands",
    "legs", "root",
)  # fmt: skip
"""Order of the rows, from above."""


@dataclass(frozen=True, eq=False)
class Activity:
    """How fast groups move. names: (G,). times: seconds (T,). amounts: uint8 (T, G), 255 is full speed.

    The speed of a group is that of its fastest parameter, in strong motions a second; amounts are
    proportional to its square root.
    """

    names: tuple[str, ...]
    times: Float64
    amounts: UInt8

    def moving(self, time: float, seconds: float) -> list[str]:
        """Return the names of groups that move visibly within a time, from `time` on."""
        first = max(int(np.searchsorted(self.times, time, side="right")) - 1, 0)
        last = max(int(np.searchsorted(self.times, time + seconds)), first + 1)
        most = self.amounts[first:last].max(axis=0, initial=0)
        return [name for name, amount in zip(self.names, most, strict=True) if amount >= 255 * LEAST]


def read_activity(animation: Animation, model: FaceSettings | None) -> Activity | None:
    """Return how fast the groups of an animation move; None if nothing does."""
    frames = len(animation)
    if not frames:
        return None
    times = animation.index / float(animation.rate)
    columns: list[str] = []
    parts: list[UInt8] = []
    face, body = animation.face, animation.body
    if face is not None:
        resolver, groups = Resolver(model), _face_groups()
        parts.append(_speeds(times, lambda part: resolver.push(face[part]), groups))
        columns += groups
    if body is not None:
        state, groups = np.zeros(body.values.shape[1], dtype=np.int32), _body_groups()

        def held(part: slice) -> Array:
            nonlocal state
            rows = hold(body.values[part], body.mask[part], state)
            state = rows[-1].copy()
            return np.asarray(rows)

        parts.append(_speeds(times, held, groups))
        columns += groups
    if not parts:
        return None
    amounts = np.concatenate(parts, axis=1)
    joined = {name: [k for k, column in enumerate(columns) if column == name] for name in ORDER}
    rows = {name: amounts[:, which].max(axis=1) for name, which in joined.items() if which}
    shown = [name for name, row in rows.items() if row.max() >= 255 * LEAST]
    if not shown:
        return None
    return Activity(tuple(shown), times, np.stack([rows[name] for name in shown], axis=1))


def activity_picture(
    activity: Activity, colour: tuple[float, ...], low: float, high: float, size: tuple[int, int]
) -> UInt8:
    """Draw a row for each group from time low to high: uint8 (H, W, 4), the opacity shows the speed.

    colour: red, green, blue, 0 to 1. size: width and height in pixels.
    """
    width, height = size
    picture = np.zeros((len(activity.names), width, 4), dtype=np.uint8)
    picture[..., :3] = np.round(np.array(colour[:3]) * 255)
    edges = np.searchsorted(activity.times, np.linspace(low, high, width + 1), side="right") - 1
    first, last = np.maximum(edges[:-1], 0), edges[1:]
    seen = last >= 0
    starts = first[seen]
    stop = min(int(last.max(initial=0)) + 1, len(activity.times))
    if not len(starts):
        return picture
    most = np.maximum.reduceat(activity.amounts[:stop], np.minimum(starts, stop - 1), axis=0)
    picture[:, seen, 3] = most.T
    return np.asarray(picture[np.arange(height) * len(picture) // height])


def _speeds(times: Float64, rows: Callable[[slice], Array], groups: dict[str, Groups]) -> UInt8:
    """Return the amounts (T, G). rows: returns the values of frames, asked for in order."""
    amounts = np.zeros((len(times), len(groups)), dtype=np.uint8)
    before: Array | None = None
    for start in range(0, len(times), FRAMES_AT_ONCE):
        part = slice(start, min(start + FRAMES_AT_ONCE, len(times)))
        values = rows(part).astype(np.float64)
        first = values[:1] if before is None else before
        seconds = np.diff(times[part], prepend=times[max(start - 1, 0)])
        changes = np.abs(np.diff(values, axis=0, prepend=first))
        speeds = changes / np.where(seconds > 0, seconds, np.inf)[:, None]
        before = values[-1:].copy()
        for column, (numbers, reaches) in enumerate(groups.values()):
            fastest = (speeds[:, numbers] / reaches).max(axis=1)
            amounts[part, column] = np.round(255 * np.sqrt(np.minimum(fastest / FULL_SPEED, 1.0)))
    return amounts


Groups = tuple[Intp, Float64]
"""Columns of parameters, and a strong motion of each."""


@cache
def _face_groups() -> dict[str, Groups]:
    return _grouped(
        [(FACE_GROUPS[fap.group], fap.number) for fap in faps()[FIRST_LOW_LEVEL_FAP - 1 :]], reach
    )


@cache
def _body_groups() -> dict[str, Groups]:
    return _grouped([(_body_group(bap), bap.number) for bap in baps()[:BAP_STANDARD_COUNT]], bap_reach)


def _grouped(rows: list[tuple[str, int]], strong: Callable[[int], float]) -> dict[str, Groups]:
    """Return the groups of rows (name, number). strong: returns the strong motion of a parameter."""
    groups: dict[str, Groups] = {}
    for name in dict.fromkeys(name for name, _ in rows):
        numbers = [number for other, number in rows if other == name]
        groups[name] = np.array(numbers) - 1, np.array([strong(number) for number in numbers])
    return groups


def _body_group(bap: Bap) -> str:
    if bap.joint == "skullbase":
        return "head"
    if bap.joint.startswith("vc"):
        return "neck"
    return BODY_GROUPS.get(bap.group, "hands" if "hand" in bap.group_name else "trunk")


@cache
def reach(number: int) -> float:
    """Return the amount of a FAP in the gallery, in its unit: a strong, plausible motion."""
    rows = packaged_rows("fba_player.export", "contact_sheet.csv")
    return next(abs(float(row["value"])) for row in rows if int(row["fap"]) == number)


def bap_reach(number: int) -> float:
    """Return the typical strong motion of a BAP, in its unit."""
    if baps()[number - 1].unit == "mm":
        return TYPICAL_SHIFT
    root = number >= bap_numbers()["HumanoidRoot_tr_vertical"]
    return float(np.radians(TYPICAL_ANGLE * (2 if root else 1)) * 1e5)
