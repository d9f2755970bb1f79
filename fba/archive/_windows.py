"""`Windows`: parts of equal length of the performances of an archive, as arrays, in any order."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal, get_args

import numpy as np

from fba.animation import Animation
from fba.archive._performance import Performance
from fba.archive._shards import Archive, Place
from fba.arrays import Float32, Int32, Int64
from fba.capture import to_blendshapes
from fba.errors import FormatError, OptionError, did_you_mean
from fba.face import Deformer, FaceModel, arkit_names, feature_point_names, resolve, shown_faps
from fba.parameters import BAP_COUNT, bap_numbers, fap_numbers
from fba.tracks import hold

Kind = Literal["faps", "arkit", "points", "baps", "joints"]
KINDS: tuple[Kind, ...] = get_args(Kind)
_FACE: tuple[Kind, ...] = ("faps", "arkit", "points")


class Windows(Sequence[Float32]):
    """Windows of the performances of an archive: a sequence of float32 arrays, each of `frames` frames.

    folder: of an archive, or its address, as of `Archive`. frames: of a window. stride: frames from the
    beginning of a window to that of the next in the same performance; default: `frames`, so that windows do
    not overlap; 1 for all there are. Frames that do not fill a window at the end of a performance, and
    performances without the part or with fewer frames, are left out.

    as_: what a window is.
        "faps": (frames, 68), the FAPs that a face shows, in FAPU as the standard has them
            (`fba.face.resolve`); the first two are 0.
        "arkit": (frames, 52), weights of ARKit's shapes, 0 to 1 (`fba.capture.to_blendshapes` of the window).
        "points": (frames, 84, 3), feature points of the built-in head in metres, turned with it; x to its
            left, y up, z ahead (`fba.face.Deformer.feature_points`). NaN for points that it lacks.
        "baps": (frames, 296), the BAPs in force, in 1e-5 rad and mm.
        "joints": (frames, joints, 3), positions of the built-in skeleton's joints in metres, in the world
            (`fba.body.BapSolver.pose`).
    parameters: names of the columns to return, in this order, or numbers of FAPs and BAPs; default: all.
        `names` lists those of the windows. rate: frames per second; performances of other rates are
        interpolated (`fba.Animation.resample`). Default: each keeps its rate. performances: names of those to
        use, for example those that a query returns; default: all.

    `windows[i]` decodes from the last I plane before the window, and returns a new array. `describe(i)` says
    whose it is. A `torch.utils.data.DataLoader` takes the object as it is; it pickles, and works in forked
    processes.

    Raises OptionError for wrong arguments, FormatError where no performance holds a window, and as `Archive`
    does; `windows[i]` raises IndexError, BitstreamError and FormatError.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        frames: int = 400,
        stride: int | None = None,
        *,
        as_: Kind = "faps",
        parameters: Sequence[str | int] | None = None,
        rate: Fraction | float | str | None = None,
        performances: Collection[str] | None = None,
    ) -> None:
        stride = frames if stride is None else stride
        for name, value in (("frames", frames), ("stride", stride)):
            if not isinstance(value, int | np.integer) or value < 1:
                raise OptionError(f"{name} must be a positive whole number, not {value!r}")
        if as_ not in KINDS:
            near = did_you_mean(str(as_), KINDS)
            raise OptionError(f"as_ must be one of {', '.join(KINDS)}, not {as_!r}{near}")
        self.frames, self.stride, self.as_ = int(frames), int(stride), as_
        self.rate = None if rate is None else Fraction(rate)
        if self.rate is not None and self.rate <= 0:
            raise OptionError(f"the rate must be positive, not {rate}")
        self.archive = Archive(folder)
        self._converter = _Converter(as_, parameters)
        self._places, counts = self._find(None if performances is None else set(performances))
        self._ends: Int64 = np.cumsum(counts, dtype=np.int64)
        if not len(self._ends):
            part = "face" if as_ in _FACE else "body"
            raise FormatError(
                f"no performance has a {part} and {self.frames} frames; take shorter windows", path=folder
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns: FAPs, shapes, feature points, BAPs or joints."""
        return self._converter.names

    def __len__(self) -> int:
        return int(self._ends[-1])

    def __getitem__(self, position: Any) -> Any:
        """Return a window: float32 (frames, columns) or (frames, columns, 3). A slice gives a list."""
        if isinstance(position, slice):
            return [self[one] for one in range(*position.indices(len(self)))]
        performance, first = self._locate(position)
        return self._converter.convert(self._decode(performance, first), performance)

    def describe(self, position: int) -> dict[str, Any]:
        """Return whose window it is: name, subject, labels, sound_name; first frame, seconds at which it
        begins, and frames per second."""
        performance, first = self._locate(position)
        rate = self.rate or performance.rate
        return {
            "name": performance.name, "subject": performance.subject, "labels": dict(performance.labels),
            "sound_name": performance.sound_name, "frame": first, "seconds": float(first / rate),
            "rate": float(rate),
        }  # fmt: skip

    def _find(self, wanted: set[str] | None) -> tuple[list[Place], list[int]]:
        """Return the places of performances with windows, and the number of windows of each."""
        part = "face" if self.as_ in _FACE else "body"
        places, counts = [], []
        missing = set() if wanted is None else set(wanted)
        for place, cells in self.archive.cells(["name", "frames", "rate_exact", part]):
            missing.discard(cells["name"])
            if (wanted is not None and cells["name"] not in wanted) or not cells[part]:
                continue
            count = self._count(cells["frames"] or 0, cells["rate_exact"] or "0")
            if count:
                places.append(place)
                counts.append(count)
        if missing:
            raise FormatError(f"has no performance {min(missing)!r}", path=self.archive.folder)
        return places, counts

    def _count(self, frames: int, rate: str) -> int:
        """Return the number of windows of a performance with this number of frames at a rate."""
        if self.rate is not None and frames:
            try:
                frames = int((frames - 1) * self.rate / Fraction(rate)) + 1
            except (ValueError, ZeroDivisionError):
                return 1  # reading it raises the error that says what is wrong
        return (frames - self.frames) // self.stride + 1 if frames >= self.frames else 0

    def _locate(self, position: int) -> tuple[Performance, int]:
        """Return the performance of a window, and its first frame."""
        at = range(len(self))[position]  # turns negative positions, raises IndexError outside
        number = int(np.searchsorted(self._ends, at, side="right"))
        before = int(self._ends[number - 1]) if number else 0
        place = self._places[number]
        performance = self.archive.group(place.shard, place.group)[place.row]
        return performance, (at - before) * self.stride

    def _decode(self, performance: Performance, first: int) -> tuple[Animation, slice]:
        """Return frames without gaps, from an I plane on, and which of them are the window."""
        last = first + self.frames - 1
        if self.rate is None or self.rate == performance.rate:
            part = performance.decode_frames(first, last)
            if len(part) != int(part.index[-1] - part.index[0]) + 1:
                part = part.resample(part.rate)
        else:
            ratio = performance.rate / self.rate
            end = min(-(-last * ratio.numerator // ratio.denominator), performance.frames - 1)
            begin = first * ratio.numerator // ratio.denominator
            part = performance.decode_frames(begin, end).resample(self.rate)
        at = first - int(part.index[0])
        return part, slice(at, at + self.frames)


@dataclass(frozen=True)
class _Selection:
    """Columns of an array, and their names."""

    columns: Int64 | slice
    names: tuple[str, ...]


class _Converter:
    """Makes arrays of a kind of animations. names: of their columns."""

    def __init__(self, kind: Kind, parameters: Sequence[str | int] | None) -> None:
        self._kind = kind
        selection = _select(_column_names(kind), parameters, numbered=kind in ("faps", "baps"))
        self.names, self._columns = selection.names, selection.columns
        self._tool: Any = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_tool": None}

    def convert(self, decoded: tuple[Animation, slice], performance: Performance) -> Float32:
        """Return a window. decoded: frames, and which of them are the window."""
        part, window = decoded
        track = part.face if self._kind in _FACE else part.body
        if track is None or window.start < 0 or window.stop > len(part):
            raise FormatError(f"{performance.name}: the stream does not hold what its row says")
        values = np.asarray(getattr(self, f"_{self._kind}")(part, window))
        result = np.ascontiguousarray(values[:, self._columns], dtype=np.float32)
        return result if result.base is None else result.copy()

    def _faps(self, part: Animation, window: slice) -> Float32:
        assert part.face is not None
        return resolve(part.face)[window]

    def _arkit(self, part: Animation, window: slice) -> Any:
        assert part.face is not None
        shown = shown_faps(part.face)[window]  # what came before the window is in force in it
        return to_blendshapes(Animation(part.rate, part.index[window], shown)).weights

    def _points(self, part: Animation, window: slice) -> Any:
        if self._tool is None:
            self._tool = Deformer(FaceModel.default())
        return self._tool.feature_points(self._faps(part, window))

    def _baps(self, part: Animation, window: slice) -> Int32:
        assert part.body is not None
        values: Int32 = hold(part.body.values, part.body.mask, np.zeros(BAP_COUNT, dtype=np.int32))
        return values[window]

    def _joints(self, part: Animation, window: slice) -> Any:
        if self._tool is None:
            from fba.body import BapSolver, Skeleton

            self._tool = BapSolver(Skeleton.default())
        return self._tool.pose(self._baps(part, window))[:, :, :3, 3]


def _column_names(kind: Kind) -> tuple[str, ...]:
    if kind == "faps":
        return tuple(fap_numbers())
    if kind == "arkit":
        return arkit_names()
    if kind == "points":
        return tuple(feature_point_names())
    if kind == "baps":
        return tuple(bap_numbers())
    from fba.body import Skeleton

    return tuple(Skeleton.default().names)


def _select(known: tuple[str, ...], wanted: Sequence[str | int] | None, *, numbered: bool) -> _Selection:
    """Return columns by name, or by number from 1. Raises OptionError for unknown ones."""
    if wanted is None:
        return _Selection(slice(None), known)
    columns = []
    for one in wanted:
        if isinstance(one, int) and numbered and 1 <= one <= len(known):
            columns.append(one - 1)
        elif one in known:
            columns.append(known.index(str(one)))
        else:
            raise OptionError(f"there is no parameter {one!r} here{did_you_mean(str(one), known)}")
    if not columns or isinstance(wanted, str):
        raise OptionError(f"parameters must be a list of names, such as [{known[-1]!r}], not {wanted!r}")
    return _Selection(np.array(columns, dtype=np.int64), tuple(known[column] for column in columns))
