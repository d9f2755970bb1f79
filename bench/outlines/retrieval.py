"""Leave one out: every silhouette is looked for among all others, by each method."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.outlines.objects import Seen, silhouettes
from fba.arrays import Bool, Float32, Float64, Int64
from fba.outlines import (
    Method,
    build_tree,
    earth_movers_distance,
    embed_l1,
    find_nodes,
    fit_mask,
    methods,
    nearest,
    outline_distances,
    read_mask,
)
from fba.outlines._index import CHOICES
from fba.outlines._index_file import pack_mask, unpack_mask
from fba.outlines._methods import project, sample
from fba.outlines._tree import split_into_paths

QUANTA = 96
"""Points of equal mass of the heaviest silhouette, where masses are not made equal."""


@dataclass(frozen=True)
class Row:
    """A line of a table: the neighbour of each silhouette, and how many distances it took, and seconds."""

    name: str
    neighbours: Int64
    compared: float
    seconds: float


def stacked(points: Sequence[Float64]) -> Float32:
    """Return descriptions as one array (S, N, D), padded with zeros to the same dimension."""
    width = max(each.shape[1] for each in points)
    return np.stack([np.pad(each, ((0, 0), (0, width - each.shape[1]))) for each in points]).astype(
        np.float32
    )


def leave_one_out(
    name: str, described: Float32, method: Method, say: Callable[[str], None], masks: Sequence[Bool] = ()
) -> Row:
    """Return the nearest other silhouette of each. masks: to compare the outlines of the nearest, too."""
    squares = np.array([unpack_mask(pack_mask(mask)) for mask in masks])
    wanted = CHOICES + 1 if masks else 2
    projected = project(described)
    begun, neighbours, compared = time.perf_counter(), [], 0
    for number in range(len(described)):
        found, _, tried = nearest(
            described[number], described, wanted, projected=projected, ground=method.ground
        )
        others = found[found != number]
        best = outline_distances(squares[number], squares[others]).argmin() if masks else 0
        neighbours.append(int(others[best]))
        compared += tried
        if number % 200 == 0:
            say(f"{name}: {number} of {len(described)}")
    seconds = (time.perf_counter() - begun) / len(described)
    return Row(name, np.array(neighbours), compared / len(described), seconds)


def all_methods(
    masks: Sequence[Bool], say: Callable[[str], None], names: Sequence[str] = ()
) -> Iterator[Row]:
    """Yield a row for each method of the library, or for those that are named."""
    for name in names or methods():
        method = methods()[name]
        described = stacked([method.describe(mask) for mask in masks])
        yield leave_one_out(name, described, method, say)
        if name == "points":
            yield leave_one_out("points, then outlines", described, method, say, masks)


def unequal(masks: Sequence[Bool]) -> Row:
    """Return the row of the l1 embedding with masses as they are, of which the smaller is matched in part."""
    trees = []
    for mask in masks:
        nodes = find_nodes(mask)
        tree = build_tree(nodes.points)
        embedded = embed_l1(tree, split_into_paths(tree, nodes.masses)) / nodes.area**0.5
        trees.append((embedded, nodes.masses))
    heaviest = max(float(weights.sum()) for _, weights in trees)
    counts = [max(round(QUANTA * float(weights.sum()) / heaviest), 1) for _, weights in trees]
    points = [
        embedded[sample(weights, count)] for (embedded, weights), count in zip(trees, counts, strict=True)
    ]
    return _compared("tree-l1, masses as they are", points)


def shuffled(masks: Sequence[Bool]) -> Row:
    """Return the row of the l1 embedding with the paths in an arbitrary order."""
    random = np.random.default_rng(1)
    described = stacked([methods()["tree-l1"].describe(mask) for mask in masks])
    points = [each[:, random.permutation(each.shape[1])] for each in described]
    return _compared("tree-l1, paths in arbitrary order", points)


def _compared(name: str, points: Sequence[Float64 | Float32]) -> Row:
    begun, count = time.perf_counter(), len(points)
    distances = np.full((count, count), np.inf)
    for one in range(count):
        for other in range(one):
            distance = earth_movers_distance(points[one], points[other])
            distances[one, other] = distances[other, one] = distance
    return Row(name, distances.argmin(axis=1), count - 1, (time.perf_counter() - begun) / count)


def kimia(folder: Path, say: Callable[[str], None]) -> list[str]:
    """Return the lines of the table for a folder of silhouettes `trainimageC_K.png`, class C and number K."""
    files = sorted(folder.glob("trainimage*_*.png"))
    if not files:
        raise SystemExit(f"{folder}: no files trainimageC_K.png")
    classes = np.array([int(re.findall(r"(\d+)_\d+", file.name)[0]) for file in files])
    masks = [fit_mask(read_mask(file)) for file in files]
    rows = [*all_methods(masks, say), unequal(masks), shuffled(masks)]
    lines = ["| method | same class | distances a query | ms a query |", "|---|---|---|---|"]
    for row in rows:
        right = float((classes[row.neighbours] == classes).mean())
        lines.append(f"| {row.name} | {right:.1%} | {row.compared:.0f} | {1000 * row.seconds:.0f} |")
    return lines


def alike(seen: Sequence[Seen]) -> Bool:
    """Return which silhouettes (S,) are more like one of a side that is no neighbour than any neighbour's.

    By the pixels that differ, of figures of one size in the middle of a square: no comparison of outlines
    alone can be expected to tell these sides.
    """
    beside = np.array([[one.is_beside(other) for other in seen] for one in seen])
    same = np.array([[one.name == other.name for other in seen] for one in seen])
    filled = np.array([unpack_mask(pack_mask(each.mask)).ravel() for each in seen], dtype=np.float32)
    areas = filled.sum(axis=1)
    differing = areas[:, None] + areas - 2 * filled @ filled.T
    np.fill_diagonal(beside, val=False)
    np.fill_diagonal(same, val=False)
    nearest_side = np.where(beside, differing, np.inf).min(axis=1)
    return np.asarray(np.where(same & ~beside, differing, np.inf).min(axis=1) <= nearest_side)


def wrong_sides(pairs: Sequence[tuple[Seen, Seen]]) -> str:
    """Return how many of the pairs are how far aside."""
    count = dict.fromkeys(("another object", "the opposite or mirrored side", "two steps", "others"), 0)
    for one, other in pairs:
        turned = abs((one.yaw - other.yaw + 180) % 360 - 180)
        raised = abs(one.pitch - other.pitch)
        images = (one.yaw + 180, -one.yaw, 180 - one.yaw)
        mirrored = min(abs((yaw - other.yaw + 180) % 360 - 180) for yaw in images) <= one.step >= raised
        kind = "the opposite or mirrored side" if mirrored else "others"
        if one.name != other.name:
            kind = "another object"
        elif turned <= 2 * one.step >= raised:
            kind = "two steps"
        count[kind] += 1
    return ", ".join(f"{number} {kind}" for kind, number in count.items())


def objects(say: Callable[[str], None], names: Sequence[str], *, around: bool) -> Iterator[str]:
    """Yield the lines of the table for nine objects from 180 sides. names: of methods; none for all."""
    seen = list(silhouettes(around=around))
    told = ~alike(seen)
    yield "| method | correct object | correct pose | of sides that can be told | distances | ms a query |"
    yield "|---|---|---|---|---|---|"
    for row in all_methods([each.mask for each in seen], say, names):
        pairs = [(each, seen[other]) for each, other in zip(seen, row.neighbours, strict=True)]
        named = np.mean([each.name == other.name for each, other in pairs])
        posed = np.array([each.is_beside(other) for each, other in pairs])
        yield (
            f"| {row.name} | {named:.1%} | {posed.mean():.1%} | {posed[told].mean():.1%} "
            f"| {row.compared:.0f} | {1000 * row.seconds:.0f} |"
        )
        say(wrong_sides([pair for pair, right in zip(pairs, posed, strict=True) if not right]))
    say(f"{len(seen) - told.sum()} of {len(seen)} silhouettes are more like one that is no neighbour")
