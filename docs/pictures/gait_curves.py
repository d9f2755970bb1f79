"""Curves and picture of docs/gait.md.

Hip, knee and ankle of the normal walk beside the means and deviations that Winter measured, and the height of
the pelvis.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from PIL import Image

from fba import player
from fba.body import BapSolver, Skeleton, gait
from fba_player.view._camera import Camera

WALKS = Path(__file__).parents[1] / "images" / "gait.jpg"
PHASES = 8
SIZE = (160, 270)
CAMERA = Camera(target=(0.0, 0.87, 0.03), yaw=78.0, pitch=2.0, distance=5.2)
ROOT = Path(__file__).parents[2]
MEASURED = ROOT / "tests" / "body" / "gait" / "winter_natural_cadence.csv"
TARGET = Path(__file__).parents[1] / "images" / "gait_curves.svg"
WIDTH, HEIGHT, LEFT, TOP = 250, 130, 46, 26
JOINTS = ("hip", "knee", "ankle")
OURS, THEIRS = "#b3401f", "#1f5fb3"


def measured() -> np.ndarray:
    """Percent of the cycle, degrees of hip, knee and ankle, and their deviations, float64 (51, 7)."""
    lines = [line for line in MEASURED.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return np.array([[float(value) for value in row] for row in list(csv.reader(lines))[1:]])


def made() -> tuple[np.ndarray, np.ndarray]:
    """The same of our normal walk, float64 (P, 4), and the height of the pelvis (P,), centimetres.

    From the centres of the joints of the right leg, as markers give them: the thigh against the vertical, the
    shank against the thigh, the foot against the shank, which is 0 in the default posture.
    """
    walk = gait.walk(cycles=1, rate=120)
    assert walk.body is not None
    skeleton, solver = Skeleton.default(), BapSolver()
    thigh, shank, foot, height = leg(solver.pose(walk.body.values), skeleton)
    rest = leg(solver.pose(np.zeros((1, 296), dtype=np.int32)), skeleton)
    percent = np.linspace(0.0, 100.0, len(walk))
    ankle = foot - shank - (rest[2] - rest[1])
    return np.stack([percent, thigh, thigh - shank, ankle], axis=1), 100.0 * height


def leg(matrices: np.ndarray, skeleton: Skeleton) -> tuple[np.ndarray, ...]:
    """Degrees of thigh, shank and foot against the default directions, and metres of the root's height."""
    hip, knee, ankle = (matrices[:, skeleton.number(f"r_{name}"), :3, 3] for name in JOINTS)
    forward = matrices[:, skeleton.number("r_subtalar"), :3, 2]
    return (*(np.degrees(np.arctan2(bone[:, 2], -bone[:, 1])) for bone in (knee - hip, ankle - knee)),
            np.degrees(np.arctan2(forward[:, 1], forward[:, 2])), matrices[:, 0, 1, 3])  # fmt: skip


Line = tuple[np.ndarray, np.ndarray, str]
"""Percent of the cycle, values, and a colour."""


def panel(
    x: int, y: int, title: str, low: float, high: float, lines: list[Line], band: np.ndarray | None = None
) -> str:
    """One diagram: its frame, three labels, and lines (percent, values, colour).

    band: percent, lowest and highest value, (N, 3), of an area behind the lines.
    """

    def place(percent: np.ndarray, values: np.ndarray) -> str:
        across = x + WIDTH * percent / 100.0
        down = y + HEIGHT * (high - values) / (high - low)
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, down, strict=True))

    parts = [
        f'<rect x="{x}" y="{y}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#999"/>',
        f'<text x="{x}" y="{y - 7}" font-weight="bold">{title}</text>',
        f'<text x="{x - 6}" y="{y + 9}" text-anchor="end">{high:g}</text>',
        f'<text x="{x - 6}" y="{y + HEIGHT}" text-anchor="end">{low:g}</text>',
    ]
    if band is not None:
        area = f"{place(band[:, 0], band[:, 1])} {place(band[::-1, 0], band[::-1, 2])}"
        parts.append(f'<polygon points="{area}" fill="{THEIRS}" fill-opacity="0.18"/>')
    for percent in (0, 50, 100):
        across = x + WIDTH * percent // 100
        parts.append(f'<text x="{across}" y="{y + HEIGHT + 14}" text-anchor="middle">{percent} %</text>')
    for percents, values, colour in lines:
        points = place(percents, values)
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>')
    return "\n".join(parts)


def main() -> None:
    """Write the picture."""
    theirs, (ours, height) = measured(), made()
    limits = {"hip": (-20.0, 40.0), "knee": (0.0, 80.0), "ankle": (-30.0, 20.0)}
    panels = []
    for number, name in enumerate(JOINTS):
        x, y = LEFT + (number % 2) * (WIDTH + 60), TOP + (number // 2) * (HEIGHT + 50)
        lines = [(theirs[:, 0], theirs[:, number + 1], THEIRS), (ours[:, 0], ours[:, number + 1], OURS)]
        mean, deviation = theirs[:, number + 1], theirs[:, number + 4]
        band = np.stack([theirs[:, 0], mean - deviation, mean + deviation], axis=1)
        panels.append(panel(x, y, f"{name}, degrees", *limits[name], lines, band))
    panels.append(panel(LEFT + WIDTH + 60, TOP + HEIGHT + 50, "height of the pelvis, cm", 91.0, 99.0,
                        [(ours[:, 0], height, OURS)]))  # fmt: skip
    legend = (f'<text x="{LEFT}" y="{2 * HEIGHT + 120}" fill="{THEIRS}">'
              "means of people, and one standard deviation (Winter)</text>"
              f'<text x="{LEFT + 330}" y="{2 * HEIGHT + 120}" fill="{OURS}">fba gait</text>')  # fmt: skip
    width, whole = 2 * WIDTH + 130, 2 * HEIGHT + 135
    TARGET.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {whole}" font-family="sans-serif" '
        f'font-size="12">\n<rect width="{width}" height="{whole}" fill="white"/>\n'
        + "\n".join([*panels, legend]) + "\n</svg>\n",
        encoding="utf-8", newline="\n",
    )  # fmt: skip


def cycle_row(character: str) -> np.ndarray:
    """One cycle of a character, side by side: the four poses, then those of the other half."""
    walk = gait.walk(character=character, cycles=1, in_place=True, rate=60)
    with player.Offscreen(player.Scene(walk), SIZE, CAMERA, samples=4) as view:
        cycle = float((len(walk) - 1) / walk.rate)
        return np.hstack([view.frame(cycle * n / PHASES)[..., :3].copy() for n in range(PHASES)])


def walks() -> None:
    """Draw a cycle of each character."""
    WALKS.parent.mkdir(exist_ok=True)
    rows = np.vstack([cycle_row(character) for character in gait.characters()])
    Image.fromarray(rows).save(WALKS, quality=88, optimize=True)
