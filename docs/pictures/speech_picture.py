"""Picture of speech: the sample's voice, the phones that are found in it, and the mouth at some of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import ConnectionPatch, FancyBboxPatch

from fba import player
from fba.audio import read_mono
from fba.speech import RATE, Phone, Shape, Speech, Word, find_shapes, find_speech, perform, split_text
from pictures.head_pictures import SAMPLES, UInt8

TEXT = "Hello! All of me, in a few kilobits a second."
UNKNOWN = "kilobits"
SPOKEN = {"k": "K", "ˈɪ": "IH", "l": "L", "ə": "AH", "b": "B", "ɪ": "IH", "t": "T", "s": "S"}
"""The sounds of a word that the recogniser does not know, so that the picture needs no gruut."""
FROM, TO = 3.76, 6.32
"""Seconds of the sample that are shown."""
MOUTHS = 9
SIZE, CROP = 1100, (slice(640, 930), slice(370, 740))
"""Pixels of the face that is drawn, and rows and columns around its mouth."""
INK, FAINT, WAVE, PAPER = "#26313d", "#8a97a5", "#3d7ea6", "#ffffff"
LIPS, TONGUE, OPEN, ROUND = "#d1495b", "#edae49", "#66a182", "#8d6a9f"
COLOURS = {
    1: LIPS,
    2: LIPS,
    **dict.fromkeys(range(3, 10), TONGUE),
    10: OPEN,
    11: OPEN,
    12: OPEN,
    13: ROUND,
    14: ROUND,
}
"""Colours of visemes: lips that meet, sounds of the tongue, open vowels, rounded ones."""


def main() -> UInt8:
    """Return the picture."""
    samples = np.concatenate(list(read_mono(SAMPLES / "hello.wav", RATE)))
    words = [
        replace(word, phones=tuple(SPOKEN)) if word.text == UNKNOWN else word for word in split_text(TEXT)
    ]
    found = find_speech([samples], words)
    speech = replace(
        found, phones=tuple(replace(each, name=SPOKEN.get(each.name, each.name)) for each in found.phones)
    )
    shown = choose_shapes(find_shapes(speech.phones))
    with mpl.rc_context({"font.family": "DejaVu Sans", "text.color": INK}):
        figure: Any = plt.figure(figsize=(16, 6.0), dpi=100, facecolor=PAPER)
        wave = figure.add_axes((0.012, 0.68, 0.976, 0.31))
        lane = figure.add_axes((0.012, 0.47, 0.976, 0.19))
        draw_wave(wave, samples)
        draw_lane(lane, speech.phones, speech.words)
        width = 0.976 / MOUTHS
        for at, (shape, mouth) in enumerate(zip(shown, draw_mouths(speech, shown), strict=True)):
            axes = figure.add_axes((0.012 + width * (at + 0.03), 0.015, width * 0.94, 0.34))
            axes.imshow(mouth, interpolation="lanczos")
            axes.set(xticks=[], yticks=[])
            for spine in axes.spines.values():
                spine.set(color=COLOURS[shape.viseme], linewidth=3)
            figure.add_artist(
                ConnectionPatch(
                    (shape.centre, 0.0), (0.5, 1.0), "data", "axes fraction", axesA=lane, axesB=axes,
                    color=COLOURS[shape.viseme], linewidth=1.6,
                )
            )  # fmt: skip
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        picture: UInt8 = np.asarray(canvas.buffer_rgba())[..., :3].copy()
        plt.close(figure)
    return picture


def choose_shapes(shapes: Sequence[Shape]) -> list[Shape]:
    """Return the visemes of the part that is shown that hold the mouth most, one in each tenth of it."""
    borders = np.linspace(FROM + 0.04, TO - 0.04, MOUTHS + 1)
    inside = [each for each in shapes if each.viseme and FROM <= each.centre <= TO]
    chosen = []
    for start, end in pairwise(borders):
        part = [each for each in inside if start <= each.centre < end]
        if not part:
            part = [min(inside, key=lambda each: abs(each.centre - (start + end) / 2))]
        chosen.append(max(part, key=lambda each: each.weight * each.size))
    return chosen


def draw_wave(axes: Axes, samples: np.ndarray) -> None:
    """Draw the loudest and softest sample of each pixel's time."""
    part = samples[round(FROM * RATE) : round(TO * RATE)].astype(float)
    step = len(part) // 1600
    columns = part[: len(part) // step * step].reshape(-1, step)
    times = FROM + (np.arange(len(columns)) + 0.5) * step / RATE
    axes.fill_between(times, columns.min(axis=1), columns.max(axis=1), color=WAVE, linewidth=0)
    axes.axhline(0, color=WAVE, linewidth=0.8)
    axes.set_xlim(FROM, TO)
    axes.axis("off")


def draw_lane(axes: Axes, phones: Sequence[Phone], words: Sequence[Word]) -> None:
    """Draw words above their phones, which have the colours of their visemes."""
    axes.set(xlim=(FROM, TO), ylim=(0, 1))
    axes.axis("off")
    for word in words:
        middle = (word.start + word.end) / 2
        if FROM <= middle <= TO:
            axes.text(middle, 0.84, word.text, ha="center", va="center", fontsize=17, color=INK)
    for phone in phones:
        shapes = [each for each in find_shapes([phone]) if each.viseme]
        if not shapes or not FROM <= phone.start <= TO:
            continue
        length = phone.end - phone.start
        box = FancyBboxPatch(
            (phone.start + 0.002, 0.08), length - 0.004, 0.48, boxstyle="round,pad=0,rounding_size=0.008",
            mutation_aspect=8, facecolor=COLOURS[shapes[0].viseme], edgecolor="none",
        )  # fmt: skip
        axes.add_patch(box)
        middle = (phone.start + phone.end) / 2
        size = 15 if length > 0.06 else 11 if length > 0.043 else 8
        axes.text(
            middle, 0.31, phone.name, ha="center", va="center", fontsize=size, color=PAPER, weight="bold"
        )


def draw_mouths(speech: Speech, shapes: Sequence[Shape]) -> list[UInt8]:
    """Return the mouth at the middle of each viseme."""
    scene = player.Scene(perform(speech, life=0, style=0.7))
    with player.Offscreen(scene, (SIZE, SIZE), samples=4) as view:
        view.camera = player.Camera(yaw=0, pitch=0).fit(scene.face_subject, 1.0)
        return [view.frame(shape.centre)[CROP] for shape in shapes]
