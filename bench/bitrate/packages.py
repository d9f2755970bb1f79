"""Packages that the study uses and that fba does not need otherwise."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from fba.errors import OptionError

EXTRA = 'pip install "mpeg4-fba[bench]"'


def find_package(name: str) -> ModuleType | None:
    """Return a module, None where its package is not installed."""
    try:
        return import_module(name)
    except ImportError:
        return None


def require_package(name: str, purpose: str) -> ModuleType:
    """Return a module; OptionError that says how to install its package where it is missing."""
    module = find_package(name)
    if module is None:
        raise OptionError(f"{purpose} needs the package {name}, which is not installed: {EXTRA}")
    return module


def find_zstd() -> ModuleType | None:
    """Return zstandard; None where it is not installed."""
    return find_package("zstandard")
