"""`EncoderOptions`: how an animation is encoded."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Final, Literal, get_args

import numpy as np

from fba.choices import Unsent
from fba.parameters import BAP_STEP_TABLES, BapTable

PlannedPreset = Literal["exact", "compact"]
"""Without parameters that never move, and FAPs that players derive from others. See `fba.planning`."""
Preset = Literal["reference", PlannedPreset]
"""Which parameters of an animation a stream sends; docs/encode.md compares them."""
REFERENCE: Final = "reference"
"""All parameters that the animation sends."""
PLANNED: tuple[PlannedPreset, ...] = ("exact", "compact")
PRESETS: tuple[Preset, ...] = (REFERENCE, *PLANNED)
QUANT_MAX = 31
"""Largest quantiser."""


@dataclass(frozen=True)
class EncoderOptions:
    """How to encode.

    fap_quant: quantiser of FAPs, 0..31: the standard's step times this is a step of the stream; 0:
        unquantised.
    bap_quant: quantiser of BAPs, 0..31: the table's step times bap_pred_scale[bap_quant] is a step of the
        stream; 0: unquantised.
    intra_period: most seconds from one I plane to the next; without it, I planes come only where one is
        needed. An I plane that cannot carry the values of its frame is put off.
    start_codes: write a plane start code before every I plane after the first, and all ranges in it, so that
        a decoder can start there or resume after damage.
    time_codes: with start codes, also write time codes, by which a decoder knows the time after damage: I
        planes come at whole seconds if the intra period allows it, with a time code of 18 bits.
    bap_steps: table of BAP steps: the standard's, or one vendor's, which is finer.
    mark: write checksums, and of a body the table of BAP steps, behind the end of the stream, where other
        decoders do not read; else the stream is the FBA object alone, and a decoder must be told the table.
    checksums: with the mark, a CRC-32 of each I period, 4 bytes each and about 20 more, by which a decoder
        notices flipped bits that leave the syntax whole.
    preset: what is sent: all that the animation sends (reference); without parameters that never move
        (exact); also without FAPs that players derive from others (compact).
    unsent: what a decoder does with a FAP that is not sent, unless the animation says so: keep its last value
        (mask type 1), or interpolate it from others (mask type 2).
    gender: suggested_gender, 1 male.
    clamp: limit values to the codable range instead of failing: I planes stop at the end of the widest range,
        and P planes after them catch up.

    `fba.encode` and `fba.write` take all presets, `fba.codec.encode_animation` takes "reference" alone.

    Raises ValueError for any other value.
    """

    fap_quant: int = 1
    bap_quant: int = 1
    intra_period: Fraction | float | None = None
    start_codes: bool = False
    time_codes: bool = True
    bap_steps: BapTable = "iso"
    mark: bool = True
    checksums: bool = True
    preset: Preset = REFERENCE
    unsent: Unsent = "keep"
    gender: int = 0
    clamp: bool = False

    def __post_init__(self) -> None:
        for name in ("fap_quant", "bap_quant"):
            value = getattr(self, name)
            if not isinstance(value, (int, np.integer)) or not 0 <= value <= QUANT_MAX:
                raise ValueError(f"{name} must be an integer in 0..{QUANT_MAX}, not {value!r}")
        if self.intra_period is not None and not (self.intra_period > 0 and math.isfinite(self.intra_period)):
            raise ValueError(f"intra_period must be a positive number of seconds, not {self.intra_period!r}")
        for name, allowed in (
            ("bap_steps", BAP_STEP_TABLES),
            ("preset", PRESETS),
            ("unsent", get_args(Unsent)),
            ("gender", (0, 1)),
        ):
            if getattr(self, name) not in allowed:
                choices = ", ".join(map(str, allowed))
                raise ValueError(f"{name} must be one of {choices}, not {getattr(self, name)!r}")
