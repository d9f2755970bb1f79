"""Table of all file formats; `read`, `write` and `probe`, which use it.

The content of a file decides its format; its suffix decides between formats that fit. The modules of formats
are imported when they are used.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

from fba.animation import Animation
from fba.errors import FormatError, OptionError, Remedy, UnsupportedError, did_you_mean, warn
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BapTable
from fba.recognition import recognition_hint
from fba.source import Path, naming_file, read_head

if TYPE_CHECKING:
    from fba.capture import Captured, FaceCapture, SkeletonMotion
    from fba.codec import StreamInfo
    from fba.formats.gltf.bodies import Content

COMMON_SUFFIXES = (".csv", ".json", ".txt")
"""Suffixes that say nothing about the content."""


class Lazy:
    """A function that is imported on the first call. place: "module:function"."""

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

    name: as in `format=`. suffixes: lower case, with the dot, the usual suffix first. sniff: whether a file
    with this beginning (up to 64 KiB) and this lower-case suffix has this format. write: Animation to file;
    None without a writer. carries: the parts that a file can hold. written: description of a written file, if
    `description` says more than the writer can do.

    One of these reads a file: read_animation: FAPs and BAPs, or what decodes to them. read_motion: the motion
    of a skeleton. read_face: a captured face as it is, markers and points included. read_person: a file that
    may hold any of these. `read` makes animations of motions and faces. kind: of the capture, see
    `fba.capture.capture_options`; "" for files of FAPs and BAPs.

    read_stream: returns the bytes of the FBA stream in a file.

    describe: describes a file that may hold several animations, of which `clip` of `read` chooses, or none.
    """

    name: str
    suffixes: tuple[str, ...]
    description: str
    sniff: Callable[[bytes, str], bool]
    write: Callable[..., None] | None = None
    carries: tuple[str, ...] = ("face", "body")
    read_animation: Callable[..., Animation] | None = None
    read_motion: Callable[..., SkeletonMotion] | None = None
    read_face: Callable[..., FaceCapture] | None = None
    read_person: Callable[..., Captured] | None = None
    kind: str = ""
    describe: Callable[..., Content] | None = None
    written: str = ""
    read_stream: Callable[..., bytes] | None = None

    def read(self, path: Path, **options: Any) -> Animation:
        """Return the animation of a file. options: of `read_options`."""
        if self.read_animation is not None:
            return self.read_animation(path, **options)
        return self.read_captured(path, **options).animation

    def read_captured(self, path: Path, **options: Any) -> Captured:
        """Return the animation of a capture, and the capture. options: of `read_options`."""
        from fba.capture import SkeletonOptions, make_animation

        given = {name: options[name] for name in options if name in self.capture_options}
        asked = {name: options[name] for name in options if name in _option_names(self._reader)}
        if self.read_person is not None:
            given.pop("rate", None)
            return self.read_person(path, SkeletonOptions(**given), **asked)
        with naming_file(path):
            capture = self._reader(path, **asked)
        return make_animation(capture, path=path, limits=options.get("limits", DEFAULT_LIMITS), **given)

    @property
    def _reader(self) -> Callable[..., Any]:
        reader = self.read_animation or self.read_person or self.read_motion or self.read_face
        assert reader is not None
        return reader

    @property
    def is_capture(self) -> bool:
        """Whether files hold captures, of which `read` makes FAPs or BAPs."""
        return (self.read_motion, self.read_face) != (None, None)

    @property
    def has_markers(self) -> bool:
        """Whether files hold markers or points, whose places on the face may be given in a map."""
        return self.kind in ("markers", "points")

    @property
    def capture_options(self) -> tuple[str, ...]:
        """Names of the options by which a capture becomes an animation."""
        if not self.kind:
            return ()
        from fba.capture import capture_options

        return capture_options(self.kind)

    @property
    def read_options(self) -> tuple[str, ...]:
        """Names of the options of `read`."""
        return tuple(dict.fromkeys([*self.capture_options, *_option_names(self._reader)]))

    @property
    def face_options(self) -> tuple[str, ...]:
        """Names of the keyword options of `read_face`; empty without it."""
        return () if self.read_face is None else _option_names(self.read_face)

    @property
    def write_options(self) -> tuple[str, ...]:
        """Names of the keyword options of `write`; empty without it."""
        return () if self.write is None else _option_names(self.write)


def _lazy(module: str, name: str) -> Lazy:
    return Lazy(f"fba.formats.{module}:{name}")


def _face(name: str, suffix: str, description: str, module: str, **more: Any) -> Format:
    """Return a format of tables of faces: blendshapes or action units."""
    place = f"face_tables.{module}"
    return Format(
        name, (suffix,), description, _lazy(place, "sniff"), carries=("face",),
        read_face=_lazy(place, "read_face"), kind="shapes", **more,
    )  # fmt: skip


def _markers(name: str, suffixes: tuple[str, ...], description: str, module: str) -> Format:
    """Return a format of markers."""
    return Format(
        name, suffixes, description, _lazy(module, "sniff"), read_face=_lazy(module, "read_markers"),
        kind="markers",
    )  # fmt: skip


_FORMATS = (
    Format(
        "fba", (".fba",), "MPEG-4 Face and Body Animation stream",
        _lazy("_fba", "sniff_fba"), _lazy("_fba", "write_fba"), read_animation=_lazy("_fba", "read_fba"),
        read_stream=_lazy("_fba", "read_stream"),
    ),
    Format(
        "fap", (".fap",), "ASCII face animation parameters, versions 2.0 to 2.2",
        _lazy("text.fap", "sniff_fap"), _lazy("text.fap", "write_fap"), ("face",),
        read_animation=_lazy("text.fap", "read_fap"),
        written="ASCII face animation parameters, version 2.2",
    ),
    Format(
        "bap", (".bap",), "ASCII body animation parameters, versions 3.1 and 3.2",
        _lazy("text.bap", "sniff_bap"), _lazy("text.bap", "write_bap"), ("body",),
        read_animation=_lazy("text.bap", "read_bap"),
        written="ASCII body animation parameters, version 3.2",
    ),
    Format(
        "epf", (".epf",), "encoder parameter file: how to encode an animation; contains none itself",
        _lazy("epf.epf", "sniff_epf"), None, (), read_animation=_lazy("epf.epf", "read_animation"),
    ),
    Format(
        "bvh", (".bvh",), "Biovision motion capture: a skeleton and its joint angles",
        _lazy("bvh._reader", "sniff"), _lazy("bvh._writer", "write"), ("body",),
        read_motion=_lazy("bvh._reader", "read_motion"), kind="skeleton",
    ),
    Format(
        "vrma", (".vrma",), "VRM animation: read as glTF; written, the expressions of a face",
        _lazy("gltf._vrma", "sniff"), _lazy("gltf._vrma", "write"), ("face",),
        read_person=_lazy("gltf._reader", "read_person"), kind="skeleton",
        written="VRM animation, the expressions of a face",
    ),
    Format(
        "gltf", (".glb", ".gltf", ".vrma"),
        "glTF 2.0: read, an animated skeleton; written, a skinned person",
        _lazy("gltf._reader", "sniff"), _lazy("gltf._writer", "write"),
        read_person=_lazy("gltf._reader", "read_person"), read_motion=_lazy("gltf._reader", "read_motion"),
        kind="skeleton", describe=_lazy("gltf.bodies", "describe"), written="glTF 2.0, a skinned person",
    ),
    Format(
        "smpl", (".npz",), "motion of SMPL, SMPL-H and SMPL-X bodies, as AMASS saves it",
        _lazy("smpl._reader", "sniff"), read_motion=_lazy("smpl._reader", "read_motion"), kind="skeleton",
    ),
    Format(
        "arf", (".aau", ".arfz"), "avatar animation units (ISO/IEC 23090-39), alone or in a container",
        _lazy("avatar._reader", "sniff"), _lazy("avatar._writer", "write"),
        read_person=_lazy("avatar._reader", "read_person"),
        read_motion=_lazy("avatar._reader", "read_motion"), kind="skeleton",
        written="avatar animation units (ISO/IEC 23090-39)",
    ),
    Format(
        "mp4", (".mp4", ".m4v", ".mov"), "MP4 file with an FBA stream, and perhaps sound",
        _lazy("_mp4", "sniff_mp4"), _lazy("_mp4", "write_mp4"), read_animation=_lazy("_mp4", "read_mp4"),
        read_stream=_lazy("_mp4", "read_stream"),
    ),
    _face("openface", ".csv", "action units, pose and gaze of OpenFace", "_openface"),
    _face("pyfeat", ".csv", "blendshapes or action units of py-feat", "_pyfeat"),
    _face(
        "livelink", ".csv", "table of blendshapes: Live Link Face's, or with ARKit's names", "_livelink_csv",
        write=_lazy("face_tables._livelink_csv", "write"),
        written="table of blendshapes as Live Link Face's",
    ),
    _face("livelink-udp", ".udp", "recorded datagrams of Live Link Face", "livelink_udp"),
    _face("ifacialmocap", ".txt", "records of iFacialMocap and Facemotion3d", "ifacialmocap"),
    _face("shapes-json", ".json", "blendshapes in JSON: MediaPipe's scores, BEAT", "_shapes_json"),
    Format(
        "points", (".csv", ".json", ".npz", ".npy", ".jsonl"),
        "points of a tracked face: MediaPipe's 478, iBUG's 68; tables, JSON, NumPy's arrays",
        _lazy("face_tables._tracked_points", "sniff"),
        read_face=_lazy("face_tables._tracked_points", "read_points"), kind="points",
    ),
    _markers("c3d", (".c3d",), "C3D optical motion capture: markers, here those of a face", "c3d._reader"),
    _markers("trc", (".trc",), "TRC (track row column): markers of a face", "markers._trc"),
    _markers("motive", (".csv",), "OptiTrack Motive's CSV export: markers of a face", "markers._motive"),
    _markers("nexus", (".csv",), "Vicon Nexus' CSV export: markers of a face", "markers._nexus"),
    _markers(
        "qualisys", (".tsv",), "Qualisys Track Manager's TSV export: markers of a face", "markers._qualisys"
    ),
    _markers("markers", (".csv", ".tsv"), "table of a face's markers, wide or long", "markers._table"),
)  # fmt: skip


def formats() -> tuple[Format, ...]:
    """Return all formats in the order in which a content is tried on them: those quick to import first."""
    return _FORMATS


def format_of(path: Path, format: str | None = None) -> Format:
    """Return the format of a file to be read. format: its name; None to recognise it.

    Raises FormatError if the file cannot be read or its format is unknown, OptionError for an unknown name.
    Warns (FbaWarning) of content that does not fit the suffix.
    """
    if format is not None:
        return _find_format(format)
    head, suffix = read_head(path), _suffix(path)
    by_suffix = [entry for entry in formats() if suffix in entry.suffixes]
    others = [entry for entry in formats() if entry not in by_suffix]
    match = next((entry for entry in (*by_suffix, *others) if entry.sniff(head, suffix)), None)
    if match is None and by_suffix and suffix not in COMMON_SUFFIXES:
        return by_suffix[0]  # its reader raises an error that says what is wrong
    if match is None:
        kind = recognition_hint(head)
        error = FormatError(f"is in no format known here: {_list_formats()}{kind}", path=path)
        if kind:
            raise error
        raise error.with_remedies(Remedy("format", "if it is one of them, name it with {}", "'bvh'"))
    if by_suffix and match not in by_suffix and suffix not in COMMON_SUFFIXES:
        warn(
            f"{os.fspath(path)}: is named {suffix}, but holds {match.name.upper()} content; "
            f"read as {match.name}",
            stacklevel=3,
        )
    return match


def read(path: Path, *, format: str | None = None, **options: Any) -> Animation:
    """Read an animation from a file of any format, see `formats()`.

    format: its name; None to recognise it. options: of its reader, e.g. `fba.formats.text.fap.read_fap`; for
    captures also those of `fba.capture.SkeletonOptions`, `from_markers` and `from_points`. Raises
    FormatError, BitstreamError, UnsupportedError or OptionError.
    """
    reader = format_of(path, format)
    _check_options(reader.name, "reading", options, reader.read_options)
    return reader.read(path, **options)


def read_motion(path: Path, *, format: str | None = None, **options: Any) -> SkeletonMotion:
    """Return the motion of a captured skeleton as the file has it, before it is retargeted.

    format and errors: as for `read`. options: of the reader, e.g. `limits`, or `clip` for glTF.
    """
    reader = format_of(path, format)
    motion: SkeletonMotion = _call_reader(reader, reader.read_motion, "a captured skeleton", path, options)
    return motion


def read_face(path: Path, *, format: str | None = None, **options: Any) -> Any:
    """Return a captured face as the file has it, before FAPs are made of it.

    Shape weights give a ShapeMotion, action units an ActionUnitMotion, markers a MarkerMotion, points of an
    image a PointMotion. format and errors: as for `read`. options: of the reader, e.g. `limits`.
    """
    reader = format_of(path, format)
    return _call_reader(reader, reader.read_face, "a captured face", path, options)


def _call_reader(
    reader: Format, function: Callable[..., Any] | None, content: str, path: Path, options: dict[str, Any]
) -> Any:
    if function is None:
        raise FormatError(f"is {reader.name.upper()}, which holds no such thing as {content}", path=path)
    _check_options(reader.name, "reading", options, _option_names(function))
    return function(path, **options)


def write(path: Path, animation: Animation, *, format: str | None = None, **options: Any) -> None:
    """Write an animation in the format of the suffix of `path`, or in that which `format` names.

    The file is complete or, after an error, unchanged. Parts that the format cannot hold are left out, with
    an FbaWarning. Raises FormatError, RangeError, UnsupportedError or OptionError.
    """
    writer = writer_for(path, format)
    _check_options(writer.name, "writing", options, writer.write_options)
    present = [part for part in ("face", "body") if getattr(animation, part) is not None]
    left_out = [part for part in present if part not in writer.carries]
    assert writer.write is not None  # or writer_for had raised
    writer.write(path, animation, **options)
    if left_out:
        warn(
            f"{os.fspath(path)}: {writer.name.upper()} holds no {left_out[0]}; only the "
            f"{writer.carries[0]} was written",
            stacklevel=2,
        )


def writer_for(path: Path, format: str | None = None) -> Format:
    """Return the format for writing a file. format: its name, in place of the suffix.

    Raises FormatError for an unknown suffix, UnsupportedError for a format without a writer.
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
    """Return the content of an FBA stream, in memory or in a file, or of a file of another format.

    bap_steps: as for `fba.decode`; it only affects what counts as damage. format: as for `read`. limits: see
    `fba.Limits`. options: of the reader, for formats other than FBA. Damage in a stream is skipped and
    listed. Of an MP4 file, that is its stream alone. Raises FormatError, BitstreamError.
    """
    from fba.codec import StreamInfo, probe_stream
    from fba.source import naming_file

    if isinstance(data_or_path, bytes | bytearray | memoryview):
        return probe_stream(data_or_path, bap_steps=bap_steps, limits=limits)
    reader = format_of(data_or_path, format)
    _check_options(reader.name, "reading", options, reader.read_options)
    if reader.read_stream is not None:
        with naming_file(data_or_path):
            data = reader.read_stream(data_or_path, limits=limits, **options)
            return replace(probe_stream(data, bap_steps=bap_steps, limits=limits), format=reader.name)
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
