"""Expressions made and read: frames a second, and how long one frame takes live."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fba import Animation, FaceTrack, emotion

FRAMES = 200_000
LIVE = 500


def test_an_expression_over_time(benchmark: Any, report: Callable[[str], None]) -> None:
    blend = emotion.combine({"fear": 60, "terror": 40})
    seconds = FRAMES / 100
    made = benchmark.pedantic(
        emotion.animate, (blend,), {"seconds": seconds, "ease": 1.0, "rate": 100}, rounds=3, warmup_rounds=1
    )
    rate = FRAMES / benchmark.stats.stats.median
    benchmark.extra_info.update(frames_per_second=rate)
    report(f"express: {rate:,.0f} frames/s")
    assert len(made) == FRAMES


def test_mixing_expressions(benchmark: Any, report: Callable[[str], None]) -> None:
    emotion.expression("joy")  # reads the tables
    path = np.linspace((2, 2), (6, 6), 200)

    def drag() -> None:
        for activation, evaluation in path:
            emotion.expression_at(float(activation), float(evaluation))

    benchmark.pedantic(drag, rounds=5, warmup_rounds=1)
    each = benchmark.stats.stats.median / len(path)
    benchmark.extra_info.update(seconds=each)
    report(f"a point of the plane: {1e6 * each:.0f} microseconds")


def test_a_performance_in_a_mood(benchmark: Any, report: Callable[[str], None]) -> None:
    rng = np.random.default_rng(0)
    mask = np.ones((FRAMES, 68), dtype=bool)
    mask[:, :2] = False
    values = np.rint(rng.normal(0, 60, (FRAMES, 68))).astype(np.int32)
    performance = Animation(100, np.arange(FRAMES), FaceTrack(values, mask))
    moods = [emotion.Mood("anger", 70), emotion.Mood("sadness", 40, start=100, end=500)]
    benchmark.pedantic(emotion.emote, (performance, moods), rounds=3, warmup_rounds=1)
    rate = FRAMES / benchmark.stats.stats.median
    benchmark.extra_info.update(frames_per_second=rate)
    report(f"emote: {rate:,.0f} frames/s")


def test_reading_live(benchmark: Any, report: Callable[[str], None]) -> None:
    rng = np.random.default_rng(0)
    frames = 0.5 * emotion.expression("joy").faps + rng.normal(0, 20, (LIVE, 68))
    frames[100:110, 18:20] = 900  # a blink
    recogniser = emotion.ExpressionRecogniser(60)
    recogniser.prepare()

    def push() -> None:
        for faps in frames:
            recogniser.push(faps)

    benchmark.pedantic(push, rounds=5, warmup_rounds=1)
    each = benchmark.stats.stats.median / LIVE
    benchmark.extra_info.update(seconds=each)
    report(f"reading a frame live: {1e6 * each:.0f} microseconds")


def test_reading_a_file(benchmark: Any, report: Callable[[str], None]) -> None:
    blend = emotion.combine({"anger": 80})
    animation = emotion.animate(blend, seconds=40, ease=5, rate=50, send="faps")
    benchmark.pedantic(emotion.read_expressions, (animation,), rounds=3, warmup_rounds=1)
    rate = len(animation) / benchmark.stats.stats.median
    benchmark.extra_info.update(frames_per_second=rate)
    report(f"reading a file: {rate:,.0f} frames/s")
