"""Checks of face models against the standard."""

from fba.face.checks._findings import Finding
from fba.face.checks._neutral import check_neutral
from fba.face.checks.fap_checks import check_faps

__all__ = ["Finding", "check_faps", "check_neutral"]
