"""Fit the corrections of the normal walk to measured people: `python tools/fit_gait.py [ROUNDS]`.

Writes the rows of `normal` in `fba/body/gait/corrections.csv`. Hip, knee and ankle of a leg that swings are
to be within one standard deviation of Winter's means (`docs/pictures/gait_curves.py` reads them), and to
speed up and slow down as people's do; neither knee nor ankle is jerked. A leg that stands is left to the
poses: there, feet that do not slip decide.
"""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "docs" / "pictures"))

import gait_curves as curves  # noqa: E402

from fba.body import BapSolver, Skeleton, gait  # noqa: E402

TARGET = ROOT / "fba" / "body" / "gait" / "corrections.csv"
RATE = 60
"""Frames a second at which the walk is fitted."""
SWING = (0.64, 0.685, 0.73, 0.78, 0.83, 0.88, 0.94)
"""Phases of the corrections of each curve."""
CURVES = ("thigh", "knee", "foot")
DEGREES = 10.0
"""Degrees that a value of 1 stands for."""
STEP = 0.05
"""Change of a value from which slopes are taken: rounding drowns smaller ones."""
WITHIN = 0.88
"""Deviations within which the curves are to be."""
JERK = 8.5
"""Millimetres by which the way of a knee or ankle may change from frame to frame."""


class Fit:
    """The residuals of a vector of corrections."""

    def __init__(self) -> None:
        self.normal = gait.Character.named("normal")
        self.measured = curves.measured()
        self.solver, self.skeleton = BapSolver(), Skeleton.default()
        neutral = self.solver.pose(np.zeros((1, 296), dtype=np.int32))
        self.rest = curves.leg(neutral, self.skeleton)

    def start(self) -> np.ndarray:
        """Return the corrections that the file has, as a vector."""
        known = {curve: dict(self.normal.corrections.get(curve, ())) for curve in CURVES}
        return np.array([known[curve].get(phase, 0.0) / DEGREES for curve in CURVES for phase in SWING])

    def character(self, vector: np.ndarray) -> gait.Character:
        """Return the normal walker with these corrections."""
        rows = np.round(vector * DEGREES, 3).reshape(len(CURVES), -1).tolist()
        return replace(
            self.normal,
            corrections={
                curve: tuple(zip(SWING, row, strict=True)) for curve, row in zip(CURVES, rows, strict=True)
            },
        )

    def walk(self, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return percent (T,), degrees of hip, knee and ankle (3, T), and jerks in mm."""
        walk = gait.walk(character=self.character(vector), cycles=1, rate=RATE)
        assert walk.body is not None
        posed = self.solver.pose(walk.body.values)
        thigh, shank, foot, _ = curves.leg(posed, self.skeleton)
        angles = np.stack([thigh, thigh - shank, foot - shank - (self.rest[2] - self.rest[1])])
        joints = posed[:-1][:, [self.skeleton.number(f"r_{name}") for name in ("knee", "ankle")]][..., :3, 3]
        joints[..., 2] -= self.normal.stride * np.arange(len(joints))[:, None] / len(joints)
        jerks = 1000 * np.linalg.norm(np.diff(np.concatenate([joints, joints[:2]]), 2, axis=0), axis=2)
        return np.linspace(0, 100, len(walk)), angles, jerks

    def apart(self, percent: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Return (3, 51): how many deviations the curves are from the means."""
        table = self.measured
        return np.array([
            (np.interp(table[:, 0], percent, angles[row]) - table[:, row + 1]) / table[:, row + 4]
            for row in range(3)
        ])  # fmt: skip

    def residuals(self, vector: np.ndarray) -> np.ndarray:
        """Return the residuals of the fit."""
        percent, angles, jerks = self.walk(vector)
        apart = self.apart(percent, angles)
        people = np.array(
            [np.interp(percent, self.measured[:, 0], column) for column in self.measured.T[1:4]]
        )
        bends = [np.diff(np.hstack([curve, curve[:, 1:3]]), 2, axis=1) for curve in (angles, people)]
        return np.concatenate([
            6.0 * np.maximum(np.abs(apart) - WITHIN, 0.0).ravel(),
            0.15 * apart.ravel(),
            0.15 * (bends[0] - bends[1]).ravel(),
            0.25 * np.maximum(jerks - JERK, 0.0).ravel(),
            0.03 * vector,
        ])  # fmt: skip

    def slopes(self, vector: np.ndarray) -> np.ndarray:
        """Return the derivatives of the residuals, by central differences."""
        steps = STEP * np.eye(len(vector))
        return np.stack(
            [(self.residuals(vector + step) - self.residuals(vector - step)) / (2 * STEP) for step in steps],
            axis=1,
        )


def write(character: gait.Character) -> None:
    """Write the corrections of a character, in place of its own in the file."""
    others: list[list[str]] = []
    if TARGET.exists():
        rows = list(csv.reader(TARGET.read_text(encoding="utf-8").splitlines()))[1:]
        others = [row for row in rows if row[0] != character.name]
    own = [
        [character.name, curve, f"{phase:g}", f"{value:g}"]
        for curve, points in character.corrections.items()
        for phase, value in points
    ]
    with TARGET.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["character", "curve", "phase", "value"])
        writer.writerows([*own, *others])


def main(rounds: int) -> None:
    """Fit, write, and print how far the curves are from the means."""
    fit = Fit()
    found = least_squares(fit.residuals, fit.start(), jac=fit.slopes, max_nfev=rounds).x
    write(fit.character(found))
    percent, angles, jerks = fit.walk(found)
    worst = np.abs(fit.apart(percent, angles)).max(axis=1)
    sys.stdout.write(
        f"at most {', '.join(f'{one:.2f}' for one in worst)} deviations (hip, knee, ankle); "
        f"at most {jerks.max():.1f} mm a frame more\n"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
