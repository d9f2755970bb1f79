"""An archive of four performances, made once."""

from pathlib import Path

import pytest

pytest.importorskip("pyarrow")

import archived


@pytest.fixture(scope="session")
def takes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return archived.write_folder(tmp_path_factory.mktemp("takes"))


@pytest.fixture(scope="session")
def archive(takes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("archive")
    reports = archived.make(takes, folder)
    assert [report.error for report in reports] == [""] * 4
    return folder
