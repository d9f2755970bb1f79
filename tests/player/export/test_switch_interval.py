"""Turns of threads while a film is encoded."""

from __future__ import annotations

import sys

import pytest

from fba_player.export._recorder import PROMPT_THREADS, PromptThreads


class Interpreter:
    """Seconds of a turn, as an interpreter has them."""

    def __init__(self, turn: float) -> None:
        self.turn = turn

    def prompt(self) -> PromptThreads:
        def change(turn: float) -> None:
            self.turn = turn

        return PromptThreads(lambda: self.turn, change)


def test_the_interval_is_short_until_the_last_user_leaves() -> None:
    python = Interpreter(0.005)
    prompt = python.prompt()
    with prompt:
        with prompt:
            assert python.turn < 0.001
        assert python.turn < 0.001
    assert python.turn == 0.005
    with prompt:
        assert python.turn < 0.001


def test_an_error_restores_the_old_interval() -> None:
    python = Interpreter(0.005)
    with pytest.raises(RuntimeError), python.prompt():
        raise RuntimeError
    assert python.turn == 0.005


def test_shorter_turns_stay() -> None:
    python = Interpreter(0.0001)
    with python.prompt():
        assert python.turn == 0.0001


def test_the_switch_interval_is_that_of_the_process() -> None:
    with PROMPT_THREADS:
        assert sys.getswitchinterval() < 0.001
