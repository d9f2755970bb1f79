"""Checks of face models against the standard."""

from fba.face.checks._fap_checks import check_faps
from fba.face.checks._findings import Finding
from fba.face.checks._neutral import check_neutral

__all__ = ["Finding", "check_faps", "check_neutral"]
