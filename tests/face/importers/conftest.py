"""A small head that tests of importers give shapes to, or take apart."""

import pytest

from fba.face import FaceModel
from small_head import authored_head


@pytest.fixture(scope="session")
def base() -> FaceModel:
    return authored_head()
