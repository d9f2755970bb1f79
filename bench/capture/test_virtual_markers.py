"""50 virtual markers on a mesh of 24,000 vertices: which vertices each moves, and the vertices of a frame.

The source of the method took 10.6 s for the first on a processor of 1.73 GHz (24,134 vertices, up to 1,100 a
marker). The same walk written in plain Python runs here beside it.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fba.capture.virtual_markers import MarkedHead, MarkerMapping, VirtualMarker
from fba.capture.virtual_markers.influence import WalkedMesh
from fba.capture.virtual_markers.mapping import find_weights
from fba.face import Part

WIDE, HIGH = 161, 150
"""Vertices of the mesh, a half cylinder 0.2 m high."""
RADIUS = 0.027
Mesh = tuple[np.ndarray, np.ndarray]


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    y, angle = np.meshgrid(np.linspace(0, 0.2, HIGH), np.linspace(0, np.pi, WIDE), indexing="ij")
    vertices = np.stack([-0.08 * np.cos(angle), y, 0.08 * np.sin(angle)], axis=-1).reshape(-1, 3)
    corner = (np.arange(WIDE - 1)[None] + np.arange(HIGH - 1)[:, None] * WIDE).ravel()
    triangles = np.concatenate([
        np.stack([corner, corner + 1, corner + WIDE + 1], axis=1),
        np.stack([corner, corner + WIDE + 1, corner + WIDE], axis=1),
    ])  # fmt: skip
    return vertices, triangles


@pytest.fixture(scope="module")
def centres(mesh: Mesh) -> list[tuple[int, float, float]]:
    """50 of them, in five rows on the front."""
    rows = np.linspace(20, HIGH - 20, 5).astype(int)
    columns = np.linspace(35, WIDE - 35, 10).astype(int)
    return [(int(row * WIDE + column), RADIUS, RADIUS) for row in rows for column in columns]


def walk_in_python(mesh: Mesh, centres: list[tuple[int, float, float]]) -> list[set[int]]:
    """The walk of the source, without recursion."""
    vertices, triangles = mesh[0].tolist(), mesh[1].tolist()
    around: defaultdict[int, list[list[int]]] = defaultdict(list)
    for triangle in triangles:
        for vertex in triangle:
            around[vertex].append(triangle)
    found = []
    for centre, radius, depth in centres:
        x, y, z = vertices[centre]
        inside, waiting = {centre}, [centre]
        while waiting:
            for triangle in around[waiting.pop()]:
                for other in triangle:
                    if other not in inside:
                        u, v, w = vertices[other]
                        if (u - x) ** 2 + (v - y) ** 2 < radius**2 and abs(w - z) <= depth:
                            inside.add(other)
                            waiting.append(other)
        found.append(inside)
    return found


@pytest.mark.benchmark(timer=time.process_time)
def test_influence_of_fifty_markers(
    benchmark: Any, mesh: Mesh, centres: list[tuple[int, float, float]], report: Callable[[str], None]
) -> None:
    found = benchmark.pedantic(lambda: WalkedMesh(*mesh).walk(centres), rounds=20, warmup_rounds=2)
    begin = time.process_time()
    plain = walk_in_python(mesh, centres)
    ratio = (time.process_time() - begin) / benchmark.stats.stats.median
    milliseconds = 1000 * benchmark.stats.stats.median
    sizes = [len(each.vertices) for each in found]
    benchmark.extra_info.update(milliseconds=milliseconds, ratio=ratio, largest=max(sizes))
    report(
        f"influence of 50 markers on {len(mesh[0])} vertices, {min(sizes)} to {max(sizes)} each: "
        f"{milliseconds:.1f} ms, {ratio:.0f} times as fast as in plain Python"
    )
    assert [set(each.vertices.tolist()) for each in found] == plain
    assert milliseconds < 50


@pytest.mark.benchmark(timer=time.process_time)
def test_a_frame_of_fifty_markers(
    benchmark: Any, mesh: Mesh, centres: list[tuple[int, float, float]], report: Callable[[str], None]
) -> None:
    part = Part("skin", "skin", mesh[0].astype(np.float32), mesh[1].astype(np.int32))
    rows = (np.arange(len(mesh[0])),)
    head = MarkedHead(
        "half", (part,), rows, mesh[0], np.full((84, 3), np.nan), np.full(84, -1, np.int32), 1.0
    )
    markers = {str(n): VirtualMarker(*centre) for n, centre in enumerate(centres)}
    weights = find_weights(head, MarkerMapping(markers))
    displacements = np.random.default_rng(1).normal(0, 0.003, (len(markers), 3))
    moved = benchmark.pedantic(
        lambda: head.vertices + weights.moved(displacements), rounds=20, iterations=10, warmup_rounds=2
    )
    milliseconds = 1000 * benchmark.stats.stats.median
    benchmark.extra_info.update(milliseconds=milliseconds)
    report(f"a frame of {len(moved)} vertices moved by 50 markers: {milliseconds:.2f} ms")
    assert milliseconds < 10
