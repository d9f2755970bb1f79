"""`--map`, `--map-out` and `--rest`: which joint of a capture is which, and how its skeleton rests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli.inputs import Reading, input_file
from fba.cli.option_fields import option
from fba.cli.program import as_typed
from fba.errors import OptionError
from fba.limits import Limits

if TYPE_CHECKING:
    from fba.capture import SkeletonMotion

Pair = tuple[str, str]


class MapType(click.ParamType["Path | Pair"]):
    """A joint of the capture and one of the standard, Pelvis=HumanoidRoot, or a file of such pairs."""

    name = "map"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path | Pair:
        if isinstance(value, (Path, tuple)):
            return value
        text = str(value)
        if Path(text).is_file():
            return Path(text)
        source, equals, joint = text.rpartition("=")
        if not equals or not source:
            self.fail(
                f"{text!r} is neither a file nor a pair of joints such as Pelvis=HumanoidRoot", param, ctx
            )
        return source, joint


class RestType(click.ParamType["str | int"]):
    """Which rest pose a capture has: a word, or the number of a frame."""

    name = "rest"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str | int:
        from fba.capture.preparation import RESTS

        if isinstance(value, int):
            return value
        text = str(value)
        if text in RESTS:
            return text
        if not (text.isascii() and text.isdigit() and len(text) < 10):
            self.fail(f"{text!r} is not one of {', '.join(RESTS)}, nor the number of a frame", param, ctx)
        return int(text)


Maps = tuple[Path | Pair, ...]
"""What `--map` names: files, and pairs of names."""
map_option = option(
    "--map",
    default=(),
    type=MapType(),
    multiple=True,
    metavar="NAME=PLACE|FILE",
    help="Motion capture: which joint of the standard a joint of the file is, Pelvis=HumanoidRoot; none: "
    "Hat=. Or where on the face a marker is, Chin=2.1. Repeatable. Or a TOML file of such pairs, in place "
    "of what is found.",
)


def read_joints(
    maps: Sequence[Path | Pair], captures: Sequence[Path], reading: Reading
) -> dict[str, str] | None:
    """Return the map that `--map` gives, None without; click.UsageError where there is nothing to map."""
    if not maps:
        return None
    if not captures:
        raise click.UsageError("--map goes with motion capture: joints of a body, or markers on a face")
    return _combine(maps, reading.limit, lambda: read_capture(captures[0], reading))


def read_body_joints(maps: Sequence[Path | Pair], body: Path | None, limits: Limits) -> dict[str, str] | None:
    """Return the map that `--map` gives for the person of `--body`, None without."""
    if not maps:
        return None
    from fba.formats.gltf.bodies import read_skeleton

    if body is None:
        encode = as_typed("fba encode")
        raise click.UsageError(f"--map names the joints of a --body: give one; {encode} has it for captures")
    return _combine(maps, limits, lambda: read_skeleton(body, limits=limits))


def _combine(
    maps: Sequence[Path | Pair], limits: Limits, skeleton: Callable[[], SkeletonMotion]
) -> dict[str, str]:
    """Return the map of a file of joints and pairs, which change it or what is found in the skeleton."""
    from fba.capture.joint_maps import change_map, read_map
    from fba.formats.gltf.humanoid import joints_of_bones

    saved = [each for each in maps if isinstance(each, Path)]
    bones = joints_of_bones()  # VRM's names are known to many
    pairs = {
        source: bones.get(joint, joint) for source, joint in (p for p in maps if not isinstance(p, Path))
    }
    if len(saved) > 1:
        raise click.UsageError("--map: give one file of joints at most; pairs change what it says")
    base = read_map(saved[0], limits=limits) if saved else None
    if base is not None and not pairs:
        return base
    try:
        return change_map(skeleton(), base, pairs)
    except OptionError as error:
        raise click.UsageError(f"--map: {error}") from error


def write_joints(target: Path, joints: dict[str, str] | None, motion: SkeletonMotion) -> int:
    """Write the map that was used for a capture; return the number of its joints."""
    from fba.capture.joint_maps import find_map, write_map

    used = find_map(motion, joints)
    write_map(target, used, motion)
    return len(used)


def read_capture(path: Path, reading: Reading) -> SkeletonMotion:
    """Return the motion of a capture, without the warnings that reading it a second time would repeat."""
    import warnings

    from fba.errors import FbaWarning
    from fba.formats import format_of

    with input_file(path) as file, warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)
        reader = format_of(file, reading.format)
        assert reader.read_motion is not None  # the caller names captures only
        options: dict[str, Any] = {} if reader.list_clips is None else {"clip": reading.clip}
        return reader.read_motion(file, limits=reading.limit, **options)
