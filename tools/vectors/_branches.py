"""Both outcomes of every branch of the independent decoder, and which of them a stream takes.

A branch is an `if`, `while` or `for`. Its name is its function and its source text, so that it stays the same
when lines move.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any

from fba_conformance import trace

_MODULES = ("trace", "_reader", "_part", "_textbook")
_OTHERS = ("encode_segment", "put", "FrequencyTable.share", "planes")
"""Functions of these modules that only a writer calls, and one that only calls the decoder."""
_ENDS = -1
"""Instead of a line: the function returns."""


@dataclass(frozen=True)
class _Branch:
    """A branch: its name, and the first line of its function and the lines of its condition."""

    name: str
    function: int
    lines: range
    guarded: int
    """The first line of what it guards."""

    def outcome(self, line: int) -> str | None:
        """Return the name of an outcome, from the line that follows the condition; None within it."""
        if line in self.lines and line != self.guarded:
            return None
        return f"{self.name}: {'yes' if line == self.guarded else 'no'}"


def all_branches() -> list[str]:
    """Return the names of both outcomes of all branches."""
    names: dict[str, None] = {}
    for branches in _branches().values():
        for branch in branches:
            names[f"{branch.name}: yes"] = None
            names[f"{branch.name}: no"] = None
    return list(names)


@contextmanager
def observed() -> Iterator[Callable[[], set[str]]]:
    """Observe the branches that are taken; yield a function that returns their names afterwards."""
    tables = {path: _by_line(branches) for path, branches in _branches().items()}
    functions = {(path, one.function) for path, branches in _branches().items() for one in branches}
    steps: set[tuple[str, int, int]] = set()

    def observe(frame: FrameType, event: str, argument: Any) -> Any:
        path = frame.f_code.co_filename
        if (path, frame.f_code.co_firstlineno) not in functions:
            return None
        table = tables[path]
        last = 0

        def step(frame: FrameType, event: str, argument: Any) -> Any:
            nonlocal last
            if event == "line":
                line = frame.f_lineno
                if last in table:
                    steps.add((path, last, line))
                last = line
            elif event == "return":
                if last in table:
                    steps.add((path, last, _ENDS))
            else:  # an exception: the condition had no outcome
                last = 0
            return step

        return step

    def taken() -> set[str]:
        names = (tables[path][last].outcome(line) for path, last, line in steps)
        return {name for name in names if name is not None}

    before = sys.gettrace()
    sys.settrace(observe)
    try:
        yield taken
    finally:
        sys.settrace(before)


def _by_line(branches: list[_Branch]) -> dict[int, _Branch]:
    return {line: branch for branch in branches for line in branch.lines}


@cache
def _branches() -> dict[str, list[_Branch]]:
    """Return the branches of each module, by the path of its file."""
    folder = Path(trace.__file__).parent
    result = {}
    for name in _MODULES:
        path = folder / f"{name}.py"
        source = path.read_text(encoding="utf-8")
        result[str(path)] = list(_find(ast.parse(source), source, "", 0))
    return result


def _find(node: ast.AST, source: str, scope: str, first: int) -> Iterator[_Branch]:
    """Yield the branches in a node. scope: its class and function; first: the function's first line."""
    for child in ast.iter_child_nodes(node):
        inside, line = scope, first
        if isinstance(child, (ast.ClassDef, ast.FunctionDef)):
            inside = f"{scope}.{child.name}" if scope and isinstance(node, ast.ClassDef) else child.name
            if inside in _OTHERS:
                continue
            line = min([child.lineno, *(one.lineno for one in child.decorator_list)])
        elif isinstance(child, (ast.If, ast.While, ast.For)) and scope:
            condition = child.iter if isinstance(child, ast.For) else child.test
            if not isinstance(condition, ast.Constant):
                text = " ".join((ast.get_source_segment(source, condition) or "").split())
                if isinstance(child, ast.For):
                    text = f"{ast.unparse(child.target)} in {text}"
                lines = range(child.lineno, (condition.end_lineno or child.lineno) + 1)
                name = f"{scope}: {type(child).__name__.lower()} {text}"
                yield _Branch(name, first, lines, child.body[0].lineno)
        yield from _find(child, source, inside, line)
