"""`fba model`: inspect face models, check them, import, fit and simplify them."""

from __future__ import annotations

import shlex
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from fba.choices import Adaptation, UpAxis
from fba.cli import options
from fba.cli.command import Group, examples
from fba.cli.inputs import read_model
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import (
    STANDARD,
    Output,
    Outputs,
    check_glb,
    display_name,
    further_output_option,
    output_option,
)
from fba.cli.printing import Progress, colour_grade, print_json
from fba.cli.subcommands import model_learn_fit, model_photos, model_simplify
from fba.errors import FbaWarning, warn

if TYPE_CHECKING:
    from fba.arrays import Float64
    from fba.face import FaceModel
    from fba.face.checks import Finding

SOURCE = options.ExistingPath()
POINT_FILES = "FDP, CSV or JSON file"
DEFAULT_OPTION = option(default=False, help="Use the built-in head instead of FILE.")
OUTPUT_OPTION = output_option("OUT.glb", "Model to write; - for standard output.", required=True)


@dataclass(frozen=True, kw_only=True)
class _Target:
    """Where a model goes, and a picture of its face."""

    output: Path = OUTPUT_OPTION
    no_clobber: bool = options.no_clobber_option
    sheet: Path | None = further_output_option(
        "FILE.png|.jpg",
        "Picture that shows the face at rest and in its main motions, visemes and expressions.",
    )


@dataclass(frozen=True, kw_only=True)
class _Mesh:
    """How a mesh is read, see `fba.face.importers.import_model`."""

    points: Path | None = options.model_option(
        f"{POINT_FILES} with the feature points. Default: a file beside IN with the same name.", "--points"
    )
    kind: Literal["makehuman", "gltf", "shapes", "obj", "ply", "wfm", "fdp"] | None = option(
        help="Kind of the mesh. Default: recognised from its content."
    )
    up: UpAxis = option(default="y", help="Vertical axis.")
    kinds: tuple[str, ...] = option(
        "--part",
        default=(),
        metavar="NAME=KIND",
        help="Kind of a group, object, mesh or material: skin, eye, teeth, tongue, ..., or none to leave it "
        "out; repeatable.",
    )

    def options(self) -> dict[str, Any]:
        """Return arguments of `import_model`; click.UsageError for an unknown kind."""
        from fba.face.model import PART_KINDS

        kinds = {}
        for text in self.kinds:
            name, equals, kind = text.rpartition("=")
            if not equals or not name or kind not in (*PART_KINDS, "none"):
                raise click.UsageError(
                    f"--part {text}: write NAME=KIND, with a kind of {', '.join(PART_KINDS)} or none"
                )
            kinds[name] = kind
        return {"points": self.points, "kind": self.kind, "up": self.up, "kinds": kinds or None}

    def import_command(self, head: Path, points: Path) -> str:
        """Return the command that imports a head with its points."""
        words = ["fba", "model", "import", str(head), "--points", str(points)]
        words += ["--kind", self.kind] if self.kind else []
        words += ["--up", self.up] if self.up != "y" else []
        words += [word for text in self.kinds for word in ("--part", text)]
        return shlex.join([*words, "-o", f"{head.stem}.fba.glb"])


@click.group(
    "model",
    cls=Group,
    epilog=examples(
        "fba model info --default",
        "fba model validate head.glb",
        "fba model points scan.obj -o scan.points.csv",
        "fba model import scan.obj --points scan.points.csv -o head.glb",
        "fba model fit person.fdp -o person.glb",
        "fba model photos front.jpg side.jpg -o me.glb --edit me.points.json",
        "fba model learn-fit talk.fba -o ada.glb",
        "fba model simplify head.glb -o small.glb --ratio 0.1",
    ),
)
def command() -> None:
    """Inspect face models, check them, import, fit and simplify them."""


command.add_command(model_learn_fit.command)
command.add_command(model_photos.command)
command.add_command(model_simplify.command)


def _read_or_default(file: Path | None, default: bool) -> FaceModel:
    from fba.face import FaceModel

    if (file is None) != default:
        raise click.UsageError("give either the FILE of a face model, or --default for the built-in head")
    return read_model(file) or FaceModel.default()


@command.command(
    short_help="Show what a face model contains.",
    epilog=examples("fba model info --default", "fba model info --json head.glb"),
)
@click.argument("file", metavar="[FILE]", required=False, type=SOURCE)
@with_options
def info(file: Path | None, default: bool = DEFAULT_OPTION, as_json: bool = options.json_option) -> None:
    """Show what a face model contains: parts, units, feature points and FAPs.

    FILE is a face model (.glb), or any file that `fba model import` reads.
    """
    from fba.cli import model_text

    model = _read_or_default(file, default)
    if as_json:
        print_json(model_text.model_as_json(model))
    else:
        model_text.print_model(model)


@command.command(
    short_help="Check a face model against the standard.",
    epilog=examples("fba model validate head.glb", "fba model validate --json --default"),
)
@click.argument("file", metavar="[FILE]", required=False, type=SOURCE)
@with_options
def validate(
    file: Path | None,
    default: bool = DEFAULT_OPTION,
    only: Literal["neutral", "faps"] | None = option(help="Check only the rest position, or only the FAPs."),
    as_json: bool = options.json_option,
) -> None:
    """Check a face model against the standard: its neutral face, and the effect of every FAP.

    Every finding gives the measured and the expected value. Errors are faults with which streams play
    wrongly, and the exit code is then 1; warnings concern the looks, or what could not be checked.
    """
    from fba.cli import model_text
    from fba.face import checks

    model = _read_or_default(file, default)
    findings: list[Finding] = []
    if only != "faps":
        findings += checks.check_neutral(model)
    if only != "neutral":
        findings += checks.check_faps(model)
    errors = sum(finding.severity == "error" for finding in findings)
    if as_json:
        print_json(model_text.findings_as_json(findings))
    else:
        model_text.print_findings(str(file or "built-in head"), findings)
    if errors:
        raise click.exceptions.Exit(1)


@command.command(
    "import",
    short_help="Make a face model from a mesh.",
    epilog=examples(
        "fba model import makehuman/base.obj -o head.glb",
        "fba model import avatar.glb -o head.glb --sheet head.png",
        "fba model import scan.ply --points scan.points.csv --unit 0.001 -o scan.glb",
        "fba model import face.obj --points face.fdp --part eyeL=eye --part cap=none -o face.glb",
    ),
)
@click.argument("source", metavar="IN", type=SOURCE)
@with_options
def import_(
    source: Path,
    target: _Target,
    mesh: _Mesh,
    unit: float | None = option(
        metavar="METRES",
        help="Metres per unit of IN. Default: estimated from the distance between the pupils.",
    ),
    name: str | None = option(help="Name of the model. Default: the name of the file."),
    wrinkles: bool = option(
        default=False,
        help="Let players draw wrinkles on the skin as it moves. For lifelike heads, not for drawn ones.",
    ),
) -> None:
    """Turn a mesh into a face model that plays FAPs, and write it as glTF.

    Reads MakeHuman's base mesh (its folder, or base.obj), heads with ARKit's shapes as glTF or as a folder
    of OBJ files (neutral.obj, jawOpen.obj, ...), OBJ, PLY and Candide meshes with feature points, and FDP
    files with their mesh. FAPs that the mesh cannot show are listed with the reasons, and the errors that
    `fba model validate` finds, with a verdict: good without errors, fair with up to ten, else poor, in one
    red line. The exit status is 0 in all cases: `fba model validate` exits with 1 where there are errors.
    Look at the --sheet.
    """
    from fba.cli import model_text
    from fba.face import checks
    from fba.face.importers import import_model

    output, sheet = target.output, target.sheet
    outputs = _outputs(output, [source, mesh.points], no_clobber=target.no_clobber, sheet=sheet)
    given = mesh.options() | {"unit": unit, "name": name}
    with Progress("importing", None):
        model = replace(import_model(source, **given), wrinkles=wrinkles)
    with Progress("checking", None):
        findings = [*checks.check_neutral(model), *checks.check_faps(model)]
    _write(model, output, outputs)
    if sheet is not None:
        with Progress("rendering", None), outputs.file(sheet) as file:
            _draw_sheet(model, file)
        outputs.say(f"{display_name(sheet)}: the face at rest and in its main motions")
    if not wrinkles:
        outputs.say("  wrinkles none; --wrinkles lets players draw them on a lifelike skin")
    for line in model_text.error_lines(findings):
        outputs.say(f"  {line}")
    verdict, reason = model_text.judge_import(findings)
    if verdict == "poor":
        click.echo(colour_grade(f"fba: poor: {display_name(output)}: {reason}", verdict), err=True)
    else:
        outputs.say(f"{verdict}: {reason}")


@command.command(
    "points",
    short_help="Place feature points by hand.",
    epilog=examples(
        "fba model points scan.obj -o scan.points.csv",
        "fba model points scan.obj --points scan.points.csv -o scan.points.csv",
        "fba model points avatar.glb -o avatar.points.csv",
    ),
)
@click.argument("head", metavar="HEAD", type=options.FILE)
@with_options
def points_(
    head: Path,
    output: Path = output_option("POINTS.csv", "File of points to write.", required=True),
    no_clobber: bool = options.no_clobber_option,
    mesh: _Mesh = group(
        points=options.model_option(
            f"{POINT_FILES} to begin from. Default: a file beside HEAD with the same name, else the points "
            "that `fba model import` finds.",
            "--points",
        )
    ),
    size: tuple[int, int] = options.size_option(default=(1280, 800), typed="1280x800", show_default=True),
) -> None:  # fmt: skip
    """Open a window in which you place the feature points of a head, for `fba model import --points`.

    HEAD is a mesh that lacks shapes, or whose points are not found: OBJ, PLY, Candide or glTF. The list
    begins with the points that are not known, those that every face needs first. Click on the head to place
    the current one, M mirrors it to the other side, Ctrl+S saves; the window lists all keys. Each point is
    put on the nearest vertex of the mesh. If nothing is saved, the exit code is 1.
    """
    from fba_player.window.pages import check_page, place_points

    outputs = _points_outputs(output, head, no_clobber=no_clobber)
    check_page("points")
    from fba.face.importers.head_surface import read_head_surface

    with Progress("reading", None):
        surface = read_head_surface(head, **mesh.options())
    placement = place_points(surface, output, size=size)
    if not placement.written:
        outputs.say(f"{output}: not written, as the window was closed without saving")
        raise click.exceptions.Exit(1)
    outputs.say(f"{output}: {len(placement.places)} feature points placed, {len(placement.missing)} not")
    if placement.missing_units:
        outputs.say(f"  no face can be made without {', '.join(placement.missing_units)}")
    else:
        outputs.say(f"  next: {mesh.import_command(head, output)}")


def _points_outputs(output: Path, head: Path, *, no_clobber: bool) -> Outputs:
    """Return the output of points; click.UsageError for a name that is not read as CSV."""
    if output == STANDARD:
        raise click.UsageError("--output -: points are saved from the window; give the name of a file")
    if output.suffix.lower() in (".json", ".fdp", ".xml", ".obj", ".ply", ".wfm", ".glb", ".gltf"):
        raise click.UsageError(
            f"--output {output}: points are written as CSV; name it {output.with_suffix('.csv').name}"
        )
    return Outputs([Output("--output", output)], [head], no_clobber=no_clobber)


def _draw_sheet(model: FaceModel, file: Path) -> None:
    """Write a picture of a face in its main motions."""
    from fba_player.export.contact_sheet import contact_sheet
    from fba_player.export.image_files import write_picture

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)  # what the face lacks is in its findings
        pixels = contact_sheet("review", model)
    write_picture(file, pixels)


@command.command(
    short_help="Fit a face to a person.",
    epilog=examples(
        "fba model fit person.fdp -o person.glb",
        "fba model fit points.csv --unit cm --model head.glb --name Ada -o ada.glb",
    ),
)
@click.argument("points", metavar="POINTS", type=options.FILE)
@with_options
def fit(
    points: Path,
    output: Path = OUTPUT_OPTION,
    no_clobber: bool = options.no_clobber_option,
    base: Path | None = options.model_option("Face model to fit. Default: the built-in head.", "--model"),
    unit: str | None = option(
        metavar="mm|cm|m|in", help="Unit of POINTS, or metres for one unit. Default: estimated from the size."
    ),
    tables: Adaptation = option(
        default="auto",
        help="How the motions of FAPs are adapted: carried over with the surface, computed again from the "
        "mesh, or whichever meets the standard better.",
    ),
    name: str | None = option(help="Name of the fitted model. Default: the name of the file."),
) -> None:
    """Fit a face to a person's feature points, and write it as glTF.

    POINTS is an FDP, CSV or JSON file in any unit and pose. Missing points are mirrored from the other side,
    or follow the points around them. Of an Xface file without its mesh, the distances are used.
    """
    from fba.face import FaceModel
    from fba.face.calibration import fit as fitted

    outputs = _outputs(output, [points, base], no_clobber=no_clobber)
    scale = _parse_unit(unit)
    with Progress("fitting", None):
        model = read_model(base) or FaceModel.default()
        wanted = _read_points(points, model)
        face = fitted(model, wanted, unit=scale, tables=tables, name=name or points.stem)
    _write(face, output, outputs)


def _read_points(path: Path, model: FaceModel) -> Float64:
    """Return feature points of a file; for an Xface file without its mesh, those that its distances imply."""
    from fba.face.importers.points.fdp import read_fdp, xface_points
    from fba.face.importers.points.points_file import read_points
    from fba.text_files import find_beside

    if path.suffix.lower() in (".json", ".csv"):
        return read_points(path).points
    fdp = read_fdp(path)
    if fdp.format != "xface":
        return fdp.points
    meshes = sorted({mesh.rpartition("_")[0] for mesh, _ in fdp.vertices.values()})
    absent = [name for name in meshes if find_beside(path, name) is None]
    if not (absent and fdp.distances):
        return xface_points(fdp)
    from fba.face.calibration import points_of_distances

    warn(
        f"{path}: the mesh {', '.join(absent)} is not in the same folder, so positions of feature points are "
        f"unknown; only the distances {', '.join(fdp.distances)} are used",
        stacklevel=2,
    )
    return points_of_distances(model, fdp.distances)


def _parse_unit(text: str | None) -> str | float | None:
    from fba.face.calibration import UNITS

    if text is None or text in UNITS:
        return text
    try:
        return float(text)
    except ValueError:
        raise click.UsageError(
            f"--unit {text}: write one of {', '.join(UNITS)}, or metres for one unit, as in 0.01"
        ) from None


def _outputs(
    output: Path, inputs: list[Path | None], *, no_clobber: bool, sheet: Path | None = None
) -> Outputs:
    """Return the outputs; click.UsageError also for suffixes other than .glb, and those of pictures."""
    written = [Output("--output", output)]
    if sheet is not None:
        if sheet.suffix.lower() not in (".png", ".jpg", ".jpeg"):
            raise click.UsageError(f"--sheet {sheet}: a sheet is a picture, .png or .jpg")
        written.append(Output("--sheet", sheet))
    outputs = Outputs(written, inputs, no_clobber=no_clobber)
    check_glb(output)
    return outputs


def _write(model: FaceModel, output: Path, outputs: Outputs) -> None:
    from fba.cli import model_text

    with outputs.file(output) as file:
        model.save(file)
    outputs.say(f"{display_name(output)}: {model_text.summary(model)}")
    for line in model_text.lost_lines(model):
        outputs.say(f"  {line}")
