"""Fixtures that every test may use."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared() -> Path:
    """Real-world material that may not be redistributed; tests that need it skip where it is absent."""
    path = Path(os.environ.get("FBA_SHARED") or Path(__file__).parents[2] / "shared")
    if not (path / "vectors" / "index.json").is_file():
        pytest.skip(f"no shared test material at {path}; set FBA_SHARED to its folder")
    return path
