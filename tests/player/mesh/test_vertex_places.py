"""Vertices are worked out when somebody asks for them: all of them once, or those that are asked for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from fba_player.mesh.lazy_vertices import Places, Probe, Whole, spare

Float32 = npt.NDArray[np.float32]


def numbered(count: int, by: float) -> Float32:
    return (np.arange(3 * count, dtype=np.float32) * np.float32(by)).reshape(-1, 3)


class Figure:
    """Ten vertices, times what the pose is; counts who asks for what."""

    def __init__(self) -> None:
        self.made: list[float] = []
        self.prepared: list[list[int]] = []
        self.written: list[float] = []
        self.probe = Probe(10, self._prepare)

    def whole(self, pose: float) -> Whole:
        def make() -> tuple[Float32, Float32]:
            self.made.append(pose)
            return numbered(10, pose), numbered(10, -pose)

        return Whole(10, make, lambda rows: self.probe.at(pose, rows)[0], lambda: ("motion", pose))

    def _prepare(self, rows: npt.NDArray[np.intp]) -> Any:
        self.prepared.append(rows.tolist())

        def write(pose: float, places: Float32) -> None:
            self.written.append(pose)
            places[rows] = numbered(10, pose)[rows]

        return write


@pytest.fixture
def figure() -> Figure:
    return Figure()


class Sparing:
    """Who makes vertices by other means."""


@pytest.fixture
def sparing() -> Iterator[Sparing]:
    who = Sparing()
    spare(who, True)
    yield who
    spare(who, False)


def test_all_are_made_once_for_all_parts(figure: Figure) -> None:
    whole = figure.whole(2.0)
    first, last = Places(whole, 0, 4), Places(whole, 4, 6)
    assert not figure.made
    assert (len(first), len(last), len(last.some(np.array([1, 5])))) == (4, 6, 2)
    np.testing.assert_array_equal(first.positions, numbered(10, 2.0)[:4])
    np.testing.assert_array_equal(last.normals, numbered(10, -2.0)[4:])
    np.testing.assert_array_equal(last.some(np.array([5, 1])).positions, numbered(10, 2.0)[[9, 5]])
    assert figure.made == [2.0]


def test_some_come_with_all_where_nobody_spares_them(figure: Figure) -> None:
    np.testing.assert_array_equal(figure.whole(2.0).at(np.array([3])), numbered(10, 2.0))
    assert figure.made == [2.0]
    assert not figure.written


def test_some_are_made_alone_and_again_for_each_pose(figure: Figure, sparing: Sparing) -> None:
    part = Places(figure.whole(2.0), 4, 6)
    rows = np.array([0, 3])
    np.testing.assert_array_equal(part.reached(rows)[rows], numbered(10, 2.0)[[4, 7]])
    np.testing.assert_array_equal(part.sampled(4), numbered(10, 2.0)[[4, 8]])
    assert figure.prepared == [[4, 7], [4, 7, 8]]  # 8 is new
    assert figure.written == [2.0, 2.0]
    other = Places(figure.whole(3.0), 4, 6)
    np.testing.assert_array_equal(other.reached(rows)[rows], numbered(10, 3.0)[[4, 7]])
    np.testing.assert_array_equal(other.sampled(4), numbered(10, 3.0)[[4, 8]])
    assert figure.prepared == [[4, 7], [4, 7, 8]]
    assert figure.written == [2.0, 2.0, 3.0]  # once, for both questions
    assert not figure.made


def test_what_is_made_is_taken(figure: Figure, sparing: Sparing) -> None:
    part = Places(figure.whole(2.0), 4, 6)
    assert not part.whole.is_made
    _ = part.normals
    assert part.whole.is_made
    np.testing.assert_array_equal(part.sampled(2), numbered(10, 2.0)[[4, 6, 8]])
    np.testing.assert_array_equal(part.reached(np.array([1])), numbered(10, 2.0)[4:])
    assert not figure.written


def test_the_sample_of_some_is_that_of_all(figure: Figure, sparing: Sparing) -> None:
    part = Places(figure.whole(2.0), 0, 10)
    sample = part.sampled(5)
    assert part.some(np.array([9])).sampled(1) is sample
    np.testing.assert_array_equal(
        Places(part.whole, 0, 10, np.array([9, 2])).sampled(1), numbered(10, 2.0)[[9, 2]]
    )


def test_afresh_is_the_same_not_yet_made(figure: Figure) -> None:
    whole = figure.whole(2.0)
    parts = [Places(whole, 0, 4), Places(whole, 4, 6).some(np.array([1]))]
    before = [part.positions for part in parts]
    wholes: dict[int, Whole] = {}
    again = [part.afresh(wholes) for part in parts]
    assert again[0].whole is again[1].whole is not whole
    assert not again[0].whole.is_made
    for one, other in zip(before, again, strict=True):
        np.testing.assert_array_equal(other.positions, one)
    assert figure.made == [2.0, 2.0]


def test_what_a_graphics_card_needs_is_there_or_not(figure: Figure) -> None:
    assert figure.whole(2.0).motion == ("motion", 2.0)
    assert figure.whole(2.0).moves
    fixed = Places.of(numbered(3, 1.0), numbered(3, 2.0))
    assert fixed.whole.motion is None
    assert not fixed.whole.moves
    np.testing.assert_array_equal(fixed.sampled(2), numbered(3, 1.0)[::2])
