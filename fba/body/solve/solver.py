"""Converts BAPs to joint matrices, and joint matrices to BAPs."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64, Int32, Int64
from fba.body._skeleton import Skeleton
from fba.body.solve import _pose_loops as pose_loops
from fba.body.solve import solver_loops
from fba.body.solve.conventions import NO_BAP, Convention, convention
from fba.body.solve.limits import widest_limits
from fba.choices import Axes
from fba.errors import ModelError
from fba.parameters import BAP_COUNT, BAP_STANDARD_COUNT, baps
from fba.tracks import BodyColumns, BodyTrack

VALUE_LIMIT = 2**31 - 1
SOLVED_AT_ONCE = 512
"""Frames of a track solved at once: joint matrices of a long capture would not fit into memory."""
HALF_TURN = 314159
"""pi in 1e-5 rad."""


class _Tables(NamedTuple):
    """The angles of J joints as arrays for the compiled loops; N of the 3 J angles have a BAP."""

    bap: Int64
    """(J, 3) column of the BAP of each angle, outermost first; `NO_BAP` for none."""
    axis: Int64
    """(J, 3) axis that it turns about: 0, 1, 2."""
    sign: Float64
    """(J, 3) 1 or -1."""
    counts: Int64
    """(J,) how many angles have a BAP."""
    columns: Int64
    """(N,) columns of the BAPs, joint by joint."""
    radians: Float64
    """(N,) radians of one unit of each."""
    turns: Int64
    """(J, 3) index of each angle among the N."""
    offsets: Float64
    """(J, 3) `Skeleton.offsets`."""
    metres: Float64
    """(3,) metres of one unit of the root's translation."""
    limits: Float64
    """(J, 3, 2) lowest and highest angle of a human, radians."""


def _make_tables(skeleton: Skeleton, rules: Convention) -> _Tables:
    count = len(skeleton)
    bap = np.full((count, 3), NO_BAP, dtype=np.int64)
    axis = np.tile(np.arange(3, dtype=np.int64), (count, 1))
    sign = np.ones((count, 3))
    for row, joint in enumerate(rules.joints):
        if joint in skeleton:
            number = skeleton.number(joint)
            bap[number], axis[number], sign[number] = rules.bap[row], rules.axis[row], rules.sign[row]
    used = bap != NO_BAP
    columns = bap[used]
    turns = np.zeros((count, 3), dtype=np.int64)
    turns[used] = np.arange(len(columns))
    limits = np.zeros((count, 3, 2))
    limits[used] = np.radians(widest_limits())[columns]
    return _Tables(
        bap, axis, sign,
        counts=used.sum(axis=1),
        columns=columns,
        radians=sign[used] * pose_loops.UNIT,
        turns=turns,
        offsets=skeleton.offsets,
        metres=rules.translation_sign * pose_loops.MILLIMETRE,
        limits=limits,
    )  # fmt: skip


class BapSolver:
    """Poses a skeleton by BAPs, and finds the BAPs of a pose.

    skeleton: the default body where None. axes: name of a convention (`fba.body.convention_names()`):
    axes, signs and order of rotations. Angles are 1e-5 rad, BAPs 181..183 mm. BAPs of joints that the
    skeleton lacks have no effect; `missing` lists those joints.
    """

    def __init__(self, skeleton: Skeleton | None = None, axes: Axes = "iso") -> None:
        self.skeleton = skeleton if skeleton is not None else Skeleton.default()
        self.convention: Convention = convention(axes)
        self._tables = _make_tables(self.skeleton, self.convention)

    @property
    def missing(self) -> tuple[str, ...]:
        """Joints of the standard that the skeleton lacks."""
        return tuple(joint for joint in self.convention.joints if joint not in self.skeleton)

    def pose(self, baps: npt.ArrayLike, out: Float64 | None = None) -> Float64:
        """Return joint matrices of a pose: float64 (J, 4, 4) for baps (296,), (T, J, 4, 4) for (T, 296).

        186 columns are accepted too. A matrix takes points of the default posture's frame, relative to the
        joint's centre, into the world: its translation is the joint's position, its rotation is the
        identity in the default posture. out: a C-contiguous float64 array of the result's shape to write
        into, which is then returned. ValueError on other shapes or values that are not finite.
        """
        values = np.asarray(baps)
        if values.dtype == object or not np.issubdtype(values.dtype, np.number):
            raise ValueError(f"BapSolver.pose: baps must be numbers, not {values.dtype}")
        if values.ndim not in (1, 2) or values.shape[-1] not in (BAP_STANDARD_COUNT, BAP_COUNT):
            raise ValueError(
                f"BapSolver.pose: baps must have shape ({BAP_COUNT},) or (T, {BAP_COUNT}), "
                f"or {BAP_STANDARD_COUNT} columns, not {values.shape}"
            )
        frames = values if values.ndim == 2 else values[None]
        if frames.dtype != np.int32:
            frames = np.asarray(frames, dtype=np.float64)
            if not (np.abs(frames) <= VALUE_LIMIT).all():
                raise ValueError("BapSolver.pose: baps must be finite, and fit 32 bits")
        shape = (*values.shape[:-1], len(self.skeleton), 4, 4)
        if out is None:
            out = np.empty(shape)  # the loop below writes every number
        elif not (
            isinstance(out, np.ndarray)
            and out.shape == shape
            and out.dtype == np.float64
            and out.flags.c_contiguous
            and out.flags.writeable
        ):
            raise ValueError(f"BapSolver.pose: out must be a writeable, C-contiguous float64 array {shape}")
        tables = self._tables
        pose_loops.pose(
            np.ascontiguousarray(frames), self.skeleton.parents, tables.offsets, tables.turns, tables.axis,
            tables.radians, tables.columns, tables.counts, self.convention.translation, tables.metres,
            out.reshape(-1),
        )  # fmt: skip
        return out

    def solve(
        self,
        matrices: npt.ArrayLike,
        joints: Collection[str] | None = None,
        previous: npt.ArrayLike | None = None,
    ) -> Int32:
        """Return BAPs that reach these joint matrices: int32 (296,) for (J, 4, 4), (T, 296) for (T, J, 4, 4).

        Only the rotations are used, and the root's translation. Where a joint lacks a freedom, it takes the
        closest rotation, and its children make up for the rest as far as they can. joints: the joints to
        solve, by name; others stay unturned.

        Of the angles that make a rotation, each frame takes those closest to the frame before, and the first
        frame those closest to previous, (296,): a smooth motion has smooth angles, which may leave +-pi (see
        `wrapped`). Without previous, the first frame keeps within human limits (`fba.body.JointLimits`) where
        it can, and as close to 0. At gimbal lock the outermost angle stays as it was.

        ValueError on a wrong shape or values that are not finite; ModelError where a value does not
        fit 32 bits; KeyError for an unknown joint.
        """
        array = np.asarray(matrices, dtype=np.float64)
        count = len(self.skeleton)
        if array.ndim not in (3, 4) or array.shape[-3:] != (count, 4, 4):
            raise ValueError(
                f"BapSolver.solve: matrices must have shape ({count}, 4, 4) or "
                f"(T, {count}, 4, 4), not {array.shape}"
            )
        if not np.isfinite(array).all():
            raise ValueError("BapSolver.solve: matrices must be finite")
        frames = np.ascontiguousarray(array if array.ndim == 4 else array[None])
        wanted = np.ones(count, dtype=bool)
        if joints is not None:
            wanted[:] = False
            wanted[[self.skeleton.number(name) for name in joints]] = True
        values = np.zeros((len(frames), BAP_COUNT), dtype=np.int32)
        tables = self._tables
        joints_solved = solver_loops.Joints(
            self.skeleton.parents,
            solver_loops.Freedoms(tables.counts * wanted, tables.axis, tables.sign, tables.limits),
            tables.bap,
            self.skeleton.centres[0],
            self.convention.translation,
            tables.metres,
        )
        before = self._angles(previous)
        scratch = solver_loops.allocate_scratch(count, solver_loops.BLOCK_FRAMES)
        if not solver_loops.solve(
            frames, joints_solved, before, previous is None, VALUE_LIMIT, scratch, values
        ):
            raise ModelError("BapSolver.solve: the pose does not fit BAPs of 32 bits, in mm and 1e-5 rad")
        return values if array.ndim == 4 else values[0]

    def _angles(self, baps: npt.ArrayLike | None) -> Float64:
        columns = self._tables.bap
        angles = np.zeros(columns.shape)
        if baps is not None:
            values = np.asarray(baps, dtype=np.float64)
            if values.shape != (BAP_COUNT,) or not np.isfinite(values).all():
                raise ValueError(f"BapSolver.solve: previous must be {BAP_COUNT} finite BAPs")
            used = columns >= 0
            angles[used] = values[columns[used]] * pose_loops.UNIT
        return angles


def solve_track(
    solver: BapSolver,
    joints: Collection[str],
    count: int,
    matrices: Callable[[slice], Float64],
    previous: Int32 | None = None,
) -> BodyTrack:
    """Return a track of count frames that sends the BAPs of these joints, with angles within +-pi.

    matrices: returns the joint matrices (F, J, 4, 4) of a slice of frames, as `BapSolver.solve` takes them.
    previous: BAPs (296,) of the frame before the first.
    """
    sent = np.zeros(BAP_COUNT, dtype=bool)
    sent[[bap.number - 1 for bap in baps() if bap.joint in joints]] = True
    rows = np.empty((count, int(sent.sum())), dtype=np.int32)  # every block is written below
    for begin in range(0, count, SOLVED_AT_ONCE):
        block = slice(begin, min(begin + SOLVED_AT_ONCE, count))
        values = solver.solve(matrices(block), joints, previous)
        previous = values[-1]
        rows[block] = values[:, sent]
    _wrap(rows, [place for place, bap in enumerate(np.flatnonzero(sent).tolist()) if _is_angle(bap)])
    return BodyColumns(rows, sent).track()


def wrapped(values: npt.ArrayLike, limit: int = HALF_TURN) -> Int32:
    """Return the same poses, int32 (T, 296), with every angle within +-pi, continuous where possible.

    A column of angles that leaves +-limit (1e-5 rad) is first moved as a whole by full turns; only if
    that does not bring it within, single values are moved, which makes jumps of a full turn. Other
    columns stay as they are. A full turn is rounded to 628319 units, so a pose changes by less than
    1e-5 rad. limit must be at least pi. ValueError for other shapes.
    """
    array = np.asarray(values)
    columns = [column for column in range(BAP_COUNT) if _is_angle(column)]
    if array.ndim != 2 or array.shape[1] <= max(columns):
        raise ValueError(f"wrapped: needs BAPs of shape (T, 296), not {array.shape}")
    if limit < HALF_TURN:
        raise ValueError(f"wrapped: limit must be at least {HALF_TURN} (half a turn), not {limit}")
    result = array.astype(np.int32)
    _wrap(result, columns, limit)
    return result


def _is_angle(column: int) -> bool:
    """Whether the BAP of a column is an angle."""
    return baps()[column].unit == "1e-5 rad"


def _wrap(rows: Int32, columns: list[int], limit: int = HALF_TURN) -> None:
    """Do the same as `wrapped` with these columns of rows (T, K), in place."""
    for column in columns:
        angles = rows[:, column].astype(np.int64)
        low, high = int(angles.min(initial=0)), int(angles.max(initial=0))
        if -limit <= low and high <= limit:
            continue
        low, high = int(angles.min()), int(angles.max())
        angles = angles - _full_turns((low + high) / 2)
        if int(np.abs(angles).max()) > limit:
            angles = angles - _full_turns(angles.astype(np.float64))
        rows[:, column] = angles


def _full_turns(angle: float | Float64) -> Int64:
    """Return the whole turns in angles, in 1e-5 rad."""
    full = 2e5 * np.pi
    return np.rint(np.rint(np.asarray(angle) / full) * full).astype(np.int64)
