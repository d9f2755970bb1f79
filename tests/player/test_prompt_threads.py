"""Turns of threads while a film is encoded."""

from __future__ import annotations

import sys

import pytest

from player.prompt_threads import prompt_threads


@pytest.fixture(autouse=True)
def own_interval() -> object:
    before = sys.getswitchinterval()
    sys.setswitchinterval(0.004)
    yield
    sys.setswitchinterval(before)


def test_turns_are_short_until_the_last_user_is_done() -> None:
    outer, inner = prompt_threads(), prompt_threads()
    with outer:
        with inner:
            assert sys.getswitchinterval() < 0.001
        assert sys.getswitchinterval() < 0.001
    assert sys.getswitchinterval() == pytest.approx(0.004, abs=2e-6)


def test_an_error_gives_the_old_turns_back() -> None:
    with pytest.raises(RuntimeError), prompt_threads():
        raise RuntimeError
    assert sys.getswitchinterval() == pytest.approx(0.004, abs=2e-6)


def test_shorter_turns_stay() -> None:
    sys.setswitchinterval(0.0001)
    with prompt_threads():
        assert sys.getswitchinterval() == pytest.approx(0.0001, abs=2e-6)
