"""`encode` and `encode_stream`: the functions that encode an animation towards any goal."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, fields, replace
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.codec import EncoderOptions, EncoderStatistics, encode_animation
from fba.encoder_options import PRESETS, REFERENCE, Preset
from fba.errors import OptionError, did_you_mean, warn
from fba.face import FaceModel
from fba.planning._near_lossless import encode_within_tolerance
from fba.planning._plan import encode_planned
from fba.planning._tolerance import NearLossless, Tolerance

if TYPE_CHECKING:
    from fba.planning.fit_streams import FitStream
    from fba.planning.rate import ShownErrors


@dataclass(frozen=True)
class BitRate:
    """A mean rate that a stream keeps.

    bits_per_second: the rate. buffer: seconds of that rate by which the stream may be ahead at any time.
    """

    bits_per_second: float
    buffer: float = 1.0


Goal = Preset | Literal["fit"] | Tolerance | BitRate
"""How much of an animation is sent, and how finely; see `encode_stream`."""

_DECIDED: dict[type | str, tuple[tuple[str, ...], str]] = {
    Tolerance: (("fap_quant", "bap_quant", "unsent"), "a tolerance decides what is sent, and how finely"),
    BitRate: (
        ("fap_quant", "bap_quant", "unsent", "intra_period"),
        "a bit rate decides what is sent, how finely, and where I planes come",
    ),
    "fit": (("unsent",), "the interpolation table of the head decides what is sent"),
}
"""Encoder options that a goal decides itself, and the reason to give."""


@dataclass(frozen=True, eq=False)
class Encoded:
    """A stream, and what encoding it resulted in.

    data: the stream. statistics: counts of the encoder: planes, I planes, clamped values; at a bit rate, a
    `fba.planning.rate.RateStatistics`. options: how it was coded, with the quantisers that were chosen.
    left_out: number of frames that are not sent, since players fill them in.

    errors: of what a player shows. Within a tolerance a `NearLossless`, at a bit rate a
    `fba.planning.rate.ShownErrors`: both have `face` and `body`, whose `largest` is in metres. For the FIT of
    a head a `fba.planning.fit_streams.FitStream`. None for presets, which change values by rounding only.
    """

    data: bytes
    statistics: EncoderStatistics
    options: EncoderOptions
    left_out: int = 0
    errors: NearLossless | ShownErrors | FitStream | None = None


def encode(
    animation: Animation,
    options: EncoderOptions | None = None,
    *,
    preset: Preset | None = None,
    tolerance: float | Tolerance | None = None,
    bit_rate: float | None = None,
    **fields: Any,
) -> bytes:
    """Encode an animation as one FBA object, with ranges fitted to all of it.

    options: how to encode; or, in their place, fields of `EncoderOptions` as keywords, such as `fap_quant=4`.
    At most one of these decides what is sent; `encode_stream` describes them and measures what they lose:

    preset: "reference", "exact" or "compact"; default: that of the options.
    tolerance: metres by which vertices of the face may move; without a face, points beside the joints of the
        body, and half of it feet that stand. Or a `fba.planning.Tolerance`.
    bit_rate: bits a second.

    Raises OptionError for what is no animation, for an unknown option, and for options that contradict each
    other; RangeError for what the syntax cannot carry (see `EncoderOptions.clamp`) and for a tolerance or a
    bit rate out of reach; ValueError for an animation without frames and for an option with a wrong value.
    Gives an FbaWarning that names what was clamped.
    """
    _check_animation(animation)
    goal = _goal(animation, preset, tolerance, bit_rate)
    encoded = encode_stream(animation, _options(options, fields), goal)
    if not isinstance(goal, Tolerance):  # what a tolerance clamps stays within it
        _warn_of_clamped(encoded.statistics)
    return encoded.data


def encode_stream(
    animation: Animation,
    options: EncoderOptions | None = None,
    goal: Goal | None = None,
    *,
    model: FaceModel | None = None,
    keep_masks: Collection[str] = (),
    every_frame: bool = False,
) -> Encoded:
    """Encode an animation as one FBA object; return it with statistics and errors.

    goal: how much is sent, and how finely; default: the preset of the options.
        "reference": all that the animation sends.
        "exact", "compact": not what never moves; of FAPs, not what players derive (`encode_planned`).
        "fit": not what `model` computes by its FIT (`fba.planning.fit_streams.encode_with_fit`).
        a `Tolerance`: the smallest stream within it (`encode_within_tolerance`).
        a `BitRate`: the stream with the least errors at that rate (`fba.planning.rate.encode_at_rate`).
    model: for "compact" and "fit", the head that all receivers have; for a tolerance, the head that is
        measured, by default the built-in head.
    keep_masks: for presets: parts, "face" and "body", of which all parameters are sent.
    every_frame: for a tolerance: send all frames, for players that hold a frame until the next comes.

    Raises OptionError for what is no animation, and where goal and options contradict each other; else as the
    functions named above.
    """
    _check_animation(animation)
    options = options or EncoderOptions()
    goal = options.preset if goal is None else goal
    _check_goal(goal, options, model=model, keep_masks=keep_masks, every_frame=every_frame)
    options = replace(options, preset=REFERENCE)
    if isinstance(goal, Tolerance):
        data, near = encode_within_tolerance(animation, goal, options, model, every_frame=every_frame)
        options = replace(options, fap_quant=near.fap_quant, bap_quant=near.bap_quant)
        return Encoded(data, near.statistics, options, near.left_out, near)
    if isinstance(goal, BitRate):
        return _encode_at_rate(animation, options, goal)
    if goal == "fit":
        return _encode_with_fit(animation, options, model)
    if goal == REFERENCE:
        return Encoded(*encode_animation(animation, options), options)
    return Encoded(
        *encode_planned(animation, options, preset=goal, keep_masks=keep_masks, model=model), options
    )


def _encode_at_rate(animation: Animation, options: EncoderOptions, goal: BitRate) -> Encoded:
    """Return the stream at a bit rate."""
    from fba.planning.rate import encode_at_rate, measure_errors  # imported only for this goal

    rated = encode_at_rate(animation, goal.bits_per_second, goal.buffer, options)
    errors = measure_errors(animation, rated.shown)
    return Encoded(rated.data, rated.statistics, rated.options, rated.statistics.left_out, errors)


def _encode_with_fit(animation: Animation, options: EncoderOptions, model: FaceModel | None) -> Encoded:
    """Return the stream for a head with a FIT. OptionError without a head."""
    from fba.planning.fit_streams import encode_with_fit  # imported only for this goal

    if model is None:
        raise OptionError('the goal "fit" needs the head that all receivers have: give model=')
    fitted = encode_with_fit(animation, model, options)
    return Encoded(fitted.data, fitted.statistics, options, errors=fitted)


def _warn_of_clamped(statistics: EncoderStatistics) -> None:
    """Give the caller of `encode` an FbaWarning of clamped values, if there are any."""
    if statistics.clamped:
        most = sorted(statistics.clamped_parameters.items(), key=lambda pair: -pair[1].count)[:3]
        names = [
            f"{name} ({one.count}; frame {one.frame}: {one.value} sent as {one.sent})" for name, one in most
        ]
        more = len(statistics.clamped_parameters) - len(names)
        warn(
            f"values limited to what their ranges carry: {statistics.clamped}, of {', '.join(names)}"
            f"{f' and {more} parameters more' if more else ''}; a larger quantiser may carry them",
            stacklevel=3,
        )


def _check_animation(animation: object) -> None:
    """Raise OptionError for anything but an animation; it says how to get an animation."""
    if isinstance(animation, Animation):
        return
    if isinstance(animation, str) or hasattr(animation, "__fspath__"):
        raise OptionError(
            "an animation is encoded, not the name of a file; read the file first: "
            f"fba.encode(fba.read({animation!r}))"
        )
    kind = type(animation).__name__
    if isinstance(animation, FaceTrack | BodyTrack):
        part = "face" if isinstance(animation, FaceTrack) else "body"
        raise OptionError(
            f"an animation is encoded, not a {kind}, which has no times; make an animation of it: "
            f"fba.Animation(25, range(len({part})), {part}={part}), with its frames a second in place of 25"
        )
    raise OptionError(
        f"an animation is encoded, not {kind}; fba.read makes one of a file, and fba.Animation one of arrays"
    )


def _options(options: EncoderOptions | None, given: dict[str, Any]) -> EncoderOptions | None:
    """Return encoder options, which may be given by their fields instead."""
    if not given:
        return options
    names = ", ".join(given)
    if options is not None:
        raise OptionError(
            f"give either options or {names}, not both; to change the options: "
            f"dataclasses.replace(options, {next(iter(given))}=...)"
        )
    takes = [field.name for field in fields(EncoderOptions)] + ["tolerance", "bit_rate"]
    for name in given:
        if name not in takes:
            raise OptionError(
                f"there is no option {name!r} of encoding{did_you_mean(name, takes)}; it takes "
                f"{', '.join(takes)}"
            )
    return EncoderOptions(**given)


def _goal(
    animation: Animation, preset: Preset | None, tolerance: float | Tolerance | None, bit_rate: float | None
) -> Goal | None:
    """Return the goal that keywords of `encode` name; None for the preset of the options."""
    choices = {"preset": preset, "tolerance": tolerance, "bit_rate": bit_rate}
    given = [name for name, value in choices.items() if value is not None]
    if len(given) > 1:
        raise OptionError(f"{' and '.join(given)} contradict each other: each decides what is sent; give one")
    if preset is not None and preset not in PRESETS:
        raise OptionError(f"preset must be one of {', '.join(PRESETS)}, not {preset!r}")
    if isinstance(tolerance, Tolerance):
        return tolerance
    for name, value, unit in (
        ("tolerance", tolerance, "metres (0.0005 is half a millimetre), or a fba.planning.Tolerance"),
        ("bit_rate", bit_rate, "bits a second"),
    ):
        if value is not None and not isinstance(value, Real):
            raise OptionError(f"{name} is a number of {unit}; not {value!r}")
    if tolerance is not None:
        if animation.face is None:
            return Tolerance(joint=tolerance, foot=tolerance / 2)
        return Tolerance(face=tolerance)
    return preset if bit_rate is None else BitRate(bit_rate)


def _check_goal(
    goal: Goal,
    options: EncoderOptions,
    *,
    model: FaceModel | None,
    keep_masks: Collection[str],
    every_frame: bool,
) -> None:
    """Raise OptionError for an unknown goal, and for options that it decides itself or does not use."""
    preset = goal if isinstance(goal, str) else None
    if preset not in (None, "fit", *PRESETS):
        raise OptionError(
            f"goal must be one of {', '.join(PRESETS)}, fit, a Tolerance or a BitRate, not {preset!r}"
        )
    if options.preset not in (REFERENCE, goal):
        raise OptionError(
            f"preset={options.preset!r} in the options and {goal!r} contradict each other: each decides what "
            "is sent; give one"
        )
    decided, reason = _DECIDED.get(preset or type(goal), ((), ""))
    defaults = EncoderOptions()
    changed = [name for name in decided if getattr(options, name) != getattr(defaults, name)]
    if changed:
        raise OptionError(f"leave {' and '.join(changed)} as by default: {reason}")
    for name, given, takers in (
        ("model", model is not None, preset in ("compact", "fit") or isinstance(goal, Tolerance)),
        ("keep_masks", bool(keep_masks), preset in PRESETS),
        ("every_frame", every_frame, isinstance(goal, Tolerance)),
    ):
        if given and not takers:
            raise OptionError(f"{name} has no effect on the goal {goal!r}; leave it out")
