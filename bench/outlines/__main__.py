"""`python -m bench.outlines`: tables of how well outlines are found again."""

from __future__ import annotations

from pathlib import Path

import click


def _say(text: str) -> None:
    click.echo(text, err=True)


@click.group(help=__doc__)
def main() -> None: ...


@main.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
def kimia(folder: Path) -> None:
    """Silhouettes of a folder, trainimageC_K.png: the class of the nearest other one."""
    from bench.outlines import retrieval

    click.echo("\n".join(retrieval.kimia(folder, _say)))


@main.command()
@click.option("--method", "names", multiple=True, help="points, tree-l1, tree-l2, histogram; default: all.")
@click.option("--around", is_flag=True, help="All sides at one height, in steps of 2 degrees.")
def objects(names: tuple[str, ...], around: bool) -> None:
    """Nine objects from 180 sides: the object and the side of the nearest other silhouette."""
    from bench.outlines import retrieval

    for line in retrieval.objects(_say, names, around=around):
        click.echo(line)


@main.command()
@click.argument("files", nargs=-1, type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--every", default=8, help="Step between the frames in the index.")
@click.option("--of", "other", type=click.Path(exists=True, dir_okay=False, path_type=Path))
def poses(files: tuple[Path, ...], every: int, other: Path | None) -> None:
    """How far limbs are off in the poses that outlines give, with and without a prior of time.

    FILES are performances in the index, by default the sample recording; pictures show frames between those,
    or those of another performance, --of.
    """
    from bench.outlines import angles

    click.echo("\n".join(angles.table(files, every, _say, other)))


if __name__ == "__main__":
    main()
