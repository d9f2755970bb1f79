"""The findings of checks of a face model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Finding:
    """One deviation of a model from the standard.

    subject: what it is about ("FAP 19 close_t_l_eyelid", "feature point 2.2"). rule: the rule that is
    broken, in a few words. found, expected: the measured and the wanted value, with units.
    severity: "error" where the model would play wrongly, "warning" where it merely looks odd.
    """

    subject: str
    rule: str
    found: str
    expected: str
    severity: Literal["error", "warning"] = "error"

    def __str__(self) -> str:
        return f"{self.severity}: {self.subject}: {self.rule}: found {self.found}, expected {self.expected}"
