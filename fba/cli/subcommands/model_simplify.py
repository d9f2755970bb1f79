"""`fba model simplify`: a face with fewer triangles, or with levels of detail."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli import options
from fba.cli.coding.tolerance_options import LENGTH
from fba.cli.command import Command, examples
from fba.cli.inputs import read_body, read_model
from fba.cli.option_fields import option, with_options
from fba.cli.outputs import Output, Outputs, check_glb, display_name, output_option
from fba.cli.printing import Progress
from fba.errors import warn

if TYPE_CHECKING:
    from fba.face import FaceModel

MAX_LEVELS = 16


@dataclass(frozen=True, kw_only=True)
class _Goal:
    """How far to simplify: exactly one of these."""

    faces: int | None = option(type=click.IntRange(min=1), metavar="N", help="Triangles to keep.")
    ratio: float | None = option(
        type=options.FloatRange(0, 1, min_open=True),
        metavar="R",
        help="Share of the triangles to keep, 0..1.",
    )
    error: float | None = option(
        type=LENGTH,
        metavar="0.5mm",
        help="Keep as few triangles as leave 99 % of the vertices this near, at rest and in motion.",
    )
    levels: int | None = option(
        type=click.IntRange(1, MAX_LEVELS),
        metavar="N",
        help="Keep all triangles, and store up to N coarser levels beside them, each with 0.32 of the "
        "triangles of the one before; `fba play` and `fba render` draw them where the face is small.",
    )

    def check(self) -> None:
        """Raise click.UsageError for no goal, and for two."""
        given = [f"--{name}" for name, value in vars(self).items() if value is not None]
        if len(given) != 1:
            raise click.UsageError(
                f"{' and '.join(given)} contradict each other: give one of them"
                if given
                else "how far to simplify is missing: give --faces, --ratio, --error or --levels"
            )


@click.command(
    "simplify",
    cls=Command,
    short_help="Reduce the triangles of a face that keeps moving.",
    epilog=examples(
        "fba model simplify head.glb -o small.glb --ratio 0.1",
        "fba model simplify head.glb -o small.glb --error 0.5mm",
        "fba model simplify head.glb -o levels.glb --levels 4",
        "fba model simplify person.glb --body -o small.glb --ratio 0.25",
    ),
)
@click.argument("head", metavar="[MODEL]", required=False, type=options.EXISTING)
@with_options
def command(
    head: Path | None,
    goal: _Goal,
    default: bool = option(default=False, help="Use the built-in head, or body, instead of MODEL."),
    body: bool = option(
        default=False, help="MODEL is a body; --faces or --ratio simplifies it with its skin weights."
    ),
    output: Path = output_option("OUT.glb", "Model to write; - for standard output.", required=True),
    no_clobber: bool = options.no_clobber_option,
    as_json: bool = options.json_option,
) -> None:
    """Reduce the triangles of a model so that FAPs still move it, or store levels of detail with it.

    Lips, lids and what else moves keep more triangles than the rest; feature points stay where they are.
    Parts, seams, textures, colours, normals and the tables of the FAPs are carried along. The errors are
    distances within which 99 % of the vertices of MODEL are of the result, in the worst of five poses.
    """
    goal.check()
    if (head is None) != default:
        raise click.UsageError("give either the MODEL to simplify, or --default for the built-in one")
    if body and goal.faces is None and goal.ratio is None:
        raise click.UsageError("--body goes with --faces or --ratio: bodies have no errors and no levels")
    outputs = Outputs([Output("--output", output)], [head], no_clobber=no_clobber)
    check_glb(output)
    if body:
        _simplify_body(head, goal, output, outputs, as_json=as_json)
        return
    from fba.face import FaceModel

    model = read_model(head) or FaceModel.default()
    with Progress("simplifying", None):
        result, rows = _simplified(model, goal)
    with Progress("checking", None):
        before = _count_errors(model)
        for row, face in zip(rows, [level.model for level in result.levels] or [result], strict=True):
            row["findings"] = _count_errors(face)
    with outputs.file(output) as file:
        result.save(file)
    if as_json:
        report = {"output": str(output), "faces": len(model.triangles), "findings": before, "levels": rows}
        outputs.print_json(report)
        return
    had = f" and {before} errors" if before else ""
    outputs.say(
        f"{display_name(output)}: {model.name or 'a face'}, {len(model.triangles)} triangles{had} before"
    )
    for row in rows:
        outputs.say(
            f"  {row['faces']:6} triangles, {row['vertices']:6} vertices, within {row['error_mm']:.2f} mm; "
            f"{row['findings']} errors by fba model validate"
        )


def _count_errors(face: FaceModel) -> int:
    from fba.face import checks

    findings = [*checks.check_neutral(face), *checks.check_faps(face)]
    return sum(finding.severity == "error" for finding in findings)


def _warn_of_more(wanted: int, left: int) -> None:
    if left > wanted:
        warn(
            f"asked for {wanted} triangles, but no edge is left that may collapse; edges of three triangles "
            "or more, and feature points, stay",
            stacklevel=2,
        )


def _simplify_body(path: Path | None, goal: _Goal, output: Path, outputs: Outputs, *, as_json: bool) -> None:
    from fba.body import BodyModel
    from fba.body.simplification import simplify_body

    model = read_body(path) or BodyModel.default()
    wanted = goal.faces or max(round(len(model.triangles) * (goal.ratio or 0.0)), 1)
    with Progress("simplifying", None):
        made = simplify_body(model, wanted)
    _warn_of_more(wanted, len(made.triangles))
    with outputs.file(output) as file:
        made.save(file)
    before, left = len(model.triangles), len(made.triangles)
    if as_json:
        row = {"faces": left, "vertices": len(made.vertices)}
        outputs.print_json({"output": str(output), "faces": before, "levels": [row]})
        return
    outputs.say(f"{display_name(output)}: {model.name or 'a body'}, {before} triangles before")
    outputs.say(f"  {left:6} triangles, {len(made.vertices):6} vertices")


def _simplified(model: FaceModel, goal: _Goal) -> tuple[FaceModel, list[dict[str, Any]]]:
    """Return the result, and what is printed of each level of it."""
    from dataclasses import replace

    from fba.face.simplification import level_sizes, simplify_face

    total = len(model.triangles)
    if goal.levels is not None:
        wanted = level_sizes(model, goal.levels)
    else:
        wanted = [goal.faces or max(round(total * (goal.ratio or 0.0)), len(model.parts))]
    made = simplify_face(model, wanted)
    meshes = [made.within(goal.error)] if goal.error is not None else [made.mesh.level(n) for n in wanted]
    meshes = [
        mesh for n, mesh in enumerate(meshes) if not n or len(mesh.triangles) < len(meshes[n - 1].triangles)
    ]
    if goal.error is None:
        _warn_of_more(wanted[0], len(meshes[0].triangles))
    rows = [
        {"faces": len(mesh.triangles), "vertices": len(mesh.positions), "error_mm": 1000 * made.error(mesh)}
        for mesh in meshes
    ]
    levels = [made.build(mesh) for mesh in meshes]
    return replace(model, levels=tuple(levels)) if goal.levels is not None else levels[0].model, rows
