"""Replaces tables of FAPs, made from a sculptor's shapes, that break the standard's rules."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fba.face._tables import FaceDefMesh, FaceDefTables
from fba.face.authoring.regions._eye_opening import LIDS
from fba.face.authoring.regions._eyes import PUPIL_OF_IRIS
from fba.face.checks._fap_checks import count_errors, region_table
from fba.face.checks._posing import Poser
from fba.face.eyeball import PUPIL_FAP, eyeballs, pupil_diameter
from fba.face.model import FaceModel
from fba.face.points import DILATE_PUPIL
from fba.parameters import faps, point_rows
from fba.sampling import smoothstep

FADE_SHARES = (0.75, 0.97)
"""Shares of the reach of a region between which a motion that leaves it is faded out."""
FALSE_PUPIL = 0.5
"""Relative deviation of a pupil's size from the usual size above which it is not a pupil."""
MESH = ("mesh", "shapes break the standard's rules for {}: made from the mesh")
"""Name and text of the note about FAPs whose tables were replaced."""
STOP_SHARES = (0.85, 0.7, 0.55, 0.4)
"""Shares of the range of a motion at which it is made to stop, until its triangles are sound."""


def repair_tables(model: FaceModel, plain: FaceModel, *, note: tuple[str, str] = MESH) -> FaceModel:
    """Return the model with sound tables for FAPs whose own break the rules of `check_faps`.

    Tried are the same motion faded out at the edge of its region, or with an earlier stop, and the table of
    `plain`, such as the face made from the mesh alone, whose use the note tells; the one with the fewest
    errors is taken. A pupil that cannot move correctly is lost.
    """
    poser, others = Poser(model), plain.table_of
    tables, lost = dict(model.table_of), dict(model.lost)
    replaced: list[int] = []
    for fap, table in model.table_of.items():
        least = _count_errors(poser, fap)
        if not least:
            continue
        for candidate in _candidates(model, table, others.get(fap)):
            others_of_eye = (tables[each] for each in _judged_with(fap) if each != fap and each in tables)
            trial = Poser(model.with_tables((candidate, *others_of_eye), {}), like=poser)
            errors = _count_errors(trial, fap)
            if errors < least:
                least, tables[fap] = errors, candidate
        if least and fap in DILATE_PUPIL:
            del tables[fap]
            lost[fap] = "the eyeball has too few vertices around its pupil"
        elif tables[fap] is others.get(fap):
            replaced.append(fap)
    for fap in list(replaced):
        mate = faps()[fap - 1].lip_mate
        if mate in tables and mate in others and mate not in replaced:
            # both contours of a lip are made to move together
            tables[mate] = others[mate]
            replaced.append(mate)
    repaired = model.with_tables(tuple(tables.values()), lost)
    if not replaced:
        return repaired
    names = ", ".join(faps()[fap - 1].name for fap in sorted(replaced))
    return repaired.with_notes({note[0]: note[1].format(names)})


def take_sounder(model: FaceModel, other: FaceModel) -> FaceModel:
    """Return the model with those tables of the same face with `other` ones that break fewer rules of
    `check_faps`; both lids of an eye, which must meet, come from the same one."""
    poser = Poser(model)
    there, tables = Poser(other, like=poser), dict(model.table_of)
    for fap in model.table_of:
        together = _judged_with(fap)
        if fap == together[0] and set(together) <= tables.keys() & other.table_of.keys():
            errors = _count_errors(poser, fap)
            if errors and _count_errors(there, fap) < errors:
                tables |= {each: other.table_of[each] for each in together}
    return model.with_tables(tuple(tables.values()), model.lost)


def drop_false_pupils(model: FaceModel) -> FaceModel:
    """Return the model without the FAPs of pupils that the mesh of the eyeball does not have."""
    lost = dict(model.lost)
    for side, eye in eyeballs(model).items():
        size, wanted = pupil_diameter(model, eye), model.fapu.IRISD * 1024 * PUPIL_OF_IRIS
        if size is not None and abs(size / wanted - 1) > FALSE_PUPIL:
            lost[PUPIL_FAP[side]] = f"the {side} eyeball has too few vertices around its pupil"
    kept = tuple(table for table in model.tables if table.fap not in lost)
    return model if len(kept) == len(model.tables) else model.with_tables(kept, lost)


def _count_errors(poser: Poser, fap: int) -> int:
    """Return the errors of one FAP, together with those that it is judged with."""
    together = _judged_with(fap)
    return count_errors(poser, together, combined=len(together) > 1)


def _judged_with(fap: int) -> list[int]:
    """Return a FAP, with that of the other lid of its eye, which it must meet, if it is a lid's."""
    return [each for each, (side, _) in LIDS.items() if fap in LIDS and side == LIDS[fap][0]] or [fap]


def _candidates(
    model: FaceModel, table: FaceDefTables, plain: FaceDefTables | None
) -> Iterator[FaceDefTables]:
    if table.fap in region_table():
        yield _within_region(model, table)
    for share in STOP_SHARES:
        for sides in (-1,), (1,), (-1, 1):
            if table.fap in LIDS and 1 in sides:
                continue  # a lid that stops as it closes would not meet the other
            yield FaceDefTables(
                table.fap, tuple(_stopped(mesh, share, sides) for mesh in table.meshes), table.transforms
            )
    if plain is not None:
        yield plain


def _within_region(model: FaceModel, table: FaceDefTables) -> FaceDefTables:
    """Return the motion of a table, faded out towards the edge of the region of its FAP."""
    names, reach = region_table()[table.fap]
    points = model.points[[point_rows()[name] for name in names]]
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return table
    meshes = []
    for mesh in table.meshes:
        vertices = model.part(mesh.part).vertices[mesh.vertices].astype(np.float64)
        away = np.linalg.norm(vertices[:, None] - points, axis=2).min(axis=1) / (reach * model.fapu.ES * 1024)
        share = smoothstep((FADE_SHARES[1] - away) / (FADE_SHARES[1] - FADE_SHARES[0]))[:, None, None]
        moves = (mesh.displacements * share).astype(np.float32)
        meshes.append(FaceDefMesh(mesh.part, mesh.borders, mesh.vertices, moves))
    return FaceDefTables(table.fap, tuple(meshes), table.transforms)


def _stopped(mesh: FaceDefMesh, share: float, sides: tuple[int, ...]) -> FaceDefMesh:
    """Return the motion of a mesh with a stop at a share of its range. sides: -1 below 0, 1 above."""
    borders, moves = mesh.borders.astype(np.int64), mesh.displacements
    moving = np.flatnonzero(np.abs(moves).max(axis=(0, 2), initial=0.0) > 0)
    if not len(moving):
        return mesh
    for sign in sides:
        end = int(borders[moving[-1] + 1]) if sign > 0 else int(borders[moving[0]])
        stop = round(end * share)
        if not stop or (stop > 0) != (sign > 0):
            continue
        place = int(np.searchsorted(borders, stop))
        if borders[place] != stop:
            # the interval around the stop is cut in two
            borders = np.insert(borders, place, stop)
            moves = np.insert(moves, place - 1, moves[:, place - 1], axis=1)
        outside = borders[:-1] >= stop if sign > 0 else borders[1:] <= stop
        moves = np.where(outside[None, :, None], 0.0, moves)
        moving = np.flatnonzero(np.abs(moves).max(axis=(0, 2), initial=0.0) > 0)
        if not len(moving):
            break
    return FaceDefMesh(mesh.part, borders.astype(np.int32), mesh.vertices, moves.astype(np.float32))
