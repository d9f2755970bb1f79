"""Checks of face models against the standard."""

from fba.face.checks.findings import Finding
from fba.face.checks.neutral import check_neutral

__all__ = ["Finding", "check_neutral"]
