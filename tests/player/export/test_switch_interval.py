"""Turns of threads while a film is encoded."""

from __future__ import annotations

import sys

import pytest

from fba_player.export.recorder import PROMPT_THREADS, PromptThreads


class Interpreter:
    """Seconds of a turn, as an interpreter has them."""

    def __init__(self, turn: float) -> None:
        self.turn = turn

    def prompt(self) -> PromptThreads:
        def change(turn: float) -> None:
            self.turn = turn

        return PromptThreads(lambda: self.turn, change)


def test_turns_are_short_until_the_last_user_is_done() -> None:
    python = Interpreter(0.005)
    prompt = python.prompt()
    with prompt:
        with prompt:
            assert python.turn < 0.001
        assert python.turn < 0.001
    assert python.turn == 0.005
    with prompt:
        assert python.turn < 0.001


def test_an_error_gives_the_old_turns_back() -> None:
    python = Interpreter(0.005)
    with pytest.raises(RuntimeError), python.prompt():
        raise RuntimeError
    assert python.turn == 0.005


def test_shorter_turns_stay() -> None:
    python = Interpreter(0.0001)
    with python.prompt():
        assert python.turn == 0.0001


def test_it_is_python_s_own_turns() -> None:
    with PROMPT_THREADS:
        assert sys.getswitchinterval() < 0.001
