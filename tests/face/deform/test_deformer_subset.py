"""Some vertices of a face moved alone are moved as all of them are, number for number."""

from __future__ import annotations

import numpy as np
import pytest

from fba.face.deform.deformer import Deformer
from fba.face.model import FaceModel


@pytest.fixture(scope="module")
def deformer() -> Deformer:
    return Deformer(FaceModel.default())


@pytest.mark.parametrize("count", [1, 40, 3000])
def test_they_stand_where_they_stand_among_all(deformer: Deformer, count: int) -> None:
    random = np.random.default_rng(count)
    size = len(deformer.model.vertices)
    rows = np.sort(random.choice(size, count, replace=False))
    some = deformer.chosen(rows)
    for _ in range(3):
        faps = random.normal(0.0, 400.0, 68)
        faps[:2] = 0
        out = np.full((size, 3), 7.0, dtype=np.float32)
        some.local(faps, out)
        np.testing.assert_array_equal(out[rows], deformer.local(faps)[rows])
        assert (np.delete(out, rows, axis=0) == 7.0).all()


def test_none_and_all(deformer: Deformer) -> None:
    size = len(deformer.model.vertices)
    faps = np.random.default_rng(0).normal(0.0, 300.0, 68)
    out = np.zeros((size, 3), dtype=np.float32)
    deformer.chosen(np.zeros(0, dtype=np.intp)).local(faps, out)
    assert not out.any()
    deformer.chosen(np.arange(size)).local(faps, out)
    np.testing.assert_array_equal(out, deformer.local(faps))
