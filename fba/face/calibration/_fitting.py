"""FDP calibration: fits a face model to a person's feature points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from operator import itemgetter
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float64, Intp
from fba.errors import ModelError, warn
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
from fba.face.feature_points import names
from fba.face.model import FaceModel, Part
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, point_rows

if TYPE_CHECKING:
    from fba.face.checks._posing import Poser


TURNED_OVER = 0.002
"""Share of the surface that may turn over, as in wrinkles, before the deformation is refused."""
FAPU_DISTANCES = ("ES0", "ENS0", "MNS0", "MW0", "IRISD0")
"""The distances of a face of which the FAPU are fractions."""


def fit(
    model: FaceModel,
    points: npt.ArrayLike,
    *,
    unit: str | float | None = None,
    tables: Literal["auto", "carry", "author"] = "auto",
    name: str | None = None,
) -> FaceModel:
    """Return the model deformed smoothly into the shape of a person, through the person's feature points.

    points: float (84, 3), rows as `feature_point_names()`, NaN where unknown, in any unit and pose. unit:
    "mm", "cm", "m", "in", or metres for one unit; None finds it. Points that one side lacks are mirrored
    from the other. Eyeballs stay spheres and teeth rigid; lips and teeth meet, as in every neutral face. The
    person keeps its size in a usual unit, and its axes if they are nearly the model's; the midpoint of the
    pupils stays that of the model.

    tables: how FaceDefTables are made. "carry" bends the model's with the surface; "author" makes new ones;
    "auto" carries them and, if these break more of the standard's rules than the model's do, also makes new
    ones and takes the better ones for each FAP.
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
        warn(
            "the feature points are those of a mirrored face: +x must be the subject's left; "
            "left and right were swapped",
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
    """Return the feature points (84, 3) of a face of which only the distances of the FAPU are known.

    distances: any of `FAPU_DISTANCES` in any unit, as in Xface files; ES0 is required, as it sets the size.
    Points that no distance concerns are NaN. Raises ModelError for a distance that is unknown or not
    positive.
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
    row = point_rows()
    scaled = model.points * size
    points = np.full_like(scaled, np.nan)
    eyes = [row[name] for name in ("3.5", "3.6", "3.1", "3.2", "3.3", "3.4")]
    nose = [row[name] for name in ("9.15", "9.4", "9.5")]
    mouth = [row[name] for name in ("2.2", "2.3", "2.4", "2.5", "8.3", "8.4", "8.1", "8.2")]
    points[eyes + nose + mouth] = scaled[eyes + nose + mouth]
    lids = (wanted["IRISD0"] - own["IRISD0"] * size) / 2
    points[[row["3.1"], row["3.2"]], 1] += lids
    points[[row["3.3"], row["3.4"]], 1] -= lids
    down = wanted["ENS0"] - own["ENS0"] * size
    points[nose, 1] -= down
    points[mouth, 1] -= down + wanted["MNS0"] - own["MNS0"] * size
    middle = (scaled[row["8.3"], 0] + scaled[row["8.4"], 0]) / 2
    points[mouth, 0] = middle + (points[mouth, 0] - middle) * wanted["MW0"] / (own["MW0"] * size)
    return points


def _check_points(points: npt.ArrayLike) -> Float64:
    given = np.array(points, dtype=np.float64)
    if given.shape != (len(names()), 3):
        raise ModelError(f"feature points must have shape ({len(names())}, 3), not {given.shape}")
    partial = np.isnan(given).any(axis=1) & ~np.isnan(given).all(axis=1)
    too_large = np.isinf(given).any(axis=1) | (np.abs(np.nan_to_num(given)) > 1e9).any(axis=1)
    if (partial | too_large).any():
        row = int(np.flatnonzero(partial | too_large)[0])
        raise ModelError(f"feature point {names()[row]} at {given[row].tolist()} has no usable position")
    return given


def _swap_to_own_sides(points: Float64) -> Float64:
    from fba.face.importers.points.fdp import repair_sides

    repaired, swaps, wrong = repair_sides(points)
    changes = [f"{a} and {b} have changed places" for a, b in swaps]
    changes += [f"{name} is on the other side" for name in wrong]
    if changes:
        warn(f"corrected: {'; '.join(changes)}", stacklevel=3)
    return repaired


def _size(here: Float64, there: Float64) -> float:
    """Return the person's size relative to the model: the median over all pairs of points."""
    from scipy.spatial.distance import pdist

    before, after = pdist(here), pdist(there)
    apart = before > 0.25 * before.max()
    return float(np.median(after[apart] / before[apart]))


def _iris_diameters(model: FaceModel, targets: Float64, size: float) -> tuple[float, float]:
    """Return (before, after) diameter of the iris, metres: the height of a neutral face's lid opening."""
    row = point_rows()
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
    """Return the shape by the smoothest deformation without folds. ModelError where every kernel folds."""
    outer = known & np.array([name not in INNER for name in names()])
    pupils = [point_rows()["3.5"], point_rows()["3.6"]]
    if outer.sum() < 4:
        outer[pupils] = known[pupils]
    rows = np.flatnonzero(outer)
    sources = model.points[rows]
    mesh = np.concatenate(
        [part.vertices for part in model.parts if part.kind in ("skin", "mouth")] or [model.vertices]
    )
    worst: Intp = np.zeros(0, dtype=np.intp)
    for kernel in KERNELS:
        field = deformation(sources, targets[rows], mesh, kernel, size)
        worst = folded_vertices(field, mesh, size)
        if not len(worst):
            return deform(model, field, targets, sure, iris)
    near = nearest_points(mesh[worst].astype(np.float64), sources, rows)
    raise ModelError(
        f"the face would fold: {len(worst)} of {len(mesh)} vertices of the skin turn inside out around "
        f"feature points {', '.join(near)}; are these where they should be?"
    )


def _check_folds(model: FaceModel, parts: tuple[Part, ...], targets: Float64, known: Bool) -> None:
    """Raise ModelError where too many triangles of the fitted skin have turned over."""
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
    from fba.face.checks._posing import Poser

    if not model.tables:
        return fitted
    if how == "author":
        return _author_anew(model, fitted)
    carried = replace(fitted, tables=carry_tables(model, fitted.parts, fitted.points, fitted.fapu, shape))
    if how == "carry":
        return carried
    bent = Poser(carried)
    errors = _count_errors(bent)
    if not errors or errors <= _count_errors(Poser(model)):
        return carried
    new = Poser(_author_anew(model, fitted), like=bent)
    best = Poser(_best_tables(new, bent), like=new)
    candidates = ((_count_errors(new), new), (_count_errors(best), best), (errors, bent))
    return min(candidates, key=itemgetter(0))[1].model


def _best_tables(first: Poser, second: Poser) -> FaceModel:
    """Return the first model with the second's tables for every FAP where these break fewer rules."""
    tables = {table.fap: table for table in first.model.tables}
    for table in second.model.tables:
        fap = table.fap
        if fap not in tables or _count_errors(second, fap) < _count_errors(first, fap):
            tables[fap] = table
    lost = {fap: why for fap, why in first.model.lost.items() if fap not in tables}
    return first.model.with_tables(tuple(tables.values()), lost)


def _author_anew(model: FaceModel, fitted: FaceModel) -> FaceModel:
    from fba.face.authoring import author

    authored = author(
        fitted.parts,
        fitted.points,
        bound=fitted.bound,
        name=fitted.name,
        definitions=model.definitions,
        fit=model.fit,
        notes=fitted.notes,
    )
    tables = tuple(table for table in authored.tables if table.fap not in model.lost)
    return authored.with_tables(tables, {**authored.lost, **model.lost})


def _count_errors(poser: Poser, fap: int | None = None) -> int:
    from fba.face.checks._fap_checks import count_errors

    return count_errors(poser, range(FIRST_LOW_LEVEL_FAP, FAP_COUNT + 1) if fap is None else [fap])


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
