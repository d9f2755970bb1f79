"""Makes the levels of detail of the built-in head: `fba/face/builtin/levels.glb`.

    python -m tools.figure.make_levels

To be run after each change of `head.glb` (`make_head.py` does): levels of another shape are not used. The
levels have no tables: players move them as the head moves at the places of their vertices.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from fba.face import FaceModel, Material, Part
from fba.face.simplification import level_sizes, simplify_face

BUILTIN = Path(__file__).parents[2] / "fba" / "face" / "builtin"
COUNT = 2
"""Levels; a third would save little and let the neck show through the shirt."""


def make_levels() -> FaceModel:
    """Return the levels of the head, on a face that has nothing but its shape."""
    head = replace(FaceModel.load(BUILTIN / "head.glb"), levels=())
    sizes = level_sizes(head, COUNT)
    made = simplify_face(head, sizes)
    levels = tuple(made.build(made.mesh.level(size), tables=False) for size in sizes)
    parts = tuple(Part(part.name, part.kind, part.vertices, part.triangles) for part in head.parts)
    plain = tuple(
        replace(
            level,
            model=replace(
                level.model,
                fit=None,
                lost={},
                notes={},
                parts=tuple(replace(part, material=Material()) for part in level.model.parts),
            ),
        )
        for level in levels
    )
    shape = replace(head, parts=parts, tables=(), fit=None, lost={}, levels=())
    return replace(shape, levels=plain)


def main() -> None:
    """Write the file and say what is in it."""
    made = make_levels()
    made.save(BUILTIN / "levels.glb")
    for level in made.levels:
        print(f"{len(level.model.triangles):6} triangles, off by {1000 * level.error:.2f} mm (RMS)")


if __name__ == "__main__":
    main()
