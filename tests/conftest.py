"""Fixtures that every test may use."""

import gc
import os
import signal
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

import graphics
from ready_programs import ready_programs

HERE = Path(__file__).parent


def pytest_configure() -> None:
    """Let Hypothesis take any time, as machines are slow; look for garbage less often, which saves 4 % of it.

    Not as rarely as the program does (`fba.cli.startup`): errors keep their decoder, and tests of damage make
    thousands, which filled 9 GB.
    """
    settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile("any machine")
    gc.set_threshold(2_000)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the files of this folder, which have the longest tests: pages of the docs, installations.

    At the end of a run, then, no worker waits long for the other.
    """
    items.sort(key=lambda item: item.path.parent != HERE)


def pytest_collection_finish() -> None:
    """Never look through what stays for all tests."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def programs() -> Iterator[Path]:
    """A folder with `fba` and `python` that start at once."""
    with ready_programs() as folder:
        yield folder


@pytest.fixture(scope="session")
def opengl() -> None:
    """OpenGL works without a display here."""
    reason = graphics.missing_opengl()
    if reason is not None:
        graphics.skip(reason)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Says how many tests were skipped for lack of OpenGL or a display, once for each reason."""
    reasons = [
        report.longrepr[2].partition(graphics.MARK)[2]
        for report in terminalreporter.stats.get("skipped", [])
        if isinstance(report.longrepr, tuple) and graphics.MARK in report.longrepr[2]
    ]
    for reason, count in Counter(reasons).most_common():
        terminalreporter.write_line(f"skipped {count}: {reason}")


@pytest.fixture(scope="session")
def shared() -> Path:
    """Real-world material that may not be redistributed; tests that need it skip where it is absent."""
    path = Path(os.environ.get("FBA_SHARED") or Path(__file__).parents[2] / "shared")
    if not (path / "vectors" / "index.json").is_file():
        pytest.skip(f"no shared test material at {path}; set FBA_SHARED to its folder")
    return path


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Let programs be interrupted in the background, too, where they ignore Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
