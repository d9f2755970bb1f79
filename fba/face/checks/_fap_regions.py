"""Does anything move that is outside the region of a FAP?"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from functools import cache
from importlib.resources import files

import numpy as np

from fba.face.checks._findings import Finding
from fba.face.checks.posing import Poser
from fba.face.feature_points import row_of
from fba.parameters import faps

MODERATE = 300.0
SHARE = 0.03
"""Vertices that move less than this share of the longest way count as still."""


@cache
def region_table() -> dict[int, tuple[tuple[str, ...], float]]:
    """By FAP: the points of its region, and how far from them in ES0 it may reach."""
    found = {}
    with (files(__package__) / "fap_regions.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            for fap in row["faps"].split():
                found[int(fap)] = (tuple(row["points"].split()), float(row["reach"]))
    return found


def check_region(poser: Poser, fap: int) -> Iterator[Finding]:
    """A finding where vertices move that are too far from the points of the FAP's region."""
    if fap not in region_table():
        return
    names, reach = region_table()[fap]
    points = poser.model.points[[row_of()[name] for name in names]]
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return
    entry = faps()[fap - 1]
    value = MODERATE if entry.unit != "AU" else MODERATE * 100
    moved = np.linalg.norm(poser.shift({fap: value}), axis=1)
    if not moved.max() > 0:
        return
    moving = np.flatnonzero(moved > SHARE * moved.max())
    away = np.min(np.linalg.norm(poser.neutral[moving][:, None] - points, axis=2), axis=1)
    es = poser.model.fapu.ES * 1024
    if away.max() > reach * es:
        worst = int(moving[away.argmax()])
        yield Finding(
            entry.label,
            "nothing moves outside its region",
            f"vertex {worst}, {away.max() * 1000:.0f} mm from it, moves {moved[worst] * 1000:.2f} mm",
            f"within {reach * es * 1000:.0f} mm of {', '.join(names)}",
        )
