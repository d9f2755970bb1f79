"""Table of all file formats, and `read`, `write` and `probe`, which use it.

The content of a file decides its format, the suffix only where several formats fit. The modules of formats
are imported when they are used.
"""

from __future__ import annotations

import inspect
import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

from fba.animation import Animation
from fba.errors import FbaWarning, FormatError, OptionError, Remedy, UnsupportedError, did_you_mean
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BapTable
from fba.recognition import recognition_hint
from fba.source import Path, read_head

if TYPE_CHECKING:
    from fba.capture.motion import SkeletonMotion
    from fba.codec import StreamInfo
    from fba.formats.gltf.bodies import PersonInfo
    from fba.formats.gltf.clips import ClipInfo


UNKNOWN = Remedy("format", "if it is one of them, name it with {}", "'bvh'")


COMMON_SUFFIXES = (".csv", ".json", ".txt")
"""Suffixes that say nothing of the content."""


class FaceCapture(Protocol):
    """A captured face as it is in a file: blendshapes, action units, markers or points."""

    @property
    def start(self) -> float | None:
        """Time of day of its first row, in seconds; None where the file does not say."""

    @property
    def rate(self) -> Fraction:
        """Rows in a second, as the file counts them."""

    def __len__(self) -> int: ...

    def describe(self) -> dict[str, Any]:
        """Return what is in it: plain numbers, texts and lists of them; `kind` says which it is."""


class Lazy:
    """A function by name, "module:function", imported on the first call."""

    def __init__(self, place: str) -> None:
        self._place = place
        self._function: Callable[..., Any] | None = None

    def __repr__(self) -> str:
        return f"Lazy({self._place!r})"

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Call the function."""
        return self.load()(*arguments, **options)

    def load(self) -> Callable[..., Any]:
        """Return the function; import its module on the first call."""
        if self._function is None:
            module, _, name = self._place.partition(":")
            self._function = getattr(import_module(module), name)
        return self._function


@dataclass(frozen=True)
class Format:
    """A file format.

    name: as in `format=`. suffixes: lower case, with the dot; the first is the usual one. sniff: whether a
    file with this beginning (up to 64 KiB) and this lower-case suffix has this format. read, write: file to
    Animation and back; write is None if there is no writer. carries: the parts that a file can hold.
    read_motion: reads the motion of a skeleton, for formats of motion capture; `read` retargets it.
    read_face: reads a captured face as it is, markers and points among them; `read` makes FAPs of it.
    list_clips: describes the animations of a file, for formats that hold several; `read` takes one as `clip`.
    describe_person: describes the person in a file without an animation. written: description of a written
    file, if `description` says more than the writer can do.
    """

    name: str
    suffixes: tuple[str, ...]
    description: str
    sniff: Callable[[bytes, str], bool]
    read: Callable[..., Animation]
    write: Callable[..., None] | None
    carries: tuple[str, ...] = ("face", "body")
    read_motion: Callable[..., SkeletonMotion] | None = None
    read_face: Callable[..., FaceCapture] | None = None
    list_clips: Callable[..., tuple[ClipInfo, ...]] | None = None
    describe_person: Callable[..., PersonInfo | None] | None = None
    written: str = ""

    @property
    def is_capture(self) -> bool:
        """Whether files hold what was captured of somebody, of which `read` makes FAPs or BAPs."""
        return (self.read_motion, self.read_face) != (None, None)

    @property
    def has_markers(self) -> bool:
        """Whether files hold markers or points, whose places on the face a map can give."""
        return "markers" in self.read_options

    @property
    def read_options(self) -> tuple[str, ...]:
        """Names of the keyword options of `read`."""
        return _option_names(self.read)

    @property
    def face_options(self) -> tuple[str, ...]:
        """Names of the keyword options of `read_face`; empty without it."""
        return () if self.read_face is None else _option_names(self.read_face)

    @property
    def write_options(self) -> tuple[str, ...]:
        """Names of the keyword options of `write`; empty where there is no writer."""
        return () if self.write is None else _option_names(self.write)


def _lazy(module: str, name: str) -> Lazy:
    return Lazy(f"fba.formats.{module}:{name}")


_FORMATS = (
    Format(
        "fba", (".fba",), "MPEG-4 Face and Body Animation stream",
        _lazy("fba", "sniff_fba"), _lazy("fba", "read_fba"), _lazy("fba", "write_fba"),
    ),
    Format(
        "fap", (".fap",), "ASCII face animation parameters, versions 2.0 to 2.2",
        _lazy("text.fap", "sniff_fap"), _lazy("text.fap", "read_fap"), _lazy("text.fap", "write_fap"),
        ("face",),
        written="ASCII face animation parameters, version 2.2",
    ),
    Format(
        "bap", (".bap",), "ASCII body animation parameters, versions 3.1 and 3.2",
        _lazy("text.bap", "sniff_bap"), _lazy("text.bap", "read_bap"), _lazy("text.bap", "write_bap"),
        ("body",),
        written="ASCII body animation parameters, version 3.2",
    ),
    Format(
        "epf", (".epf",), "encoder parameter file: how to encode an animation; contains none itself",
        _lazy("epf.epf", "sniff_epf"), _lazy("epf.epf", "read_animation"), None, (),
    ),
    Format(
        "bvh", (".bvh",), "Biovision motion capture: a skeleton and its joint angles",
        _lazy("bvh.reader", "sniff"), _lazy("bvh.reader", "read"), _lazy("bvh.writer", "write"), ("body",),
        read_motion=_lazy("bvh.reader", "read_motion"),
    ),
    Format(
        "vrma", (".vrma",), "VRM animation: read as glTF; written, the expressions of a face",
        _lazy("gltf.vrma", "sniff"), _lazy("gltf.reader", "read"), _lazy("gltf.vrma", "write"), ("face",),
        written="VRM animation, the expressions of a face",
    ),
    Format(
        "gltf", (".glb", ".gltf", ".vrma"),
        "glTF 2.0: read, an animated skeleton; written, a skinned person",
        _lazy("gltf.reader", "sniff"), _lazy("gltf.reader", "read"), _lazy("gltf.writer", "write"),
        read_motion=_lazy("gltf.reader", "read_motion"), list_clips=_lazy("gltf.clips", "list_clips"),
        describe_person=_lazy("gltf.bodies", "describe_person"), written="glTF 2.0, a skinned person",
    ),
    Format(
        "smpl", (".npz",), "motion of SMPL, SMPL-H and SMPL-X bodies, as AMASS saves it",
        _lazy("smpl.reader", "sniff"), _lazy("smpl.reader", "read"), None,
        read_motion=_lazy("smpl.reader", "read_motion"),
    ),
    Format(
        "openface", (".csv",), "action units, pose and gaze of OpenFace",
        _lazy("face_tables.openface", "sniff"), _lazy("face_tables.openface", "read"), None, ("face",),
        read_face=_lazy("face_tables.openface", "read_face"),
    ),
    Format(
        "pyfeat", (".csv",), "blendshapes or action units of py-feat",
        _lazy("face_tables.pyfeat", "sniff"), _lazy("face_tables.pyfeat", "read"), None, ("face",),
        read_face=_lazy("face_tables.pyfeat", "read_face"),
    ),
    Format(
        "livelink", (".csv",), "table of blendshapes: Live Link Face's, or with ARKit's names",
        _lazy("face_tables.livelink_csv", "sniff"), _lazy("face_tables.livelink_csv", "read"),
        _lazy("face_tables.livelink_writer", "write"), ("face",),
        written="table of blendshapes as Live Link Face's",
        read_face=_lazy("face_tables.livelink_csv", "read_face"),
    ),
    Format(
        "livelink-udp", (".udp",), "recorded datagrams of Live Link Face",
        _lazy("face_tables.livelink_udp", "sniff"), _lazy("face_tables.livelink_udp", "read"), None,
        ("face",), read_face=_lazy("face_tables.livelink_udp", "read_face"),
    ),
    Format(
        "ifacialmocap", (".txt",), "records of iFacialMocap and Facemotion3d",
        _lazy("face_tables.ifacialmocap", "sniff"), _lazy("face_tables.ifacialmocap", "read"), None,
        ("face",), read_face=_lazy("face_tables.ifacialmocap", "read_face"),
    ),
    Format(
        "shapes-json", (".json",), "blendshapes in JSON: MediaPipe's scores, BEAT",
        _lazy("face_tables.shapes_json", "sniff"), _lazy("face_tables.shapes_json", "read"), None,
        ("face",), read_face=_lazy("face_tables.shapes_json", "read_face"),
    ),
    Format(
        "points", (".csv", ".json", ".npz", ".npy", ".jsonl"),
        "points of a tracked face: MediaPipe's 478, iBUG's 68; tables, JSON, NumPy's arrays",
        _lazy("face_tables.points", "sniff"), _lazy("face_tables.points", "read"), None,
        read_face=_lazy("face_tables.points", "read_points"),
    ),
    Format(
        "c3d", (".c3d",), "C3D optical motion capture: markers, here those of a face",
        _lazy("c3d.reader", "sniff"), _lazy("c3d.reader", "read"), None,
        read_face=_lazy("c3d.reader", "read_markers"),
    ),
    Format(
        "trc", (".trc",), "TRC (track row column): markers of a face",
        _lazy("markers.trc", "sniff"), _lazy("markers.trc", "read"), None,
        read_face=_lazy("markers.trc", "read_markers"),
    ),
    Format(
        "motive", (".csv",), "OptiTrack Motive's CSV export: markers of a face",
        _lazy("markers.motive", "sniff"), _lazy("markers.motive", "read"), None,
        read_face=_lazy("markers.motive", "read_markers"),
    ),
    Format(
        "nexus", (".csv",), "Vicon Nexus' CSV export: markers of a face",
        _lazy("markers.nexus", "sniff"), _lazy("markers.nexus", "read"), None,
        read_face=_lazy("markers.nexus", "read_markers"),
    ),
    Format(
        "qualisys", (".tsv",), "Qualisys Track Manager's TSV export: markers of a face",
        _lazy("markers.qualisys", "sniff"), _lazy("markers.qualisys", "read"), None,
        read_face=_lazy("markers.qualisys", "read_markers"),
    ),
    Format(
        "markers", (".csv", ".tsv"), "table of a face's markers, wide or long",
        _lazy("markers.table", "sniff"), _lazy("markers.table", "read"), None,
        read_face=_lazy("markers.table", "read_markers"),
    ),
)  # fmt: skip
"""In the order in which they are tried on a content: those quick to import first."""


def formats() -> tuple[Format, ...]:
    """Return all formats, in the order in which they are tried on a content: those quick to import first."""
    return _FORMATS


def format_of(path: Path, format: str | None = None) -> Format:
    """Return the format of a file to be read. format: its name, if it is known already.

    Raises FormatError if the file cannot be read or has no known format, OptionError for an unknown name.
    Warns (FbaWarning) of content that does not fit the suffix.
    """
    if format is not None:
        return _find_format(format)
    head, suffix = read_head(path), _suffix(path)
    by_suffix = [entry for entry in formats() if suffix in entry.suffixes]
    others = [entry for entry in formats() if entry not in by_suffix]
    match = next((entry for entry in (*by_suffix, *others) if entry.sniff(head, suffix)), None)
    if match is None and by_suffix and suffix not in COMMON_SUFFIXES:
        return by_suffix[0]  # the error of its reader will say what is wrong
    if match is None:
        kind = recognition_hint(head)
        error = FormatError(f"is in no format known here: {_list_formats()}{kind}", path=path)
        raise error if kind else error.with_remedies(UNKNOWN)
    if by_suffix and match not in by_suffix and suffix not in COMMON_SUFFIXES:
        warnings.warn(
            f"{os.fspath(path)}: is named {suffix}, but holds {match.name.upper()} content; "
            f"read as {match.name}",
            FbaWarning,
            stacklevel=3,
        )
    return match


def read(path: Path, *, format: str | None = None, **options: Any) -> Animation:
    """Read an animation from a file of any known format.

    format: its name; otherwise the content decides. options: those of the format's reader, see
    `formats()` and e.g. `fba.formats.text.fap.read_fap`. Raises FormatError, BitstreamError,
    UnsupportedError or OptionError.
    """
    reader = format_of(path, format)
    _check_options(reader.name, "reading", options, reader.read_options)
    return reader.read(path, **options)


def write(path: Path, animation: Animation, *, format: str | None = None, **options: Any) -> None:
    """Write an animation; the suffix of `path` chooses the format, unless `format` names it.

    The file is complete or, after an error, unchanged. Parts that the format cannot hold are left out with an
    FbaWarning.
    Raises FormatError, RangeError, UnsupportedError or OptionError.
    """
    writer = writer_for(path, format)
    _check_options(writer.name, "writing", options, writer.write_options)
    present = [part for part in ("face", "body") if getattr(animation, part) is not None]
    left_out = [part for part in present if part not in writer.carries]
    assert writer.write is not None  # or writer_for had raised
    writer.write(path, animation, **options)
    if left_out:
        warnings.warn(
            f"{os.fspath(path)}: {writer.name.upper()} holds no {left_out[0]}; only the "
            f"{writer.carries[0]} was written",
            FbaWarning,
            stacklevel=2,
        )


def writer_for(path: Path, format: str | None = None) -> Format:
    """Return the format for writing a file of this name. format: its name, used instead of the suffix.

    Raises FormatError for an unknown suffix, UnsupportedError for a format that can be read only.
    """
    if format is not None:
        writer = _find_format(format)
    else:
        suffix = _suffix(path)
        by_suffix = [entry for entry in formats() if suffix in entry.suffixes]
        if not by_suffix:
            raise FormatError(
                f"the suffix does not say which format to write; known: {_list_formats(writing=True)}",
                path=path,
                token=suffix or None,
            ).with_remedies(Remedy("format", "or name it with {}", "'fba'", "fba.write"))
        writer = next((entry for entry in by_suffix if entry.write is not None), by_suffix[0])
    if writer.write is None:
        raise UnsupportedError(
            f"{os.fspath(path)}: {writer.name.upper()} can be read only; write one of "
            f"{_list_formats(writing=True)}",
            what=f"writing {writer.name.upper()}",
        )
    return writer


def probe(
    data_or_path: bytes | bytearray | memoryview | Path,
    *,
    bap_steps: BapTable | None = None,
    format: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    **options: Any,
) -> StreamInfo:
    """Return what an FBA stream, in memory or in a file, or a file of another format contains.

    bap_steps: as for `fba.decode`; it only affects what counts as damage. format: as for `read`. limits: see
    `fba.Limits`. options: those of the reader, for formats other than FBA. Damage in a stream is skipped and
    listed.

    Raises FormatError, BitstreamError.
    """
    from fba.codec import StreamInfo, probe_stream
    from fba.source import naming_file, read_whole

    if isinstance(data_or_path, bytes | bytearray | memoryview):
        return probe_stream(data_or_path, bap_steps=bap_steps, limits=limits)
    reader = format_of(data_or_path, format)
    if reader.name == "fba":
        with naming_file(data_or_path):
            return probe_stream(read_whole(data_or_path), bap_steps=bap_steps, limits=limits)
    _check_options(reader.name, "reading", options, reader.read_options)
    if "limits" in reader.read_options:
        options["limits"] = limits
    animation = reader.read(data_or_path, **options)
    return StreamInfo.of_animation(animation, reader.name, os.stat(data_or_path).st_size)


def _find_format(name: str) -> Format:
    """Return the format with this name or suffix; OptionError if it does not exist."""
    wanted = str(name).lower().removeprefix(".")
    for entry in formats():
        if wanted == entry.name or f".{wanted}" in entry.suffixes:
            return entry
    known = [entry.name for entry in formats()]
    raise OptionError(f"there is no format {name!r}{did_you_mean(wanted, known)}; known: {', '.join(known)}")


def _check_options(name: str, doing: str, options: dict[str, Any], known: tuple[str, ...]) -> None:
    """Raise OptionError for an option that the reader or writer does not take."""
    for option in options:
        if option not in known:
            raise OptionError(
                f"{doing} {name} takes no option {option!r}; it takes {', '.join(known) or 'none'}"
            )


def _option_names(function: Callable[..., Any]) -> tuple[str, ...]:
    """Return the names of the keyword options of a reader or writer."""
    loaded = function.load() if isinstance(function, Lazy) else function
    extra = getattr(loaded, "extra_options", None)  # names that a reader or writer takes as **settings
    names = [
        parameter.name
        for parameter in inspect.signature(loaded).parameters.values()
        if parameter.kind is inspect.Parameter.KEYWORD_ONLY
    ]
    return tuple(dict.fromkeys([*names, *(extra() if extra else ())]))


def _suffix(path: Path) -> str:
    return os.path.splitext(os.fspath(path))[1].lower()


def _list_formats(writing: bool = False) -> str:
    """Return all formats, or those that can be written, with their suffixes, as text for a message."""
    return ", ".join(
        f"{entry.name.upper()} ({' '.join(entry.suffixes)})"
        for entry in formats()
        if entry.write is not None or not writing
    )
