"""What makes the `fba` command start and end sooner: its own process, not one that uses the library."""

from __future__ import annotations

import atexit
import gc
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any

WITHOUT = {"numba.np.arraymath": "scipy.linalg", "numba.core.typing.cffi_utils": "cffi"}
"""Modules of numba, and what each imports in vain: for one function of statistics (cov), and for what a C
compiler made. Both do without where it is missing; no loop here needs it, and each takes a tenth of a second
to import."""
MANY, OFTEN = 20_000, 15
"""Objects that the garbage collector lets pass before it looks for cycles, and how often it does not look
at all: what a start makes stays anyway. Python's own 700 is for programs that import less."""


def hasten() -> None:
    """Prepare this process for one command: call it before anything large is imported."""
    _let_pass()
    # At the end, Python looks through all objects for cycles, several times, although the memory goes anyway.
    atexit.register(gc.freeze)
    sys.meta_path.insert(0, _Finder())


def _let_pass() -> None:
    usual, passed = gc.get_threshold(), 0

    def freeze(phase: str, _about: object) -> None:
        nonlocal passed
        if phase != "start":
            return
        gc.freeze()  # takes no time, and leaves nothing to look at
        passed += 1
        if passed == OFTEN:
            gc.callbacks.remove(freeze)
            gc.set_threshold(*usual)

    gc.callbacks.append(freeze)
    gc.set_threshold(MANY, *usual[1:])


class _Finder:
    """Finds the modules of `WITHOUT` where Python does, with another way to load them."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname not in WITHOUT or WITHOUT[fullname] in sys.modules:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.loader is not None:
            spec.loader = _Without(spec.loader, WITHOUT[fullname])  # type: ignore[assignment]  # importlib.abc is slow
        return spec


class _Without:
    """Loads a module as another loader does, in whose sight a second module is missing."""

    def __init__(self, loader: Any, missing: str) -> None:
        self._loader = loader
        self._missing = missing

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        module: ModuleType | None = self._loader.create_module(spec)
        return module

    def exec_module(self, module: ModuleType) -> None:
        if module.__spec__ is not None:
            module.__loader__ = module.__spec__.loader = self._loader
        sys.modules[self._missing] = None  # type: ignore[assignment]  # documented: "cannot be found"
        try:
            self._loader.exec_module(module)
        finally:
            del sys.modules[self._missing]
