"""Moves the vertices of a face model by FAPs, through its FaceDefTables.

ISO/IEC 14496-1, nodes FaceDefTables, FaceDefMesh and FaceDefTransform.
"""

from __future__ import annotations

import threading
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Int64, UInt32
from fba.errors import RangeError
from fba.face.deform._normals import build_surface, restrict_surface
from fba.face.deform.flat_tables import (
    VALUE_MAX,
    FlatModel,
    MovingMesh,
    all_vertices,
    bound_points,
    flatten_shifts,
    flatten_transforms,
)
from fba.face.feature_points import names
from fba.face.model import FaceModel
from fba.mesh import result_array
from fba.parameters import FAP_COUNT, faps

FRAMES_PER_CALL = 64
"""Frames per call of the compiled loop: Ctrl-C takes effect between calls only."""


_flat_models: WeakKeyDictionary[FaceModel, FlatModel] = WeakKeyDictionary()
"""Cache of flat tables, as long as their models live: models do not change."""


def _flat_model(model: FaceModel) -> FlatModel:
    """Return the flat tables of a model, with scratch arrays of their own, for several threads."""
    tables = _flat_models.get(model)
    if tables is None:
        tables = _flat_models[model] = _flatten(model)
    mesh, points = tables.mesh, tables.point_shifts
    shifts, surface = mesh.shifts, mesh.surface
    return tables._replace(
        mesh=mesh._replace(
            shifts=shifts._replace(amount=np.zeros_like(shifts.amount)),
            surface=surface._replace(sums=np.zeros_like(surface.sums), units=np.zeros_like(surface.units)),
        ),
        point_shifts=points._replace(amount=np.zeros_like(points.amount)),
    )


def _flatten(model: FaceModel) -> FlatModel:
    shifts = flatten_shifts(model, all_vertices(model), np.float32)
    starts = np.cumsum([0, *(len(part.vertices) for part in model.parts)], dtype=np.int64)
    rows = np.arange(len(model.vertices), dtype=np.uint32)
    return FlatModel(
        mesh=MovingMesh(model.vertices, starts, rows, starts, shifts, build_surface(model, shifts.rows)),
        transforms=flatten_transforms(model),
        point_shifts=flatten_shifts(model, bound_points(model), np.float64),
        owner=_find_owners(model),
    )


class Deformer:
    """Moves a face: `Deformer(model)(faps)` gives its vertices.

    1. Every FAP that is not 0 moves the vertices of its FaceDefMesh along their piecewise linear paths,
       by value x FAPU; the shifts of several FAPs add up.
    2. Then each part's own transforms are applied, about their fixed centres:
       translations . rotations . scales, the outermost first, as in a Transform node. Of several
       rotations (or scales) that of the lower FAP is further out, so an eye's yaw (23, 24) is outside
       its pitch (25, 26); only the head's pitch is innermost, so that the head turns by
       yaw . roll . pitch (49 . 50 . 48). Of several of one FAP, the one listed first is further out.
    3. Then the transforms of `HEAD` are applied to all parts, nested in the same way.

    A rotation turns by value x FAPU x amount (radians about each axis), a translation shifts by that
    vector, a scale multiplies each axis by 1 + value x FAPU x amount.

    The first one of a model copies its tables into flat arrays, which the next ones share; calls allocate
    nothing but their result.
    Threads that share a Deformer wait for each other; for speed, give each its own.
    Raises ModelError for displacements too large for 32-bit floats.
    """

    def __init__(self, model: FaceModel) -> None:
        from fba.face.deform import _loops as loops  # imports numba: not before a face is to move

        self.model = model
        self._loops = loops
        self._tables = _flat_model(model)
        self._scratch = loops.allocate_scratch(len(model.vertices), len(model.parts), FRAMES_PER_CALL)
        self._lock = threading.Lock()

    @property
    def normal_groups(self) -> UInt32:
        """uint32 (V,): equal for vertices that share a normal, as those along the seam of a texture do."""
        return self._tables.mesh.surface.sum_of

    def restrict(self, rows: npt.ArrayLike) -> Deformer:
        """Return a deformer that moves only these vertices (N,): other rows of its results have no meaning.
        IndexError for vertices that do not exist."""
        wanted = np.zeros(len(self.model.vertices), dtype=bool)
        wanted[np.asarray(rows)] = True
        some, mesh = np.flatnonzero(wanted).astype(np.uint32), self._tables.mesh
        before = np.concatenate([[0], np.cumsum(wanted)])
        mesh = mesh._replace(
            rows=some,
            rows_start=before[mesh.part_start],
            shifts=mesh.shifts._replace(amount=np.zeros_like(mesh.shifts.amount)),
            surface=restrict_surface(mesh.surface, some),
        )
        fewer = Deformer(self.model)
        fewer._tables = fewer._tables._replace(mesh=mesh)
        return fewer

    def __call__(
        self, faps: npt.ArrayLike, out: Float32 | None = None, normals: Float32 | None = None
    ) -> Float32:
        """Return the vertices of all parts in order, the head turned: float32 (V, 3), metres, for FAPs (68,),
        or (T, V, 3) for (T, 68).

        faps: numbers of any type, as `resolve` gives them, in the units of the standard; columns 0 and 1
        (viseme, expression) are ignored. out: written to and returned. normals: filled with unit normals,
        computed from the triangles that the FAPs move, smooth across the seams of a part. Both float32,
        C-contiguous, of the result's shape.

        Raises ValueError for another shape or type, RangeError for FAPs that are not finite or do not
        fit 32 bits.
        """
        return self._run(faps, out, normals, with_head=True)

    def local(
        self, faps: npt.ArrayLike, out: Float32 | None = None, normals: Float32 | None = None
    ) -> Float32:
        """Return what calling gives, but in the frame of the head: without the transforms of `HEAD`."""
        return self._run(faps, out, normals, with_head=False)

    def head_matrices(self, faps: npt.ArrayLike) -> Float64:
        """Return the transforms of the head: float64 (4, 4) for FAPs (68,), (T, 4, 4) for (T, 68).

        For column vectors: `calling = matrix . local`. Errors as when called.
        """
        values, single = frame_values(faps)
        matrices = self._matrices(values)[:, -1]
        return matrices[0] if single else matrices

    def part_matrices(self, faps: npt.ArrayLike) -> Float64:
        """Return the transforms of each part within the head: float64 (P, 4, 4) for FAPs (68,), (T, P, 4, 4)
        for (T, 68), in the order of `model.parts`.

        The matrix of an eyeball rotates it from looking straight ahead to its current gaze, in the frame of
        the head; `head_matrices . part_matrices` is that in the world. The identity for parts without
        transforms; FaceDefMesh is not included. Errors as when called.
        """
        values, single = frame_values(faps)
        matrices = self._matrices(values)[:, :-1]
        return matrices[0] if single else matrices

    def feature_points(self, faps: npt.ArrayLike, *, local: bool = False) -> Float64:
        """Return the moved feature points: float64 (84, 3) for FAPs (68,), (T, 84, 3) for (T, 68), metres.

        A point bound to a vertex moves with it. Others move with the transforms of the part that they
        belong to: a pupil with the nearest eye, points of tongue and teeth with the nearest part of
        that kind, the rest with the head alone. Points that the face lacks stay NaN. local: without the
        head's transforms. Errors as when called.
        """
        values, single = frame_values(faps)
        points: Float64 = np.empty((len(values), len(names()), 3))
        owner = self._tables.owner
        if not local:
            owner = np.where(owner < 0, len(self.model.parts), owner)  # the head's is the last pose
        with np.errstate(all="ignore"):
            self._loops.points_of_frames(
                values,
                self._poses(values, with_head=not local),
                self.model.points,
                owner,
                self._tables.point_shifts,
                points,
            )
        return points[0] if single else points

    def _poses(self, values: Float64, *, with_head: bool = False) -> Float64:
        """Return (T, P + 1, 3, 4): what `poses_of_frames` writes for FAPs (T, 68)."""
        poses = np.empty((len(values), len(self.model.parts) + 1, 3, 4))
        self._loops.poses_of_frames(values, self._tables.transforms, with_head, poses)
        return poses

    def _matrices(self, values: Float64) -> Float64:
        matrices = np.zeros((len(values), len(self.model.parts) + 1, 4, 4))
        matrices[..., :3, :], matrices[..., 3, 3] = self._poses(values), 1
        return matrices

    def _run(
        self, faps: npt.ArrayLike, out: Float32 | None, normals: Float32 | None, *, with_head: bool
    ) -> Float32:
        values, single = frame_values(faps)
        count = len(self.model.vertices)
        shape = (count, 3) if single else (len(values), count, 3)
        out = result_array(shape, out, normals)
        out_frames = out[None] if single else out
        normal_frames = out_frames[:0] if normals is None else normals[None] if single else normals
        with self._lock, np.errstate(all="ignore"):
            for start in range(0, len(values), FRAMES_PER_CALL):
                part, scratch = slice(start, start + FRAMES_PER_CALL), self._scratch
                frames = values[part]
                self._loops.poses_of_frames(frames, self._tables.transforms, with_head, scratch.poses)
                self._loops.deform_frames(
                    frames, self._tables.mesh, scratch, out_frames[part], normal_frames[part]
                )
        return out


def frame_values(values: npt.ArrayLike) -> tuple[Float64, bool]:
    """Return the FAPs as float64 (T, 68), and whether they were one frame (68,)."""
    array = np.asarray(values)
    if array.ndim not in {1, 2} or array.shape[-1] != FAP_COUNT:
        raise ValueError(f"FAPs must have shape ({FAP_COUNT},) or (T, {FAP_COUNT}), not {array.shape}")
    if array.dtype.kind not in "iufb":
        raise ValueError(f"FAPs must be real numbers, not {array.dtype}")
    frames = np.ascontiguousarray(array, dtype=np.float64).reshape(-1, FAP_COUNT)
    if frames.size and not (frames.min() >= -VALUE_MAX - 1 and frames.max() <= VALUE_MAX):
        good = (frames >= -VALUE_MAX - 1) & (frames <= VALUE_MAX)
        frame, column = (int(index) for index in np.argwhere(~good)[0])
        value = frames[frame, column]
        raise RangeError(
            f"{value:g} cannot be shown; FAPs are finite and fit 32 bits",
            parameter=f"FAP {column + 1} {faps()[column].name}",
            value=int(value) if np.isfinite(value) else None,
            limits=(-VALUE_MAX - 1, VALUE_MAX),
            frame=frame if array.ndim == 2 else None,
        )
    return frames, array.ndim == 1


POINT_KINDS = {"3.5": "eye", "3.6": "eye", "6": "tongue", "9.8": "teeth", "9.9": "teeth", "9.10": "teeth",
               "9.11": "teeth"}  # fmt: skip
"""Kinds of parts to which feature points, or groups of them, belong if they are bound to no vertex."""


def _find_owners(model: FaceModel) -> Int64:
    """Return (84,) the part whose transforms move each feature point, -1 for the head alone."""
    owner = np.full(len(names()), -1, dtype=np.int64)
    ends = np.cumsum([len(part.vertices) for part in model.parts])
    for row, name in enumerate(names()):
        if model.bound[row] >= 0:
            owner[row] = np.searchsorted(ends, model.bound[row], side="right")
            continue
        kind = POINT_KINDS.get(name) or POINT_KINDS.get(name.split(".")[0])
        away = {
            number: float(np.linalg.norm(part.vertices - model.points[row], axis=1).min())
            for number, part in enumerate(model.parts)
            if part.kind == kind and len(part.vertices)
        }
        if away and not np.isnan(model.points[row]).any():
            owner[row] = min(away, key=lambda number: away[number])
    return owner
