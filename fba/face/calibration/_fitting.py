"""FDP calibration: fits a face model to a person's feature points."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from operator import itemgetter
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float64, Intp
from fba.errors import FbaWarning, ModelError
from fba.face.calibration._align import Alignment, align, centre_on_pupils, known_rows
from fba.face.calibration._complete import centre_pupils, drop_mistakes, mirror_missing, shut_mouth
from fba.face.calibration._field import (
    KERNELS,
    deformation,
    folded_vertices,
    nearest_points,
    turned_over_triangles,
)
from fba.face.calibration._shape import INNER, Shape, deform, rebuild_part
from fba.face.fapu import PER_DISTANCE
from fba.face.feature_points import names, row_of
from fba.face.model import FaceModel, Part
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP

if TYPE_CHECKING:
    from fba.face.checks.posing import Poser
    from fba.face.tables import FaceDefTables


TURNED_OVER = 0.002
"""Share of the surface that may turn over, in wrinkles, before the deformation is refused as folded."""
FAPU_DISTANCES = ("ES0", "ENS0", "MNS0", "MW0", "IRISD0")
"""The distances of a face that the FAPU are fractions of."""


def fit(
    model: FaceModel,
    points: npt.ArrayLike,
    *,
    unit: str | float | None = None,
    tables: Literal["auto", "carry", "author"] = "auto",
    name: str | None = None,
) -> FaceModel:
    """The model in the shape of a person: deformed smoothly through the person's feature points.

    points: float (84, 3), rows as `feature_point_names()`, NaN where unknown, in any unit and pose; unit
    names it ("mm", "cm", "m", "in", or metres for one unit), None finds it. Points of a side that is
    missing are mirrored from the other. Eyeballs stay spheres and teeth rigid; lips and teeth meet, as in
    every neutral face. The person keeps size and axes where unit and axes are a file's usual ones; the
    middle between the pupils stays where the model has it.

    tables: how FaceDefTables are made: "carry" bends the model's with the surface, "author" makes new ones,
    "auto" carries them and, if these break more of the standard's rules than the model did, also makes new
    ones and keeps the better ones of each FAP.
    name: of the fitted model, by default the model's own.

    Warns with FbaWarning about left and right swapped, misplaced points that were left out, an open mouth.
    Raises ModelError, naming the points, where these are too few, coincide, give no FAPU, or would make
    the skin fold.
    """
    if tables not in ("auto", "carry", "author"):
        raise ValueError(f"tables must be 'auto', 'carry' or 'author', not {tables!r}")
    given = _check_points(points)
    aligned = align(given, model.points, unit=unit)
    if aligned.mirrored:
        warnings.warn(
            "the feature points are those of a mirrored face: +x must be the subject's left; "
            "left and right were swapped",
            FbaWarning,
            stacklevel=2,
        )
    plausible = drop_mistakes(_swap_to_own_sides(aligned.points), aligned.expected)
    full, added = mirror_missing(plausible)
    full, unsure = centre_pupils(shut_mouth(full, aligned.expected))
    targets = centre_on_pupils(full, model.points)
    targets[np.isnan(model.points).any(axis=1)] = np.nan
    known = known_rows(targets)
    size = _size(model.points[known], targets[known])
    iris = _iris_diameters(model, targets, size)
    sure = known & ~np.isin(names(), unsure)
    shape = _deform_without_folds(model, targets, known, sure, size, iris)
    parts = tuple(rebuild_part(part, shape.vertices[part.name]) for part in model.parts)
    _check_folds(model, parts, targets, known)
    fitted = replace(
        model,
        parts=parts,
        points=shape.points,
        tables=(),
        name=model.name if name is None else name,
        notes={**model.notes, "fitted": _fit_note(aligned, known, added)},
    )
    return _with_tables(model, fitted, shape, tables)


def points_of_distances(model: FaceModel, distances: Mapping[str, float]) -> Float64:
    """Feature points (84, 3) of a face of which only the distances behind the FAPU are known.

    distances: any of `FAPU_DISTANCES` in any unit, as Xface files give them; ES0 is required, as it sets
    the size. NaN for points that no distance moves. Raises ModelError for a distance that is
    unknown or not positive.
    """
    for key, value in distances.items():
        if key not in FAPU_DISTANCES or not (np.isfinite(value) and value > 0):
            raise ModelError(
                f"{key} {value:g} is no distance of a face ({', '.join(FAPU_DISTANCES)}, above 0)"
            )
    if "ES0" not in distances:
        raise ModelError("ES0, the distance between the pupils, is needed to tell the size of the face")
    own = {key: model.fapu[key[:-1]] * PER_DISTANCE for key in FAPU_DISTANCES}
    size = distances["ES0"] / own["ES0"]
    wanted = {key: distances.get(key, own[key] * size) for key in FAPU_DISTANCES}
    row = row_of()
    scaled = model.points * size
    points = np.full_like(scaled, np.nan)
    eyes = ["3.5", "3.6", "3.1", "3.2", "3.3", "3.4"]
    nose, mouth = ["9.15", "9.4", "9.5"], ["2.2", "2.3", "2.4", "2.5", "8.3", "8.4", "8.1", "8.2"]
    for name in (*eyes, *nose, *mouth):
        points[row[name]] = scaled[row[name]]
    lids = (wanted["IRISD0"] - own["IRISD0"] * size) / 2
    points[[row["3.1"], row["3.2"]], 1] += lids
    points[[row["3.3"], row["3.4"]], 1] -= lids
    down = wanted["ENS0"] - own["ENS0"] * size
    points[[row[name] for name in nose], 1] -= down
    points[[row[name] for name in mouth], 1] -= down + wanted["MNS0"] - own["MNS0"] * size
    across = [row[name] for name in mouth]
    middle = (scaled[row["8.3"], 0] + scaled[row["8.4"], 0]) / 2
    points[across, 0] = middle + (points[across, 0] - middle) * wanted["MW0"] / (own["MW0"] * size)
    return points


def _check_points(points: npt.ArrayLike) -> Float64:
    given = np.array(points, dtype=np.float64)
    if given.shape != (len(names()), 3):
        raise ModelError(f"feature points must have shape ({len(names())}, 3), not {given.shape}")
    half = np.isnan(given).any(axis=1) & ~np.isnan(given).all(axis=1)
    wild = np.isinf(given).any(axis=1) | (np.abs(np.nan_to_num(given)) > 1e9).any(axis=1)
    if (half | wild).any():
        row = int(np.flatnonzero(half | wild)[0])
        raise ModelError(f"feature point {names()[row]} at {given[row].tolist()} has no usable position")
    return given


def _swap_to_own_sides(points: Float64) -> Float64:
    from fba.face.importers.points.fdp_data import repair_sides

    right, swaps, wrong = repair_sides(points)
    changed = [f"{a} and {b} have changed places" for a, b in swaps]
    changed += [f"{one} is on the other side" for one in wrong]
    if changed:
        warnings.warn(f"put right: {'; '.join(changed)}", FbaWarning, stacklevel=3)
    return right


def _size(here: Float64, there: Float64) -> float:
    """The person's size relative to the model: the median over all pairs of points, so no outlier counts."""
    from scipy.spatial.distance import pdist

    before, after = pdist(here), pdist(there)
    apart = before > 0.25 * before.max()
    return float(np.median(after[apart] / before[apart]))


def _iris_diameters(model: FaceModel, targets: Float64, size: float) -> tuple[float, float]:
    """(before, after) diameter of the iris, metres: the height of the lid opening of a neutral face."""
    row = row_of()
    before = model.fapu.IRISD * PER_DISTANCE
    heights = [
        float(targets[row[upper], 1] - targets[row[lower], 1])
        for upper, lower in (("3.1", "3.3"), ("3.2", "3.4"))
    ]
    known = [height for height in heights if np.isfinite(height)]
    if known and min(known) <= 0:
        raise ModelError(
            "the upper lid (3.1, 3.2) must be above the lower one (3.3, 3.4); "
            f"the lids are {', '.join(f'{height * 1000:.1f} mm' for height in heights)} open"
        )
    return before, float(np.mean(known)) if known else before * size


def _deform_without_folds(
    model: FaceModel, targets: Float64, known: Bool, sure: Bool, size: float, iris: tuple[float, float]
) -> Shape:
    """The parts under the smoothest deformation that does not fold.

    Raises ModelError, naming the points, where every kernel folds.
    """
    outer = known & np.array([name not in INNER for name in names()])
    pupils = [row_of()["3.5"], row_of()["3.6"]]
    if outer.sum() < 4:
        outer[pupils] = known[pupils]
    rows = np.flatnonzero(outer)
    sources, places = model.points[rows], targets[rows]
    mesh = np.concatenate(
        [part.vertices for part in model.parts if part.kind in ("skin", "mouth")] or [model.vertices]
    )
    worst: Intp = np.zeros(0, dtype=np.intp)
    for kernel in KERNELS:
        field = deformation(sources, places, mesh, kernel, size)
        worst = folded_vertices(field, mesh, size)
        if not len(worst):
            return deform(model, field, targets, sure, iris)
    near = nearest_points(mesh[worst].astype(np.float64), sources, rows)
    raise ModelError(
        f"the face would fold: {len(worst)} of {len(mesh)} vertices of the skin turn inside out around "
        f"feature points {', '.join(near)}; are these where they should be?"
    )


def _check_folds(model: FaceModel, parts: tuple[Part, ...], targets: Float64, known: Bool) -> None:
    """Raise ModelError where too many triangles of the finished skin have turned over."""
    for old, new in zip(model.parts, parts, strict=True):
        if old.kind not in ("skin", "mouth") or not len(old.triangles):
            continue
        wrong, share = turned_over_triangles(old.vertices, new.vertices.astype(np.float64), old.triangles)
        if share > TURNED_OVER:
            rows = np.flatnonzero(known)
            where = new.vertices[new.triangles[wrong]].mean(axis=1).astype(np.float64)
            raise ModelError(
                f"part {old.name!r} would fold: {len(wrong)} of {len(old.triangles)} triangles turn over "
                f"around feature points {', '.join(nearest_points(where, targets[rows], rows))}; "
                "are these where they should be?"
            )


def _with_tables(model: FaceModel, fitted: FaceModel, shape: Shape, how: str) -> FaceModel:
    from fba.face.calibration._carry import carry_tables
    from fba.face.checks.posing import Poser

    if not model.tables:
        return fitted
    if how == "author":
        return _author_anew(model, fitted)
    carried = replace(fitted, tables=carry_tables(model, fitted.parts, fitted.points, fitted.fapu, shape))
    if how == "carry":
        return carried
    bent = Poser(carried)
    broken = _count_errors(bent)
    if broken <= _count_errors(Poser(model)):
        return carried
    new = Poser(_author_anew(model, fitted), like=bent)
    best = Poser(_best_tables(new, bent), like=new)
    return min(
        (new.model, _count_errors(new)),
        (best.model, _count_errors(best)),
        (carried, broken),
        key=itemgetter(1),
    )[0]


def _best_tables(first: Poser, second: Poser) -> FaceModel:
    """The first model with the second's tables for every FAP where these break fewer rules."""
    chosen = {table.fap: table for table in first.model.tables}
    for table in second.model.tables:
        number = table.fap
        if number not in chosen or _count_errors(second, number) < _count_errors(first, number):
            chosen[number] = table
    lost = {number: why for number, why in first.model.lost.items() if number not in chosen}
    return first.model.with_tables(tuple(chosen.values()), lost)


def _author_anew(model: FaceModel, fitted: FaceModel) -> FaceModel:
    from fba.face.authoring import author

    made = author(
        fitted.parts,
        fitted.points,
        bound=fitted.bound,
        name=fitted.name,
        definitions=model.definitions,
        fit=model.fit,
        notes=fitted.notes,
    )
    tables: tuple[FaceDefTables, ...] = tuple(one for one in made.tables if one.fap not in model.lost)
    return made.with_tables(tables, {**made.lost, **model.lost})


def _count_errors(poser: Poser, fap: int | None = None) -> int:
    from fba.face.checks.fap_checks import check_posed

    findings = check_posed(poser, range(FIRST_LOW_LEVEL_FAP, FAP_COUNT + 1) if fap is None else [fap])
    return sum(finding.severity == "error" for finding in findings)


def _fit_note(aligned: Alignment, known: Bool, added: tuple[str, ...]) -> str:
    text = f"to {int(known.sum())} feature points of a person"
    if aligned.unit:
        text += f" in {aligned.unit}"
    else:
        text += f" without a unit of length (1 = {aligned.scale * 1000:.3g} mm by the size of the face)"
    turned = float(np.degrees(aligned.angle))
    text += f", turned by {turned:.0f} degrees" if turned > 30 else ""
    text += ", mirrored" if aligned.mirrored else ""
    text += ", without depth" if aligned.flat else ""
    return text + (f"; {', '.join(added)} taken from the other side" if added else "")
