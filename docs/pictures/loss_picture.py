"""Picture of docs/robustness.md; needs matplotlib."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("svg")

from matplotlib import pyplot

from bench.codec import loss

TARGET = Path(__file__).parents[1] / "images" / "loss.svg"
SHARES = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2)
SECONDS = 6.5
SETTINGS = [
    loss.Setting("one I plane", None),
    loss.Setting("I plane every 5 s", Fraction(5)),
    loss.Setting("every 2 s", Fraction(2)),
    loss.Setting("every 1 s", Fraction(1)),
    loss.Setting("every 0.5 s", Fraction(1, 2)),
]
COLOURS = ["#555555", "#a6611a", "#d7301f", "#2b83ba", "#1a9641"]


def main() -> None:
    """Draw the mean error behind a single loss, and the share of right frames under steady loss."""
    animation = loss.sample_performance()
    matplotlib.rcParams.update({"svg.hashsalt": "fba", "font.size": 9, "axes.grid": True, "grid.alpha": 0.3})
    figure, (after, steady) = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    channels = [loss.Channel(f"{share}", loss.lose(share)) for share in SHARES]
    for setting, colour in zip(SETTINGS, COLOURS, strict=True):
        error = 100 * loss.recovery(animation, setting, seconds=SECONDS)
        after.plot(np.arange(len(error)) / float(animation.rate), error, colour, label=setting.name)
        right = [100 * one.right for one in loss.run(animation, [setting], channels)]
        steady.plot([100 * share for share in SHARES], right, colour, marker="o", markersize=3)
    after.set(
        xlabel="seconds after the loss of one plane",
        ylabel="mean error, % of each parameter's span",
        title="one plane lost",
        xlim=(0, SECONDS),
        ylim=(0, None),
    )
    after.legend()
    ticks = [100 * share for share in SHARES]
    steady.set(
        xlabel="planes lost, %",
        ylabel="frames shown right, %",
        title="steady loss",
        xscale="log",
        ylim=(0, 100),
    )
    steady.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    steady.minorticks_off()
    figure.savefig(TARGET, metadata={"Date": None})
