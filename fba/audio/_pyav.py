"""The import of PyAV, from version 12 on, which encodes films and decodes sound."""

from __future__ import annotations

from typing import Any

from fba.errors import DisplayError


def import_av(purpose: str = "films need") -> Any:
    """Return the module `av`; DisplayError without it. purpose: the beginning of its message."""
    try:
        import av
    except ImportError as error:
        raise DisplayError(
            f"{purpose} the Python package av (PyAV), which cannot be imported: {error}. "
            'Install it with: pip install "mpeg4-fba[films]"'
        ) from error
    return av


def av_version(av: Any) -> int:
    """Return the major version of PyAV."""
    return int(av.__version__.split(".")[0])
