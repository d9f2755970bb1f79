"""`fba model photos`: a head from photographs of a person."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from fba.cli import options
from fba.cli.coding.tolerance_options import LENGTH
from fba.cli.command import Command, examples
from fba.cli.option_fields import option, with_options
from fba.cli.outputs import Output, Outputs, check_glb, display_name, further_output_option, output_option
from fba.cli.printing import Progress
from fba.errors import ModelError

if TYPE_CHECKING:
    from fba.face.fitting import Photo, Photograph, PhotoHead

Places = dict[str, dict[str, tuple[float, float]]]


@dataclass(frozen=True, kw_only=True)
class _Target:
    """Where the head goes, and what is written beside it."""

    output: Path = output_option("OUT.glb", "Model to write; - for standard output.", required=True)
    no_clobber: bool = options.no_clobber_option
    edit: Path | None = further_output_option(
        "POINTS.json",
        "Open a window with the photographs, in which the points are dragged to where they belong; they are "
        "saved here. Begins with --points, with this file if it exists, or with the points that are found.",
    )
    show_steps: Path | None = further_output_option(
        "FILE.png|.jpg", "Picture of how the points were found, of the points and of the finished head."
    )


@dataclass(frozen=True, kw_only=True)
class _Given:
    """What is known of the person and the camera."""

    points: Path | None = options.model_option(
        "JSON file with the points on the photographs, or the CSV or JSON of a landmark program (MediaPipe, "
        "dlib, OpenFace) for the frontal one. Default: points are found.",
        "--points",
    )
    eyes: float | None = option(
        type=LENGTH, metavar="63mm", help="Distance between the pupils. Default: the built-in head's, 62 mm."
    )
    distance: float | None = option(
        type=LENGTH, metavar="1.5m", help="Distance of the camera from the head. Default: 1.5m."
    )
    hair: Literal["keep", "none"] = option(
        default="keep",
        help="The built-in hair where no photograph shows anything: keep it, or none, skin in its place. "
        "Default: keep.",
    )
    name: str | None = option(help="Name of the model. Default: the name of the frontal photograph.")


@click.command(
    "photos",
    cls=Command,
    short_help="Make a head from photographs of a person.",
    epilog=examples(
        "fba model photos front.jpg -o me.glb --edit me.points.json",
        "fba model photos front.jpg side.jpg -o me.glb --points me.points.json",
        "fba model photos front.jpg -o me.glb --points landmarks.csv --show-steps me.png",
    ),
)
@click.argument("front", metavar="FRONT", type=options.FILE)
@click.argument("side", metavar="[SIDE]", type=options.FILE, required=False)
@with_options
def command(
    front: Path, side: Path | None, target: _Target, given: _Given, as_json: bool = options.json_option
) -> None:
    """Fit the built-in head to a person in photographs, with the skin that they show; every FAP moves it.

    FRONT shows the face from the front, at rest, mouth closed; SIDE, its profile, adds depth.
    Points are positions of feature points of MPEG-4 in pixels. Look at the result: with --show-steps, or with
    `fba play --model OUT.glb`.
    """
    from fba.face import fitting

    outputs = _outputs(target, [front, side, given.points])
    with Progress("reading", None):
        photographs = [fitting.read_photograph(path) for path in (front, side) if path is not None]
    places, steps = _places(target, given, photographs)
    if target.edit is not None:
        places = _edited(target.edit, places, photographs, outputs)
    photos = _photos(photographs, places)
    with Progress("fitting", None):
        head = fitting.head_from_photos(
            photos[0],
            photos[1] if len(photos) > 1 else None,
            eyes=given.eyes,
            distance=given.distance or fitting.DISTANCE,
            hair=given.hair == "keep",
            name=given.name or front.stem,
        )
    with outputs.file(target.output) as file:
        head.model.save(file)
    if target.show_steps is not None:
        with Progress("rendering", None), outputs.file(target.show_steps) as file:
            _draw_steps(file, photos, head, steps)
    if as_json:
        outputs.print_json(_values(head, target.output))
        return
    for line in _lines(head, photos, target.output):
        outputs.say(line)


def _outputs(target: _Target, inputs: list[Path | None]) -> Outputs:
    written = [Output("--output", target.output)]
    if target.edit is not None:
        if target.edit.suffix.lower() != ".json":
            raise click.UsageError(f"--edit {target.edit}: points are saved as JSON; name it .json")
        written.append(Output("--edit", target.edit))
    if target.show_steps is not None:
        if target.show_steps.suffix.lower() not in (".png", ".jpg", ".jpeg"):
            raise click.UsageError(f"--show-steps {target.show_steps}: a picture is .png or .jpg")
        written.append(Output("--show-steps", target.show_steps))
    points = inputs[-1]
    if target.edit is not None and points is not None and points.absolute() == target.edit.absolute():
        inputs = inputs[:-1]  # points may be edited in place
    outputs = Outputs(written, inputs, no_clobber=target.no_clobber)
    check_glb(target.output)
    return outputs


def _places(target: _Target, given: _Given, photographs: list[Photograph]) -> tuple[Places, list[Any]]:
    """Return the points by view to begin with, and the pictures of how they were found."""
    from fba.face import fitting

    source = given.points
    if source is None and target.edit is not None and target.edit.is_file():
        source = target.edit
    places: Places = {} if source is None else fitting.read_photo_points(source, photographs[0].size)
    steps: list[Any] = []
    finders = {"front": fitting.find_front_points, "side": fitting.find_side_points}
    for view, photograph in zip(finders, photographs, strict=False):
        if view not in places:
            try:
                found = finders[view](photograph)
            except ModelError as error:
                if target.edit is None and view == "front" and len(photographs) > 1:
                    raise ModelError(
                        f"{error}, or give the photographs as FRONT SIDE if this is the profile"
                    ) from None
                if target.edit is None:
                    raise
                places[view] = fitting.template_points(photograph, view)  # to be dragged
                continue
            places[view] = found.points
            steps += found.steps if target.show_steps is not None else []
    return places, steps


def _edited(path: Path, places: Places, photographs: list[Photograph], outputs: Outputs) -> Places:
    """Return the points after the user has moved them in a window. Exits with 1 if nothing was saved."""
    from fba_player.window.pages import check_page, place_photo_points

    check_page("photos")
    editing = place_photo_points(photographs, places, path)
    if not editing.written:
        outputs.say(f"{path}: not written, as the window was closed without saving; no head was made")
        raise click.exceptions.Exit(1)
    return editing.by_view()


def _photos(photographs: list[Photograph], places: Places) -> list[Photo]:
    from fba.face.fitting import Photo

    views = ("front", "side")
    if len(photographs) == 1 and "side" in places:
        raise click.UsageError("the points are of two photographs; give the profile as SIDE")
    return [Photo(photograph, places[view]) for view, photograph in zip(views, photographs, strict=False)]


def _lines(head: PhotoHead, photos: list[Photo], output: Path) -> list[str]:
    from fba.cli import model_text

    lines = [f"{display_name(output)}: {model_text.summary(head.model)}"]
    for view, photo, how, errors in zip(("front", "side"), photos, head.views, head.errors, strict=False):
        yaw, pitch = how.degrees
        off = 1000 * sum(errors.values()) / len(errors)
        lines.append(
            f"  {view} {photo.photograph.name}: {len(errors)} points, {off:.1f} mm off on average; camera "
            f"{abs(yaw):.0f} degrees to the {'left' if yaw >= 0 else 'right'}, {pitch:.0f} above"
        )
    lines.append(f"  skin: {100 * head.seen:.0f} % of the face from the photographs")
    lines.append("  measures, beside those of the built-in head:")
    for one in head.measures:
        unit = " degrees" if one.angle else ""
        digits = 0 if one.angle else 2
        lines.append(f"    {one.view:7} {one.name:52} {one.value:6.{digits}f} {one.usual:6.{digits}f}{unit}")
    lines += [f"  {line}" for line in model_text.lost_lines(head.model)]
    return lines


def _values(head: PhotoHead, output: Path) -> dict[str, Any]:
    """Return the result for programs; lengths in mm."""
    return {
        "output": str(output),
        "views": [
            {
                "yaw": view.degrees[0],
                "pitch": view.degrees[1],
                "errors": {k: 1000 * v for k, v in off.items()},
            }
            for view, off in zip(head.views, head.errors, strict=True)
        ],
        "skin_seen": head.seen,
        "measures": [
            {
                "view": one.view,
                "name": one.name,
                "value": one.value,
                "built_in": one.usual,
                "degrees": one.angle,
            }
            for one in head.measures
        ],
    }


def _draw_steps(file: Path, photos: list[Photo], head: PhotoHead, steps: list[Any]) -> None:
    from fba_player.export.image_files import write_picture
    from fba_player.export.photo_sheet import photo_sheet

    write_picture(file, photo_sheet(photos, head, steps))
