"""All file formats in one table, and `read`, `write` and `probe` over it.

What a file is, is found in its content; the name's suffix only decides where the content leaves it
open. Modules of formats are imported when they are used.
"""

from __future__ import annotations

import inspect
import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from fba.animation import Animation
from fba.errors import FbaWarning, FormatError, OptionError, Remedy, UnsupportedError, did_you_mean
from fba.recognition import but_recognised
from fba.source import Path, read_head

if TYPE_CHECKING:
    from fba.capture.motion import SkeletonMotion
    from fba.codec import StreamInfo


UNKNOWN = Remedy("format", "if it is one of them, name it with {}", "'bvh'")


class Lazy:
    """A function by name, "module:function", imported on the first call."""

    def __init__(self, place: str) -> None:
        self._place = place
        self._function: Callable[..., Any] | None = None

    def __repr__(self) -> str:
        return f"Lazy({self._place!r})"

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """What the function returns."""
        return self.load()(*arguments, **options)

    def load(self) -> Callable[..., Any]:
        """The function, its module imported."""
        if self._function is None:
            module, _, name = self._place.partition(":")
            self._function = getattr(import_module(module), name)
        return self._function


@dataclass(frozen=True)
class Format:
    """A file format.

    name: as in `format=`. suffixes: lower case, with the dot, the first is the usual one. sniff: whether
    a file with this beginning (up to 64 KiB) and this lower-case suffix is one. read, write: file to
    Animation and back; write is None where there is no writer. carries: the parts that it can hold.
    read_motion: the motion of a captured skeleton,
    for formats of motion capture, whose parameters are worked out when they are read. written: what a written
    file is, where that is less than `description` says.
    """

    name: str
    suffixes: tuple[str, ...]
    description: str
    sniff: Callable[[bytes, str], bool]
    read: Callable[..., Animation]
    write: Callable[..., None] | None
    carries: tuple[str, ...] = ("face", "body")
    read_motion: Callable[..., SkeletonMotion] | None = None
    written: str = ""

    @property
    def read_options(self) -> tuple[str, ...]:
        """Names of the keyword options of `read`."""
        return _options(self.read)

    @property
    def write_options(self) -> tuple[str, ...]:
        """Names of the keyword options of `write`; empty where there is no writer."""
        return () if self.write is None else _options(self.write)


@cache
def formats() -> tuple[Format, ...]:
    """The formats, in the order in which they are tried on a content: the quick to import first."""

    def at(module: str, name: str) -> Lazy:
        return Lazy(f"fba.formats.{module}:{name}")

    return (
        Format(
            "fba", (".fba",), "MPEG-4 Face and Body Animation stream",
            at("fba", "sniff_fba"), at("fba", "read_fba"), at("fba", "write_fba"),
        ),
        Format(
            "fap", (".fap",), "ASCII face animation parameters, versions 2.0 to 2.2",
            at("text.fap", "sniff_fap"), at("text.fap", "read_fap"), at("text.fap", "write_fap"), ("face",),
            written="ASCII face animation parameters, version 2.2",
        ),
        Format(
            "bap", (".bap",), "ASCII body animation parameters, versions 3.1 and 3.2",
            at("text.bap", "sniff_bap"), at("text.bap", "read_bap"), at("text.bap", "write_bap"), ("body",),
            written="ASCII body animation parameters, version 3.2",
        ),
        Format(
            "epf", (".epf",), "encoder parameter file: how to code an animation; holds none itself",
            at("epf.epf", "sniff_epf"), at("epf.epf", "read_animation"), None, (),
        ),
        Format(
            "bvh", (".bvh",), "Biovision motion capture: a skeleton and its joint angles",
            at("bvh.reader", "sniff"), at("bvh.reader", "read"), at("bvh.writer", "write"), ("body",),
            read_motion=at("bvh.reader", "read_motion"),
        ),
        Format(
            "gltf", (".glb", ".gltf"), "glTF 2.0: read, an animated skeleton; written, a skinned person",
            at("gltf.reader", "sniff"), at("gltf.reader", "read"), at("gltf.writer", "write"),
            read_motion=at("gltf.reader", "read_motion"), written="glTF 2.0, a skinned person",
        ),
    )  # fmt: skip


def format_of(path: Path, format: str | None = None) -> Format:
    """The format of a file that is to be read; format: its name, where it is known already.

    Raises FormatError where the file cannot be read or is of no known format, OptionError for an
    unknown name. A content that another suffix belongs to is an FbaWarning.
    """
    if format is not None:
        return _named(format)
    head, suffix = read_head(path), _suffix(path)
    by_suffix = [entry for entry in formats() if suffix in entry.suffixes]
    others = [entry for entry in formats() if entry not in by_suffix]
    found = next((entry for entry in (*by_suffix, *others) if entry.sniff(head, suffix)), None)
    if found is None and by_suffix:
        return by_suffix[0]  # its reader says what is wrong with it
    if found is None:
        kind = but_recognised(head)
        error = FormatError(f"is in no format known here: {_list()}{kind}", path=path)
        raise error if kind else error.with_remedies(UNKNOWN)
    if by_suffix and found not in by_suffix:
        warnings.warn(
            f"{os.fspath(path)}: is named {suffix}, but holds {found.name.upper()} content; "
            f"read as {found.name}",
            FbaWarning,
            stacklevel=3,
        )
    return found


def read(path: Path, *, format: str | None = None, **options: Any) -> Animation:
    """Read an animation from a file of any known format.

    format: its name where the content should not be asked. options: those of the format's reader, see
    `formats()` and e.g. `fba.formats.text.fap.read_fap`. Raises FormatError, BitstreamError,
    UnsupportedError or OptionError.
    """
    found = format_of(path, format)
    _check_options(found.name, "reading", options, found.read_options)
    return found.read(path, **options)


def write(path: Path, animation: Animation, *, format: str | None = None, **options: Any) -> None:
    """Write an animation; the suffix of `path` chooses the format, where `format` does not name it.

    The file appears whole or not at all. What the format cannot hold is left out with an FbaWarning.
    Raises FormatError, RangeError, UnsupportedError or OptionError.
    """
    chosen = writer_for(path, format)
    _check_options(chosen.name, "writing", options, chosen.write_options)
    present = [part for part in ("face", "body") if getattr(animation, part) is not None]
    left_out = [part for part in present if part not in chosen.carries]
    assert chosen.write is not None  # writer_for saw to that
    chosen.write(path, animation, **options)
    if left_out:
        warnings.warn(
            f"{os.fspath(path)}: {chosen.name.upper()} holds no {left_out[0]}; only the "
            f"{chosen.carries[0]} was written",
            FbaWarning,
            stacklevel=2,
        )


def writer_for(path: Path, format: str | None = None) -> Format:
    """The format to write a file of this name in; format: its name, where the suffix is not to say.

    Raises FormatError for an unknown suffix, UnsupportedError for a format that can be read only.
    """
    if format is not None:
        chosen = _named(format)
    else:
        suffix = _suffix(path)
        by_suffix = [entry for entry in formats() if suffix in entry.suffixes]
        if not by_suffix:
            raise FormatError(
                f"the suffix does not say which format to write; known: {_list(writing=True)}",
                path=path,
                token=suffix or None,
            ).with_remedies(Remedy("format", "or name it with {}", "'fba'", "fba.write"))
        chosen = by_suffix[0]
    if chosen.write is None:
        raise UnsupportedError(
            f"{os.fspath(path)}: {chosen.name.upper()} can be read only; write one of {_list(writing=True)}",
            what=f"writing {chosen.name.upper()}",
        )
    return chosen


def probe(
    data_or_path: bytes | bytearray | memoryview | Path,
    *,
    bap_steps: str = "iso",
    format: str | None = None,
    **options: Any,
) -> StreamInfo:
    """What an FBA stream, in memory or in a file, or a file of another format holds.

    bap_steps: as for `fba.decode`; it matters to no more than what counts as damage. format: as for `read`.
    options: those of the reader, for other formats than FBA. Values of a stream are decoded, but not kept;
    damage is stepped over and listed. Raises FormatError, BitstreamError.
    """
    from fba.codec import StreamInfo, probe_stream
    from fba.formats.fba import located
    from fba.source import read_whole

    if isinstance(data_or_path, bytes | bytearray | memoryview):
        return probe_stream(data_or_path, bap_steps=bap_steps)
    found = format_of(data_or_path, format)
    if found.name == "fba":
        with located(data_or_path):
            return probe_stream(read_whole(data_or_path), bap_steps=bap_steps)
    _check_options(found.name, "reading", options, found.read_options)
    animation = found.read(data_or_path, **options)
    return StreamInfo.of_animation(animation, found.name, os.stat(data_or_path).st_size)


def _named(name: str) -> Format:
    wanted = str(name).lower().removeprefix(".")
    for entry in formats():
        if wanted == entry.name or f".{wanted}" in entry.suffixes:
            return entry
    known = [entry.name for entry in formats()]
    raise OptionError(f"there is no format {name!r}{did_you_mean(wanted, known)}; known: {', '.join(known)}")


def _check_options(name: str, doing: str, options: dict[str, Any], known: tuple[str, ...]) -> None:
    for option in options:
        if option not in known:
            raise OptionError(
                f"{doing} {name} takes no option {option!r}; it takes {', '.join(known) or 'none'}"
            )


def _options(function: Callable[..., Any]) -> tuple[str, ...]:
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


def _list(writing: bool = False) -> str:
    return ", ".join(
        f"{entry.name.upper()} ({' '.join(entry.suffixes)})"
        for entry in formats()
        if entry.write is not None or not writing
    )
