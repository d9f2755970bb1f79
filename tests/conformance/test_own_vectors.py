"""The vectors that come with fba: complete, reproducible, and passed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fba_conformance._cases import cases
from fba_conformance.generate import generate
from fba_conformance.runner import OWN, check, vectors


def test_the_committed_vectors_are_those_that_the_generator_makes(tmp_path: Path) -> None:
    generate(tmp_path)
    names = sorted(path.name for path in OWN.iterdir())
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    for name in names:
        assert (tmp_path / name).read_bytes() == (OWN / name).read_bytes(), name


@pytest.mark.parametrize("vector", vectors(), ids=lambda vector: vector.name)
def test_vector(vector: object) -> None:
    result = check(vector)  # type: ignore[arg-type]
    assert result.passed, result.line()


def test_every_case_says_what_it_tests() -> None:
    said = [case.tests for case in cases()]
    assert all(said)
    assert len(set(said)) == len(said)
    assert len(json.loads((OWN / "index.json").read_text())) == len(said)
