"""`EncoderOptions`: how an animation is encoded."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np

from fba.codec._plane import slots
from fba.codec.settings import QUANT_MAX
from fba.parameters import BAP_STEP_TABLES
from fba.presets import PRESETS, REFERENCE, Preset


@dataclass(frozen=True)
class EncoderOptions:
    """How to encode.

    fap_quant, bap_quant: 0..31. A FAP's quantiser step is the standard's table step times fap_quant, a
        BAP's the table step times bap_pred_scale[bap_quant]; 0 sends values unquantised. Default 1.
    intra_period: most seconds from one I plane to the next; None for I planes only where one is needed. An I
        plane that cannot carry the values of its frame is put off.
    start_codes: write a plane start code before every I plane after the first, and all ranges with each, so
        that a decoder can start there or resume after damage.
    time_codes: with start codes, also the time at which decoding goes on after damage: I planes come at
        whole seconds where the intra period allows it, and carry a time code there. Takes 18 bits each.
    bap_steps: "iso" or "visage", the table of BAP steps.
    mark: say behind the end of a stream, where other decoders do not read, which of these tables its BAPs are
        coded with (see `fba.codec.write_mark`); else a decoder must be told. Without a mark, a stream is the
        FBA object alone.
    checksums: with the mark, a CRC-32 of each I period, 4 bytes each and about 20 more, by which a decoder
        notices flipped bits that leave the syntax whole.
    preset: what is sent, of `fba.presets.PRESETS`. "reference": all that the animation sends. "exact" and
        "compact", which `fba.encode` and `fba.write` know: see `fba.planning`.
    unsent: what a decoder does with an unsent FAP, unless the animation says so itself
        (`FaceTrack.interpolated`): "keep" its last value (mask type 1) or "interpolate" it from others
        (mask type 2).
    gender: suggested_gender, 1 male.
    clamp: limit values that no range can carry to the codable range, instead of raising RangeError: I
        planes stop at the end of the widest range, and P planes after them catch up.

    Raises ValueError for any other value.
    """

    fap_quant: int = 1
    bap_quant: int = 1
    intra_period: Fraction | float | None = None
    start_codes: bool = False
    time_codes: bool = True
    bap_steps: str = "iso"
    mark: bool = True
    checksums: bool = True
    preset: Preset = REFERENCE
    unsent: Literal["keep", "interpolate"] = "keep"
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
            ("unsent", ("keep", "interpolate")),
            ("gender", (0, 1)),
        ):
            if getattr(self, name) not in allowed:
                choices = ", ".join(map(str, allowed))
                raise ValueError(f"{name} must be one of {choices}, not {getattr(self, name)!r}")

    def quant(self, part: int) -> int:
        """Return the quantiser of a part: `slots.FACE_BIT` or `slots.BODY_BIT`."""
        return self.fap_quant if part == slots.FACE_BIT else self.bap_quant
