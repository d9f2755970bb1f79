"""Places feature points on photographs by hand: the points, the current one, undoing, saving."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from fba.face.fitting import FRONT_POINTS, SIDE_POINTS, Photograph, write_photo_points
from fba_player.scene._hand_editing import HandEditing

VIEWS = ("front", "side")
SHOWN = {"front": FRONT_POINTS, "side": SIDE_POINTS}
"""The points that are asked for in each photograph."""

Spot = tuple[float, float]
"""A position in a photograph: pixels to the right and down from its top left corner."""


class PhotoEditing(HandEditing[dict[str, Spot]]):
    """The feature points on a frontal photograph and a profile while they are placed by hand.

    photographs: the frontal one, and the profile if there is one. The items are named "front 3.5".
    """

    item, subject = "point", "the points"
    path: Path

    def __init__(
        self, photographs: Sequence[Photograph], places: Mapping[str, Mapping[str, Spot]], path: Path
    ) -> None:
        self.photographs = tuple(photographs)
        views = VIEWS[: len(photographs)]
        spots = {f"{view} {name}": spot for view in views for name, spot in places.get(view, {}).items()}
        asked = [f"{view} {name}" for view in views for name in SHOWN[view]]
        self._names = (*asked, *(name for name in spots if name not in asked))
        super().__init__(spots, self._names[0], path)

    @property
    def names(self) -> tuple[str, ...]:
        """The points of the frontal photograph, then those of the profile."""
        return self._names

    @property
    def placed(self) -> Collection[str]:
        return self.state

    def move(self, spot: Spot, gesture: str = "") -> None:
        """Put the current point on a position in its photograph. gesture: as for `HandEditing._change`."""
        self._change({**self.state, self.current: spot}, gesture)

    def end_gesture(self) -> None:
        """Let the next change be a step of its own to undo, as when a point is dropped."""
        self._last_gesture = None

    def remove(self) -> None:
        self._change({name: spot for name, spot in self.state.items() if name != self.current})

    def by_view(self) -> dict[str, dict[str, Spot]]:
        """Return the points by view and name."""
        result: dict[str, dict[str, Spot]] = {view: {} for view in VIEWS[: len(self.photographs)]}
        for item, spot in self.state.items():
            view, name = item.split()
            result[view][name] = spot
        return result

    def _write(self, path: Path) -> None:
        pictures = dict(zip(VIEWS, (one.name for one in self.photographs), strict=False))
        write_photo_points(path, self.by_view(), pictures)
