"""Virtual markers while they are made by hand: the current one, its vertex and reach, undoing, saving.

It knows no picture and no mouse; a window shows it as a `MarkersScene`.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture import MarkerMotion
from fba.capture.virtual_markers import (
    Influence,
    MarkedHead,
    MarkerMapping,
    MarkerPerformance,
    VirtualMarker,
    write_mapping,
)
from fba.capture.virtual_markers.influence import give_to_nearest
from fba.capture.virtual_markers.lids import lid_at
from fba.capture.virtual_markers.mapping import find_influences
from fba.capture.virtual_markers.performance import Neutral, SteadyMarkers, perform_steady, steady
from fba.capture.virtual_markers.proposal import usual_radius
from fba.choices import Assignment, Overlap
from fba.errors import FbaError, FbaWarning
from fba_player.scene._hand_editing import HandEditing


class MarkerEditing(HandEditing[MarkerMapping]):
    """The virtual markers of a capture and a head while they are made.

    motion, head: what is brought together. neutral: the frames in which the face is neutral. problem: why the
    head does not move yet, "" if it does. doubts: what was odd about the capture or the mapping. beside:
    whether the cloud of markers is beside the head, not over it. shows_weights: whether the head has the
    colours of the current marker's reach.
    """

    item, subject = "marker", "the mapping"

    def __init__(
        self,
        motion: MarkerMotion,
        head: MarkedHead,
        mapping: MarkerMapping,
        path: Path | None = None,
        *,
        neutral: Neutral = "auto",
    ) -> None:
        current = next((name for name in motion.names if name not in mapping.markers), motion.names[0])
        super().__init__(mapping, current, path)
        self.motion = motion
        self.head = head
        self.neutral = neutral
        self.problem = ""
        self.doubts: tuple[str, ...] = ()
        self.beside = True
        self.shows_weights = True
        self._steady: tuple[object, SteadyMarkers] | None = None
        self._made: tuple[MarkerMapping, MarkerPerformance | None] | None = None
        self._reach: tuple[object, Influence | None] | None = None

    @property
    def mapping(self) -> MarkerMapping:
        """The mapping as it is now."""
        return self.state

    @property
    def placed(self) -> Collection[str]:
        """Names of the markers that have a virtual marker."""
        return self.mapping.markers

    @property
    def marker(self) -> VirtualMarker | None:
        """The current marker's virtual marker; None if it has none."""
        return self.mapping.markers.get(self.current)

    @property
    def performance(self) -> MarkerPerformance | None:
        """The head moved by the capture; None, and a `problem`, as long as the mapping does not suffice."""
        if self._made is None or self._made[0] != self.mapping:
            self._made = (self.mapping, self._perform())
        return self._made[1]

    @property
    def influence(self) -> Influence | None:
        """What the current marker moves, as vertices of the head's skin; None if it has no vertex."""
        key = (self.mapping, self.current)
        if self._reach is None or self._reach[0] != key:
            self._reach = (key, self._find_influence())
        return self._reach[1]

    @property
    def names(self) -> tuple[str, ...]:
        """The markers of the capture, and the virtual markers that follow some of them."""
        names = self.motion.names
        return (*names, *(name for name in self.mapping.markers if name not in names))

    @property
    def source(self) -> str:
        """The captured marker behind the current one: the same, or the one that it follows."""
        follows = "" if self.marker is None else self.marker.follows
        return follows or self.current

    def place(self, vertex: int) -> None:
        """Put the current marker's centre on a vertex of the head."""
        old = self.marker
        radius = old.radius if old is not None and old.radius > 0 else self.first_radius
        depth = old.depth if old is not None and old.depth > 0 else radius
        placed = VirtualMarker(vertex, radius, depth)
        if old is not None:
            lid = old.lid and bool(lid_at(self.head, vertex))
            placed = replace(placed, fixed=old.fixed, follows=old.follows, lid=lid)
        self._change(self.mapping.changed(self.current, placed))

    def resize(self, radius: float, depth: float) -> None:
        """Give the current marker another reach, in the head's unit. Raises OptionError for none."""
        if self.marker is not None and self.marker.vertex is not None:
            marker = replace(self.marker, radius=radius, depth=depth)
            self._change(self.mapping.changed(self.current, marker), gesture="resize")

    def fix(self, fixed: bool) -> None:
        """Make the current marker fixed, or not; one without a vertex can only be fixed, a follower not."""
        old = self.marker
        if old is not None and old.follows:
            return
        if old is None:
            marker = VirtualMarker(None, fixed=True) if fixed else None
        elif old.vertex is None and not fixed:
            marker = None
        else:
            marker = replace(old, fixed=fixed, lid=False)
        self._change(self.mapping.changed(self.current, marker))

    def assign(self, assignment: Assignment) -> None:
        """Set which markers a vertex belongs to: "shared" or "exclusive"."""
        self._change(replace(self.mapping, assignment=assignment))

    def add_up(self, overlap: Overlap) -> None:
        """Set how displacements of shared vertices combine: "match" or "add"."""
        self._change(replace(self.mapping, overlap=overlap))

    def remove(self) -> None:
        """Remove the current marker's virtual marker."""
        source = self.source
        self._change(self.mapping.changed(self.current, None))
        self.current = source  # a follower is gone

    @cached_property
    def seen(self) -> Bool:
        """bool (T, M): whether each marker was seen in each frame."""
        return self.motion.seen

    @cached_property
    def laid_out(self) -> Float64:
        """float64 (T, M, 3): the capture upright and as large as the head, in its unit, around its middle.

        Shown while the mapping does not suffice.
        """
        positions = self.motion.positions
        if self.motion.up[1:] == "z":
            positions = positions[..., [0, 2, 1]] * (1.0, 1.0, -1.0)
        flat = positions.reshape(-1, 3)
        low, high = np.nanmin(flat, axis=0), np.nanmax(flat, axis=0)
        used = self.head.vertices[self.head.face]
        size = float(np.ptp(used[:, 1])) / max(float(high[1] - low[1]), 1e-12)
        result: Float64 = (positions - (low + high) / 2) * size + (used.min(axis=0) + used.max(axis=0)) / 2
        return result

    @property
    def first_radius(self) -> float:
        """The radius of a new virtual marker, in the head's unit: the median of all."""
        return usual_radius(self.mapping, self.head)

    def _write(self, path: Path) -> None:
        """Write the mapping, marked as made for this head."""
        write_mapping(path, self.mapping.for_head(self.head))

    def _perform(self) -> MarkerPerformance | None:
        doubts: list[str] = []
        try:
            with warnings.catch_warnings(record=True, action="always", category=FbaWarning) as caught:
                self.mapping.check(self.head)
                markers = self._steady_markers()
                made = perform_steady(self.motion, self.head, self.mapping, markers)
            doubts = [str(each.message) for each in caught if issubclass(each.category, FbaWarning)]
            self.problem = ""
        except FbaError as error:
            made, self.problem = None, str(error)
        self.doubts = tuple(doubts)
        return made

    def _steady_markers(self) -> SteadyMarkers:
        """Return the markers without the head's motion, which depends only on what is mapped and fixed."""
        key = (tuple(self.mapping.markers), self.mapping.fixed)
        if self._steady is None or self._steady[0] != key:
            self._steady = (key, steady(self.motion, self.mapping, self.neutral))
        return self._steady[1]

    def _find_influence(self) -> Influence | None:
        centres = self.mapping.centres
        if self.current not in centres:
            return None
        chosen = centres if self.mapping.assignment == "exclusive" else {self.current: centres[self.current]}
        influences = find_influences(self.head, chosen.values())
        if self.mapping.assignment == "exclusive":
            influences = give_to_nearest(influences)
        return influences[list(chosen).index(self.current)]
