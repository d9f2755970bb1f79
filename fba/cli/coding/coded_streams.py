"""Streams of `fba encode`, and reports about them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from fba.animation import Animation
from fba.cli.coding.clamped_values import clamped_values
from fba.cli.coding.rate_options import KeptRate, rate_lines, rate_values
from fba.cli.coding.size_options import Size
from fba.cli.coding.tolerance_options import tolerance_in_metres, tolerance_lines, tolerance_values
from fba.cli.inputs import input_file, read_model
from fba.cli.outputs import display_name
from fba.cli.printing import rate_text, seconds_text
from fba.encoder_options import PRESETS
from fba.errors import warn
from fba.limits import Limits
from fba.parameters import BapTable

if TYPE_CHECKING:
    from fba.cli.recordings.inputs import Inputs
    from fba.codec import ClampedParameter, EncoderOptions
    from fba.face import FaceModel
    from fba.planning import Encoded, Goal
    from fba.planning.fit_streams import FitStream
    from fba.planning.rate import RateStatistics


@dataclass(frozen=True, eq=False)
class CodedStream:
    """A stream and its report.

    rounded: count of values of FAP and BAP files that the stream does not carry exactly. values, lines:
    errors of the stream, for programs and for people; empty for presets.
    """

    encoded: Encoded
    rounded: int = 0
    values: Mapping[str, Any] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)

    @property
    def data(self) -> bytes:
        """The stream."""
        return self.encoded.data

    @property
    def clamped(self) -> dict[str, ClampedParameter]:
        """Parameters with values that no plane could carry, by label."""
        return self.encoded.statistics.clamped_parameters

    @property
    def bap_quant(self) -> int:
        """The largest quantiser of BAPs of any plane; 0 if they are unquantised."""
        return self.encoded.options.bap_quant

    def bits_per_second(self, animation: Animation) -> float:
        """Return the rate of the stream of this animation."""
        return 8 * len(self.data) / float(animation.duration)

    def figures(self, animation: Animation) -> dict[str, Any]:
        """Return the report about the stream of this animation, for programs."""
        counts = self.encoded.statistics
        return {
            "size": len(self.data),
            "frames": counts.planes,
            "intra_planes": counts.intra_planes,
            "rate": str(animation.rate),
            "duration": float(animation.duration),
            "bits_per_second": round(self.bits_per_second(animation), 3),
            "rounded": self.rounded,
            "clamped": counts.clamped,
            "clamped_parameters": clamped_values(self.clamped),
            **self.values,
        }

    def summary(self, output: Path, animation: Animation) -> str:
        """Return the report in a line. output: the file of the stream."""
        counts = self.encoded.statistics
        text = (
            f"{display_name(output)}: {counts.planes} frames, {seconds_text(animation.duration)} at "
            f"{rate_text(animation.rate)} frames/s, {len(self.data)} bytes, "
            f"{self.bits_per_second(animation) / 1000:.2f} kbit/s, "
            f"{counts.intra_planes} I plane{'s' if counts.intra_planes != 1 else ''}"
        )
        for count, how in ((self.rounded, "rounded to quantiser steps"), (counts.clamped, "clamped")):
            if count:
                text += f"; {count} value{'s' if count != 1 else ''} {how}"
        return text


def encode_stream(animation: Animation, options: EncoderOptions, size: Size, inputs: Inputs) -> CodedStream:
    """Return the stream of an animation.

    options: with the quantisers of `size`. inputs: of which the animation was made.
    """
    from fba.planning import encode_stream, hold_still

    if _is_held_still(size, inputs):
        animation = hold_still(animation, options)
    goal, rounded = _goal(animation, size, inputs), 0
    if goal == "exact":
        options, rounded = _keep_values(animation, options, size, inputs)
    encoded = encode_stream(
        animation,
        options,
        goal,
        model=_read_head(size, goal),
        keep_masks=inputs.text_parts if goal in PRESETS else (),
        every_frame=size.every_frame,
    )
    return CodedStream(encoded, rounded, *_errors(encoded, goal, animation))


def _goal(animation: Animation, size: Size, inputs: Inputs) -> Goal:
    """Return the goal of encoding: that of the options, or the preset that fits the inputs."""
    from fba.planning import BitRate

    if size.fit is not None:
        return "fit"
    if size.tolerance is not None or size.body_tolerance is not None:
        return tolerance_in_metres(animation, size.tolerance, size.body_tolerance)
    if size.bit_rate is not None:
        return BitRate(size.bit_rate, size.buffer)
    if size.preset is not None:
        return size.preset
    return "compact" if inputs.has_captured_face or size.model is not None else "exact"


def _read_head(size: Size, goal: Goal) -> FaceModel | None:
    """Return the head that an option names, or None. Warns (FbaWarning) of a head without a FIT."""
    model = read_model(size.fit if goal == "fit" else size.model)
    if goal == "compact" and model is not None and model.fit is None:
        warn(
            f"{size.model} has no interpolation table (FIT), which would give FAPs that are not sent; the "
            "stream is that without this model",
            stacklevel=2,
        )
    return model


def _keep_values(
    animation: Animation, options: EncoderOptions, size: Size, inputs: Inputs
) -> tuple[EncoderOptions, int]:
    """Return options that keep the values of FAP and BAP files, and the count of values that are rounded."""
    from fba.codec import count_rounded, exact_quantisers

    given = {"face": size.fap_quant, "body": size.bap_quant}
    kept = [part for part in inputs.text_parts if given[part] is None and not (part == "body" and size.still)]
    options = exact_quantisers(animation, options, kept)
    counts = count_rounded(animation, options)
    return options, sum(count for part, count in counts.items() if part in kept)


def _errors(encoded: Encoded, goal: Goal, animation: Animation) -> tuple[dict[str, Any], list[str]]:
    """Return the errors of a stream, for programs and for people."""
    from fba.planning import BitRate, NearLossless
    from fba.planning.fit_streams import FitStream

    errors = encoded.errors
    if isinstance(errors, NearLossless):
        return {"tolerance": tolerance_values(errors)}, tolerance_lines(errors, animation)
    if isinstance(errors, FitStream):
        return {"fit": _fit_values(errors)}, _fit_lines(errors)
    if isinstance(goal, BitRate):
        counts, quant = cast("RateStatistics", encoded.statistics), encoded.options.fap_quant
        kept = KeptRate(goal.bits_per_second, goal.buffer, counts, quant, errors)
        return {"bitrate": rate_values(kept)}, rate_lines(kept)
    return {}, []


def _fit_values(made: FitStream) -> dict[str, Any]:
    """Return the FAPs that are sent and the errors of the head, for programs; lengths in mm."""
    errors = made.errors
    millimetres = {"mean": errors.mean, "percentile_99": errors.percentile_99, "largest": errors.largest}
    return {"sent": list(made.sent), "added": list(made.added), "millimetres": millimetres}


def _fit_lines(made: FitStream) -> list[str]:
    """Return the FAPs that are sent and the errors of the head, for people."""
    added = f", {len(made.added)} of them as the head would miss them" if made.added else ""
    return [
        f"face: {len(made.sent)} FAPs sent{added}; the head computes the others",
        f"face: worst vertex of each frame {made.errors.text()}",
    ]


def _is_held_still(size: Size, inputs: Inputs) -> bool:
    """Whether `hold_still` chooses the levels of BAPs."""
    if (size.tolerance, size.body_tolerance, size.bit_rate) != (None, None, None):
        return False  # these choose levels themselves
    captured = "body" in inputs.formats and inputs.formats["body"].is_capture
    return captured if size.still is None else size.still


def encode_as_epf(
    epf: Path, animation: Animation, table: BapTable, limits: Limits, *, marked: bool
) -> CodedStream:
    """Return the stream of an animation, coded plane by plane by an EPF file.

    table: of BAP steps. marked: whether the stream names it.
    """
    from fba.codec import EncoderOptions, EncoderStatistics, encode_planes, write_mark
    from fba.formats.epf.epf import read_epf
    from fba.planning import Encoded

    with input_file(epf) as file:
        planes = read_epf(file, limits=limits)
    data = encode_planes(animation, planes, bap_steps=table)
    quant = max((plane.body.quant for plane in planes if plane.body is not None), default=0)
    if marked and quant:
        data += write_mark(table)
    counts = EncoderStatistics(len(planes), sum(plane.intra for plane in planes))
    return CodedStream(Encoded(data, counts, EncoderOptions(bap_quant=quant, bap_steps=table)))
