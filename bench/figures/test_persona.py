"""Learning a Persona from two minutes of tracked points, and using it frame by frame."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fba.persona import LivePersona, Persona, TrackedFace, animate_as, learn
from fba.persona._persona import MEANS
from tools.persona.actors import act, all_contents, named_styles


@pytest.fixture(scope="module")
def actor() -> TrackedFace:
    """Two minutes: every content twice."""
    return act(all_contents(2, np.random.default_rng(1)), named_styles()["comedian"], seed=3).face


@pytest.fixture(scope="module")
def persona(actor: TrackedFace) -> Persona:
    return learn([actor])


@pytest.mark.benchmark(timer=time.process_time)
def test_two_minutes_of_points_to_a_persona(
    benchmark: Any, actor: TrackedFace, report: Callable[[str], None]
) -> None:
    """The issue asks for less than 20 s."""
    benchmark.pedantic(learn, ([actor],), rounds=3, warmup_rounds=1)
    seconds = benchmark.stats.stats.median
    benchmark.extra_info.update(seconds=seconds, frames=len(actor))
    report(f"Persona of {len(actor)} frames: {seconds:.2f} s of processor")
    assert seconds < 20


@pytest.mark.parametrize("means", MEANS)
@pytest.mark.benchmark(timer=time.process_time)
def test_a_frame_in_an_actors_way(
    benchmark: Any, actor: TrackedFace, persona: Persona, means: str, report: Callable[[str], None]
) -> None:
    """The issue asks for less than 2 ms; the source took 2 s."""
    live = LivePersona(persona, means=means)
    frames = list(zip(actor.points, actor.angles, strict=True))
    for points, angles in frames[:60]:
        live.push(points, angles)
    used = frames[60:360]

    def run() -> None:
        for points, angles in used:
            live.push(points, angles)

    benchmark.pedantic(run, rounds=3, warmup_rounds=1)
    milliseconds = 1000 * benchmark.stats.stats.median / len(used)
    benchmark.extra_info.update(milliseconds=milliseconds)
    report(f"a frame of a Persona by {means}: {milliseconds:.2f} ms of processor")
    assert milliseconds < 2


@pytest.mark.benchmark(timer=time.process_time)
def test_two_minutes_in_an_actors_way(
    benchmark: Any, actor: TrackedFace, persona: Persona, report: Callable[[str], None]
) -> None:
    benchmark.pedantic(animate_as, (actor, persona), rounds=3, warmup_rounds=1)
    rate = len(actor) / benchmark.stats.stats.median
    benchmark.extra_info.update(frames_per_second=rate)
    report(f"{len(actor)} frames in an actor's way at once: {rate:.0f} frames/s")
