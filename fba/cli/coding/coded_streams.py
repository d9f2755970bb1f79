"""Streams as `fba encode` makes them, and what it says of them."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fba.animation import Animation
from fba.cli.clamped_values import clamped_values
from fba.cli.coding.fit_options import encode_for_head, fit_lines, fit_values
from fba.cli.coding.rate_options import HeldRate, encode_held, rate_lines, rate_values
from fba.cli.coding.size_options import Size
from fba.cli.coding.tolerance_options import encode_near, tolerance_lines, tolerance_values
from fba.cli.inputs import input_file, read_model
from fba.cli.outputs import display_name
from fba.cli.printing import rate_text, seconds_text
from fba.errors import FbaWarning
from fba.limits import Limits

if TYPE_CHECKING:
    from fba.cli.recordings.inputs import Inputs
    from fba.codec import ClampedParameter, EncoderOptions
    from fba.face.model import FaceModel
    from fba.planning import NearLossless
    from fba.planning.fit_streams import FitStream


@dataclass(frozen=True, eq=False)
class CodedStream:
    """A stream, and what it took.

    clamped: parameters with values that no plane could carry, by label. bap_quant: the largest of any plane;
    0 if BAPs are unquantised. rounded: values of FAP and BAP files that no stream carries as they are. near,
    held: how near it is to its source, and how it held to a bit rate, if that was asked for.
    """

    data: bytes
    planes: int
    intra_planes: int
    clamped: dict[str, ClampedParameter]
    bap_quant: int
    rounded: int = 0
    near: NearLossless | None = None
    held: HeldRate | None = None
    fit: FitStream | None = None

    @property
    def clamped_count(self) -> int:
        """Values that no plane could carry."""
        return sum(one.count for one in self.clamped.values())

    def bits_per_second(self, animation: Animation) -> float:
        """Return the rate of the stream of this animation."""
        return 8 * len(self.data) / float(animation.duration)

    def figures(self, animation: Animation) -> dict[str, Any]:
        """Return what is said of the stream of this animation, for programs."""
        return {
            "size": len(self.data),
            "frames": self.planes,
            "intra_planes": self.intra_planes,
            "rate": str(animation.rate),
            "duration": float(animation.duration),
            "bits_per_second": round(self.bits_per_second(animation), 3),
            "rounded": self.rounded,
            "clamped": self.clamped_count,
            "clamped_parameters": clamped_values(self.clamped),
            **({"tolerance": tolerance_values(self.near)} if self.near is not None else {}),
            **({"bitrate": rate_values(self.held)} if self.held is not None else {}),
            **({} if self.fit is None else {"fit": fit_values(self.fit)}),
        }

    def details(self, animation: Animation) -> list[str]:
        """Return what else is said of the stream of this animation: how near it is to its source."""
        if self.held is not None:
            return rate_lines(self.held)
        if self.fit is not None:
            return fit_lines(self.fit)
        return tolerance_lines(self.near, animation) if self.near is not None else []

    def summary(self, output: Path, animation: Animation) -> str:
        """Return the same in one line. output: its file."""
        text = (
            f"{display_name(output)}: {self.planes} frames, {seconds_text(animation.duration)} at "
            f"{rate_text(animation.rate)} frames/s, {len(self.data)} bytes, "
            f"{self.bits_per_second(animation) / 1000:.2f} kbit/s, "
            f"{self.intra_planes} I plane{'s' if self.intra_planes != 1 else ''}"
        )
        for count, how in ((self.rounded, "rounded to quantiser steps"), (self.clamped_count, "clamped")):
            if count:
                text += f"; {count} value{'s' if count != 1 else ''} {how}"
        return text


def encode_stream(animation: Animation, options: EncoderOptions, size: Size, inputs: Inputs) -> CodedStream:
    """Return the stream of an animation.

    options: with quantisers as `size` says. inputs: where the animation comes from.
    """
    from fba.planning import hold_still

    if _is_held_still(size, inputs):
        animation = hold_still(animation, options)
    if size.fit is not None:
        made = encode_for_head(animation, options, size.fit)
        counts = made.statistics
        return CodedStream(
            made.data,
            counts.planes,
            counts.intra_planes,
            counts.clamped_parameters,
            options.bap_quant,
            fit=made,
        )
    if size.tolerance is not None or size.body_tolerance is not None:
        data, near = encode_near(
            animation, options, size.tolerance, size.body_tolerance, size.model, every_frame=size.every_frame
        )
        counts = near.statistics
        return CodedStream(
            data, counts.planes, counts.intra_planes, counts.clamped_parameters, near.bap_quant, near=near
        )
    if size.bitrate is not None:
        data, held = encode_held(animation, options, size.bitrate, size.buffer)
        own = held.statistics
        return CodedStream(data, own.planes, own.intra_planes, own.clamped_parameters, held.quant, held=held)
    return _encode_as_preset(animation, options, size, inputs)


def _is_held_still(size: Size, inputs: Inputs) -> bool:
    """Whether levels of BAPs are those of `hold_still`."""
    if size.tolerance is not None or size.body_tolerance is not None or size.bitrate is not None:
        return False  # these choose levels of their own
    captured = "body" in inputs.formats and inputs.formats["body"].is_capture
    return captured if size.still is None else size.still


def _encode_as_preset(
    animation: Animation, options: EncoderOptions, size: Size, inputs: Inputs
) -> CodedStream:
    """Return the stream of an animation as a preset has it: `--preset`, or what fits where it comes from."""
    from fba.codec import count_rounded, encode_with_statistics, exact_quantisers
    from fba.planning import encode_planned

    model = _read_model_with_fit(size.model)
    preset = size.preset or ("compact" if inputs.has_captured_face or size.model is not None else "exact")
    kept = inputs.text_parts
    rounded: dict[str, int] = {}
    if preset == "exact":
        given = {"face": size.fap_quant, "body": size.bap_quant}
        to_keep = [part for part in kept if given[part] is None and not (part == "body" and size.still)]
        options = exact_quantisers(animation, options, to_keep)
        rounded = {part: n for part, n in count_rounded(animation, options).items() if part in to_keep}
    if preset == "reference":
        data, statistics = encode_with_statistics(animation, options)
    else:
        data, statistics = encode_planned(animation, options, preset=preset, keep_masks=kept, model=model)
    return CodedStream(
        data,
        statistics.planes,
        statistics.intra_planes,
        statistics.clamped_parameters,
        options.bap_quant,
        sum(rounded.values()),
    )


def _read_model_with_fit(path: Path | None) -> FaceModel | None:
    """Return the face of `--model`; None without one. Warns (FbaWarning) of one without a FIT."""
    model = read_model(path)
    if model is not None and model.fit is None:
        warnings.warn(
            f"{path} has no interpolation table (FIT), which would give FAPs that are not sent; the stream "
            "is that without this model",
            FbaWarning,
            stacklevel=2,
        )
    return model


def encode_as_epf(
    epf: Path, animation: Animation, table: str, limits: Limits, *, marked: bool
) -> CodedStream:
    """Return the stream of an animation, coded plane by plane as an EPF file says.

    table: of BAP steps. marked: whether the stream names it.
    """
    from fba.codec import encode_planes, write_mark
    from fba.formats.epf.epf import read_epf

    with input_file(epf) as file:
        planes = read_epf(file, limits=limits)
    data = encode_planes(animation, planes, bap_steps=table)
    quant = max((plane.body.quant for plane in planes if plane.body is not None), default=0)
    if marked and quant:
        data += write_mark(table)
    return CodedStream(data, len(planes), sum(plane.intra for plane in planes), {}, quant)
