"""Speed of the deformer: all 66 FAPs of a head, with normals, on one core.

Times are those of the processor, whatever else it has to do meanwhile. The ratio to a bare copy of the
same vertices and normals is what to quote.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np
import pytest

from fba.face import (
    HEAD,
    Deformer,
    FaceDefMesh,
    FaceDefTables,
    FaceDefTransform,
    FaceModel,
    Part,
    neutral_points,
)

ROUNDS = 300
VERTICES = 12_000
BORDERS = {3: [-400, 0, 250, 500, 800, 1080], 19: [-1080, 0, 512, 1024], 20: [-1080, 0, 512, 1024]}


@pytest.fixture(scope="module", params=["built-in head", "synthetic head"])
def deformer(request: pytest.FixtureRequest) -> Deformer:
    return Deformer(FaceModel.default() if request.param == "built-in head" else synthetic_head())


def synthetic_head(seed: int = 1) -> FaceModel:
    """An egg of 12,000 vertices; each FAP moves 200 to 1500 of them, the jaw 4000, three turn everything."""
    random = np.random.default_rng(seed)
    size = round(VERTICES**0.5)
    a, b = np.meshgrid(np.linspace(0.02, np.pi - 0.02, size), np.linspace(0, 2 * np.pi, size), indexing="ij")
    egg = np.stack([0.08 * np.sin(a) * np.sin(b), 0.11 * np.cos(a), 0.09 * np.sin(a) * np.cos(b)], axis=-1)
    number = np.arange(size * size).reshape(size, size)
    p, q, r, s = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.stack([p, q, r, p, r, s], axis=-1).reshape(-1, 3)
    skin = Part("skin", "skin", egg.reshape(-1, 3), triangles)
    front = skin.vertices[skin.vertices[:, 2] > 0]
    tables = []
    for fap in range(3, 69):
        if fap in (48, 49, 50):
            axis = tuple(float(fap == of) for of in (48, 49, 50))
            transform = FaceDefTransform(HEAD, "rotation", axis, (0, -0.06, -0.02))  # type: ignore[arg-type]
            tables.append(FaceDefTables(fap, transforms=(transform,)))
            continue
        away = np.linalg.norm(skin.vertices - front[random.integers(len(front))], axis=1)
        vertices = np.argsort(away)[: 4000 if fap == 3 else random.integers(200, 1500)]
        borders = BORDERS.get(fap, [-900, -450, 0, 450, 900])
        falloff = 1 - away[vertices] / away[vertices].max()
        direction = random.normal(0, 1, (1, len(borders) - 1, 3))
        mesh = FaceDefMesh("skin", borders, vertices, falloff[:, None, None] * direction)
        tables.append(FaceDefTables(fap, (mesh,)))
    return FaceModel((skin,), neutral_points(), np.full(84, -1), tuple(tables), name="synthetic head")


def timed(function: Callable[[], Any]) -> float:
    times = []
    for _ in range(ROUNDS):
        start = time.thread_time()
        function()
        times.append(time.thread_time() - start)
    return median(times)


@pytest.mark.benchmark(timer=time.thread_time)
def test_deform(benchmark: Any, deformer: Deformer, report: Callable[[str], None]) -> None:
    model = deformer.model
    out, normals = (np.empty_like(model.vertices) for _ in range(2))
    faps = np.zeros(68)
    faps[2:] = np.random.default_rng(2).integers(50, 800, 66)  # none is 0; most leave their first interval

    def copied() -> None:
        np.copyto(out, model.vertices)
        np.copyto(normals, model.normals)

    copied()
    copy = timed(copied)
    deformer(faps, out, normals)
    benchmark.pedantic(deformer, (faps, out, normals), rounds=ROUNDS, warmup_rounds=5)
    whole = benchmark.stats.stats.median
    bare = timed(lambda: deformer(faps, out))
    resting = np.where(np.arange(68) == 30, 100.0, 0.0)
    one = timed(lambda: deformer(resting, out, normals))
    points = timed(lambda: deformer.feature_points(faps))
    benchmark.extra_info.update(
        milliseconds=whole * 1e3, bare_milliseconds=bare * 1e3, ratio=whole / copy, vertices=len(out)
    )
    report(
        f"deform {model.name}, {len(out)} vertices, {len(model.triangles)} triangles, 66 FAPs: "
        f"{whole * 1e3:.2f} ms a frame with normals (goal 0.5), {bare * 1e3:.2f} without; "
        f"ratio to a copy of both {whole / copy:.0f}; one FAP {one * 1e3:.2f}; "
        f"feature points alone {points * 1e3:.3f}"
    )
