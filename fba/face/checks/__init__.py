"""Checks of face models against the standard."""

from fba.face.checks.findings import Finding

__all__ = ["Finding"]
