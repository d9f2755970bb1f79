"""An index of two short performances, drawn once."""

import pytest

from fba.outlines import Choice, Index, build_index
from outlined import nodding, raising


@pytest.fixture(scope="session")
def index() -> Index:
    return build_index([("raising", raising()), ("nodding", nodding())], Choice(views=8, every=1))
