"""`MarkerMapping`: which vertex of a head each marker moves, how far around, and how vertices are shared."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, get_args

import numpy as np

from fba.arrays import Float64
from fba.capture.virtual_markers._heads import MarkedHead
from fba.capture.virtual_markers.influence import Influence, give_to_nearest
from fba.capture.virtual_markers.lids import find_rows
from fba.choices import Assignment, Gaze, Overlap
from fba.errors import ModelError, OptionError, warn
from fba.name_maps import list_names

ASSIGNMENTS: tuple[Assignment, ...] = get_args(Assignment)
OVERLAPS: tuple[Overlap, ...] = get_args(Overlap)
GAZES: tuple[Gaze, ...] = get_args(Gaze)
MAX_SHARE = 10.0
"""Largest share by which a marker follows another."""
MAX_SIZE = 1e9
"""Largest radius or depth, in the unit of the head."""


@dataclass(frozen=True)
class VirtualMarker:
    """A virtual marker: the part of a head that a captured marker moves.

    vertex: its centre, a vertex of the head; None for a fixed marker beside the face, as on a cap. radius: of
    the cylinder around the centre, in x and y. depth: half the cylinder's length, along z. Both are in the
    unit of the head. fixed: the face does not move the marker, which shows how the head moves. follows: the
    captured marker that moves it, "" for that of the same name: so a marker on the outer lip also moves the
    inner lip, where nothing can be glued. share: of the displacement of that marker, above 0. lid: the vertex
    is on the margin of a lid; instead of a cylinder, rows along the lid move, up to the radius above the
    margin, see `lids.find_rows`.
    """

    vertex: int | None
    radius: float = 0.0
    depth: float = 0.0
    fixed: bool = False
    follows: str = ""
    share: float = 1.0
    lid: bool = False

    def __post_init__(self) -> None:
        moves = not self.fixed and self.vertex is not None
        if self.follows and not moves:
            raise OptionError(f"what follows {self.follows!r} needs a vertex, and cannot be fixed")
        if self.share != 1.0 and not (self.follows and 0 < self.share <= MAX_SHARE):
            raise OptionError(
                f"a share, from above 0 to {MAX_SHARE:g}, is of what another marker does, not {self.share:g}"
            )
        if self.lid and not moves:
            raise OptionError("a lid's marker needs a vertex, and cannot be fixed")
        if self.vertex is None:
            if not self.fixed:
                raise OptionError(
                    "a virtual marker without a vertex must be fixed: it tells the head's motion"
                )
            return
        if self.vertex < 0:
            raise OptionError(f"vertices are counted from 0, and there is no vertex {self.vertex}")
        for what, size in (("radius", self.radius), ("depth", self.depth)):
            if not (math.isfinite(size) and 0 < size <= MAX_SIZE):
                raise OptionError(f"the {what} must be a positive number, not {size:g}")


@dataclass(frozen=True)
class MadeFor:
    """The mesh of a mapping: its name, counts of vertices and triangles, and digests, see `MarkedHead`."""

    name: str
    vertices: int
    triangles: int
    connectivity: str
    shape: str


@dataclass(frozen=True)
class MarkerMapping:
    """The virtual markers of a head.

    markers: by the name of the captured marker, or any other name if they follow another marker. assignment:
    "shared", a vertex belongs to all virtual markers that reach it, or "exclusive", to the nearest alone.
    overlap: how displacements of shared vertices are combined. "match": each centre moves exactly as its
    marker. "add": they are added, as in the source of this method, and centres of close markers move too far.
    scale: two fixed markers; the ratio of the distances of their vertices and of the captured markers is the
    scale of all displacements; () for the farthest apart. gaze: "none", eyes do not turn in the head, or
    "camera", they turn against the head and keep looking at the camera. squint: 0 to 1, the share by which
    eyes are narrowed, whatever the markers of lids do. made_for: the mesh, None if unknown.

    Raises OptionError for parts that contradict each other.
    """

    markers: Mapping[str, VirtualMarker] = field(default_factory=dict)
    assignment: Assignment = "shared"
    overlap: Overlap = "match"
    scale: tuple[str, ...] = ()
    gaze: Gaze = "none"
    squint: float = 0.0
    made_for: MadeFor | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "markers", dict(self.markers))
        for what, value, known in (
            ("assignment", self.assignment, ASSIGNMENTS),
            ("overlap", self.overlap, OVERLAPS),
            ("gaze", self.gaze, GAZES),
        ):
            if value not in known:
                raise OptionError(f"{what} must be one of {', '.join(known)}, not {value!r}")
        if not 0 <= self.squint <= 1:
            raise OptionError(f"squint must be from 0 to 1, not {self.squint:g}")
        taken: dict[int, str] = {}
        for name, marker in self.markers.items():
            if marker.vertex is not None and marker.vertex in taken:
                raise OptionError(f"{taken[marker.vertex]!r} and {name!r} are both at vertex {marker.vertex}")
            if marker.vertex is not None:
                taken[marker.vertex] = name
        if len(self.scale) not in (0, 2):
            raise OptionError(f"scale needs two markers, not {len(self.scale)}")
        for name in self.scale:
            marker_of = self.markers.get(name)
            if marker_of is None or not marker_of.fixed or marker_of.vertex is None:
                raise OptionError(f"scale: {name!r} is no fixed marker with a vertex")
        if len(set(self.scale)) == 1:
            raise OptionError(f"scale needs two different markers, not {self.scale[0]!r} twice")

    @property
    def centres(self) -> dict[str, VirtualMarker]:
        """Virtual markers with a vertex."""
        return {name: marker for name, marker in self.markers.items() if marker.vertex is not None}

    @property
    def captured(self) -> tuple[str, ...]:
        """Names of the needed captured markers."""
        return tuple(dict.fromkeys(marker.follows or name for name, marker in self.markers.items()))

    @property
    def fixed(self) -> tuple[str, ...]:
        """Names of the fixed markers."""
        return tuple(name for name, marker in self.markers.items() if marker.fixed)

    def changed(self, name: str, marker: VirtualMarker | None) -> MarkerMapping:
        """Return the mapping with another virtual marker for a captured marker; None removes it.

        A marker at the same vertex is removed, and so is a pair of the scale that became invalid.
        """
        vertex = None if marker is None else marker.vertex
        kept = {
            other: each
            for other, each in self.markers.items()
            if other == name or each.vertex is None or each.vertex != vertex
        }
        if marker is None:
            kept.pop(name, None)
        else:
            kept[name] = marker
        still = all(end in kept and kept[end].fixed and kept[end].vertex is not None for end in self.scale)
        return replace(self, markers=kept, scale=self.scale if still else ())

    def for_head(self, head: MarkedHead) -> MarkerMapping:
        """Return the mapping with this head in `made_for`."""
        made_for = MadeFor(head.name, len(head.vertices), len(head.triangles), head.connectivity, head.shape)
        return replace(self, made_for=made_for)

    def check(self, head: MarkedHead) -> None:
        """Raise ModelError if the mapping was made for another mesh, or a vertex is not on the head's skin.

        Warns (FbaWarning) if the mesh has the same triangles, but its vertices were moved.
        """

        made_for = self.made_for
        if made_for is not None:
            there = (made_for.vertices, made_for.triangles)
            here = (len(head.vertices), len(head.triangles))
            if there != here or made_for.connectivity != head.connectivity:
                counts = f"{there[0]} vertices and {there[1]} triangles there, {here[0]} and {here[1]}"
                how = "its triangles join other vertices" if there == here else f"it has {counts} here"
                raise ModelError(
                    f"the mapping was made for another mesh ({made_for.name}) than {head.name}: {how}; "
                    "vertex numbers would mean other places. Give the head that it was made for, or map "
                    "this one anew"
                )
            if made_for.shape != head.shape:
                warn(
                    f"{head.name}: vertices were moved since the mapping was made; it is used as it is, as "
                    "their numbers are the same",
                    stacklevel=3,
                )
        number = head.skin.number
        used = set(head.skin.triangles.ravel().tolist())
        for name, marker in self.centres.items():
            assert marker.vertex is not None
            if marker.vertex >= len(head.vertices):
                raise ModelError(
                    f"virtual marker {name!r} is at vertex {marker.vertex}, but {head.name} has "
                    f"{len(head.vertices)} vertices, counted from 0"
                )
            if int(number[marker.vertex]) not in used:
                raise ModelError(
                    f"virtual marker {name!r} is at vertex {marker.vertex} of {head.name}, which is not on "
                    "its skin; choose another"
                )

    def check_names(self, names: tuple[str, ...]) -> None:
        """Raise ModelError for markers that a capture with these names does not have."""
        missing = [name for name in self.captured if name not in names]
        if missing and len(missing) == len(self.captured):
            raise ModelError(
                f"the capture has none of the mapping's markers ({list_names(missing)}); it has "
                f"{list_names(names)}"
            )
        if missing:
            raise ModelError(
                f"the capture has no marker {list_names(missing)}, which the mapping names; it has "
                f"{list_names(names)}. Take them out of the mapping, or give the capture that it is for"
            )


MIN_SINGULAR_VALUE = 0.05
"""Smallest singular value of the overlap of markers, relative to the largest, that the solution of `match`
uses: smaller ones belong to markers that their overlap hardly tells apart."""


@dataclass(frozen=True, eq=False)
class MarkerWeights:
    """The weights of K virtual markers.

    names: of the markers. influences: of each, as vertices of the head's skin. shares: sparse float64 (N, K),
    of each marker's displacement in that of each vertex of the head. solve: float64 (K, K); vertices move by
    `shares @ (solve @ displacements)`.
    """

    names: tuple[str, ...]
    influences: tuple[Influence, ...]
    shares: Any
    solve: Float64

    def moved(self, displacements: Float64) -> Float64:
        """Return how far each vertex moves, float64 (N, 3), for displacements of the markers (K, 3)."""
        result: Float64 = self.shares @ (self.solve @ displacements)
        return result


def find_influences(head: MarkedHead, markers: Iterable[VirtualMarker]) -> list[Influence]:
    """Return the influence of each virtual marker with a vertex, as vertices of the head's skin.

    Errors as of `WalkedMesh.walk` and `find_rows`.
    """
    listed = list(markers)
    number = head.skin.number
    walked = head.walked.walk([(int(number[each.vertex or 0]), each.radius, each.depth) for each in listed])
    return [
        find_rows(head, each.vertex or 0, each.radius) if each.lid else influence
        for each, influence in zip(listed, walked, strict=True)
    ]


def find_weights(head: MarkedHead, mapping: MarkerMapping) -> MarkerWeights:
    """Return the weights of all virtual markers that have a vertex, in their order.

    Parts that are not skin follow it, see `find_followers`. Errors as of `find_influences`.
    """
    from scipy.sparse import csr_array

    markers = mapping.centres
    names = tuple(markers)
    number = head.skin.number
    influences = find_influences(head, markers.values())
    if mapping.assignment == "exclusive":
        influences = give_to_nearest(influences)
    rows = np.concatenate([np.zeros(0, np.intp), *(each.vertices for each in influences)])
    columns = np.repeat(np.arange(len(names)), [len(each.vertices) for each in influences])
    values = np.concatenate([np.zeros(0), *(each.shares for each in influences)])
    on_skin = csr_array((values, (rows, columns)), shape=(len(head.skin), len(names)))
    solve = np.eye(len(names))
    if mapping.overlap == "match" and names:
        overlap = on_skin[number[[each.vertex or 0 for each in markers.values()]]].toarray()
        solve = np.linalg.pinv(overlap, rcond=MIN_SINGULAR_VALUE)
    return MarkerWeights(names, tuple(influences), (head.followers @ on_skin).tocsr(), solve)
