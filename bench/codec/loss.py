"""How much of a performance arrives where planes are lost or bits flipped, by I period and start codes?

Encodes a performance in several ways, damages the streams with fixed seeds, salvages them, and compares what
a player would show in each frame with what was sent. `python -m bench.codec.loss FILE` prints the tables
of docs/robustness.md for a performance of your own.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from pathlib import Path
from random import Random

import numpy as np

import fba
from fba import Animation, Decoder, EncoderOptions, FbaError, FbaWarning, decode, encode, read
from fba.arrays import Bool, Float64, Int32, Int64

Damaging = Callable[[list[bytes], Random], bytes]


@dataclass(frozen=True)
class Setting:
    """A way to encode. period: seconds between I planes; None for a single one, without start codes."""

    name: str
    period: Fraction | None
    time_codes: bool = True

    @property
    def options(self) -> EncoderOptions:
        """The encoder's options."""
        return EncoderOptions(
            fap_quant=2,
            bap_steps="visage",
            intra_period=self.period,
            start_codes=self.period is not None,
            time_codes=self.time_codes,
            clamp=True,
            mark=False,
        )


@dataclass(frozen=True)
class Channel:
    """A way in which streams are damaged. damage: returns what arrives of packets, one a frame."""

    name: str
    damage: Damaging


@dataclass(frozen=True)
class Result:
    """What arrived with a setting over a channel; shares of all frames, means over all rounds.

    bytes: size of the stream, undamaged. right: frames with exactly the values that were sent. held: frames
    that are missing, so that the last pose stays. wrong: frames with other values, or at another time.
    marked: share of the wrong frames that `Damage` or `PlaneInfo.doubtful` mark. error: mean difference
    between what is shown and what was sent, as a share of what each parameter spans. outage: the longest
    stretch without a right frame, seconds, in 19 of 20 rounds not longer than this.
    """

    setting: str
    channel: str
    bytes: int
    right: float
    held: float
    wrong: float
    marked: float
    error: float
    outage: float


SETTINGS = (
    Setting("one I plane, no start codes", None),
    Setting("every 5 s", Fraction(5)),
    Setting("every 2 s", Fraction(2)),
    Setting("every 1 s", Fraction(1)),
    Setting("every 1 s, no time codes", Fraction(1), time_codes=False),
    Setting("every 0.5 s", Fraction(1, 2)),
)
"""Ways to encode that are compared. I planes after the first have start codes."""


def lose(share: float, burst: int = 1) -> Damaging:
    """Return a channel that loses this share of all packets, `burst` at a time."""

    def damage(packets: list[bytes], random: Random) -> bytes:
        arrived, left = [], 0
        for packet in packets:
            if not left and random.random() < share / burst:
                left = burst
            if left:
                left -= 1
            else:
                arrived.append(packet)
        return b"".join(arrived)

    return damage


def flip(rate: float) -> Damaging:
    """Return a channel that flips bits at this rate."""

    def damage(packets: list[bytes], random: Random) -> bytes:
        data = bytearray(b"".join(packets))
        bit = _gap(random, rate)
        while bit < 8 * len(data):
            data[bit >> 3] ^= 128 >> (bit & 7)
            bit += 1 + _gap(random, rate)
        return bytes(data)

    return damage


def _gap(random: Random, rate: float) -> int:
    """Return how many bits are right before the next wrong one."""
    return int(math.log(1 - random.random()) / math.log(1 - rate))


CHANNELS = (
    Channel("planes lost, 1 %", lose(0.01)),
    Channel("planes lost, 5 %", lose(0.05)),
    Channel("planes lost, 20 %", lose(0.2)),
    Channel("5 %, in bursts of 10", lose(0.05, 10)),
    Channel("bit errors, 1 in 100,000", flip(1e-5)),
    Channel("bit errors, 1 in 10,000", flip(1e-4)),
)
"""Ways in which streams are damaged."""


def sample_performance() -> Animation:
    """Return the sample face four times, 38 s."""
    return Animation.concatenate([read(Path(fba.__file__).with_name("samples") / "hello.fap")] * 4)


def split_planes(data: bytes) -> list[bytes]:
    """Return the bytes of a stream by plane: a plane's packet ends in the byte in which the plane ends.

    The last packet has the end code as well.
    """
    decoder = Decoder(bap_steps="visage")
    blocks = decoder.push_blocks(data) + decoder.finish_blocks()
    ends = [int(bit) + 7 >> 3 for block in blocks for bit in block.borders[1:]]
    ends[-1] = len(data)
    return [data[start:stop] for start, stop in zip([0, *ends], ends, strict=False)]


def run(
    animation: Animation,
    settings: Sequence[Setting] = SETTINGS,
    channels: Sequence[Channel] = CHANNELS,
    *,
    rounds: int = 40,
    seed: int = 0,
) -> list[Result]:
    """Return the results of all settings over all channels. rounds: damaged streams for each."""
    results = []
    for setting in settings:
        sent = _Sent(animation, setting)
        for channel in channels:
            outcomes = [
                sent.compare(
                    channel.damage(sent.packets, Random(f"{seed} {setting.name} {channel.name} {n}"))
                )
                for n in range(rounds)
            ]
            right, held, wrong, marked, error = np.mean([one[:5] for one in outcomes], axis=0).tolist()
            outage = float(np.percentile([one[5] for one in outcomes], 95)) / float(animation.rate)
            share = marked / wrong if wrong else 1.0
            results.append(
                Result(setting.name, channel.name, len(sent.data), right, held, wrong, share, error, outage)
            )
    return results


def recovery(
    animation: Animation, setting: Setting, *, seconds: float = 6, rounds: int = 60, seed: int = 0
) -> Float64:
    """Return the mean error of the frames after the loss of one packet, (T,), as a share of the span.

    The packets are spread over the performance, and leave at least `seconds` of it behind them.
    """
    sent = _Sent(animation, setting)
    count = int(seconds * animation.rate)
    random = Random(f"{seed} {setting.name}")
    errors = []
    for _ in range(rounds):
        lost = random.randrange(1, len(sent.packets) - count)
        shown = sent.errors(b"".join(sent.packets[:lost] + sent.packets[lost + 1 :]))
        errors.append(shown[lost : lost + count])
    result: Float64 = np.mean(errors, axis=0)
    return result


class _Sent:
    """An encoded performance: data, packets, and the values that a decoder finds in it undamaged."""

    def __init__(self, animation: Animation, setting: Setting) -> None:
        self.data = encode(animation, setting.options)
        self.packets = split_planes(self.data)
        true = decode(self.data, bap_steps="visage")
        self._index = true.index
        self._values = _values(true)
        span = np.ptp(self._values, axis=0)
        self._moving = span > 0
        self._span = span[self._moving]

    def compare(self, data: bytes) -> tuple[float, float, float, float, float, int]:
        """Return shares right, held, wrong and marked, the mean error, and the longest outage in frames."""
        animation, marked = _salvage(data)
        if animation is None:
            return 0.0, 1.0, 0.0, 0.0, float(self._errors(None).mean()), len(self._index)
        position, here = self._arrived(animation)
        same = (_values(animation)[position] == self._values).all(axis=1)
        right = here & same
        wrong = here & ~same
        doubted = wrong & np.isin(animation.index[position], marked)
        outage = max(map(len, "".join(" x"[int(bad)] for bad in ~right).split()), default=0)
        error = self._errors(animation).mean()
        return right.mean(), 1 - here.mean(), wrong.mean(), doubted.mean(), float(error), outage

    def errors(self, data: bytes) -> Float64:
        """Return the distance of each shown frame from the sent frame, (T,)."""
        return self._errors(_salvage(data)[0])

    def _arrived(self, animation: Animation) -> tuple[Int64, Bool]:
        """Return for each frame which one is shown, and whether it is for this time."""
        position = np.searchsorted(animation.index, self._index, side="right") - 1
        here = (position >= 0) & (animation.index[position] == self._index)
        return np.maximum(position, 0), here

    def _errors(self, animation: Animation | None) -> Float64:
        """Return the distance of each shown frame, or of the rest pose, from the sent frame, (T,)."""
        if animation is None:
            shown = np.zeros_like(self._values)
        else:
            position = np.searchsorted(animation.index, self._index, side="right") - 1
            shown = np.where((position >= 0)[:, None], _values(animation)[position], 0)
        differences = np.abs(shown.astype(np.int64) - self._values)[:, self._moving]
        return (np.minimum(differences / self._span, 1.0)).mean(axis=1)  # type: ignore[no-any-return]


def _salvage(data: bytes) -> tuple[Animation | None, list[int]]:
    """Return what can be salvaged, and the indices of frames that are marked as doubtful."""
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        try:
            animation = decode(data, bap_steps="visage", on_error="salvage")
        except FbaError:
            return None, []
        decoder = Decoder(bap_steps="visage", on_error="salvage")
        frames = decoder.push(data) + decoder.finish()
    doubtful = {number for damage in decoder.damage for number in damage.doubtful}
    return animation, [f.index for f in frames if f.plane.doubtful or f.plane.number in doubtful]


def _values(animation: Animation) -> Int32:
    """Return FAPs 3 to 68 and BAPs as int32 (T, 362), 0 where absent."""
    values = np.zeros((len(animation), 66 + 296), dtype=np.int32)
    if animation.face is not None:
        values[:, :66] = animation.face.values[:, 2:]
    if animation.body is not None:
        values[:, 66:] = animation.body.values
    return values


def tables(results: Sequence[Result]) -> list[str]:
    """Return the lines of the tables: frames shown right, and the longest outage, by setting and channel."""
    channels = list(dict.fromkeys(result.channel for result in results))
    settings = list(dict.fromkeys(result.setting for result in results))
    found = {(result.setting, result.channel): result for result in results}
    least = min(result.bytes for result in results)
    lines = []
    for title, cell in (
        ("frames shown right", lambda one: f"{100 * one.right:.1f} %"),
        ("longest outage", lambda one: f"{one.outage:.1f} s"),
    ):
        lines.append(f"| {title}: I planes | size | {' | '.join(channels)} |")
        lines.append("|---" * (len(channels) + 2) + "|")
        for setting in settings:
            row = [found[setting, channel] for channel in channels]
            size = f"{100 * row[0].bytes / least - 100:+.0f} %"
            lines.append(f"| {setting} | {size} | {' | '.join(map(cell, row))} |")
        lines.append("")
    return lines


def main() -> None:
    """Run the study and print its tables."""
    parser = argparse.ArgumentParser(prog="python -m bench.codec.loss", description=__doc__)
    parser.add_argument("file", nargs="?", help="a performance (default: the sample face, four times)")
    parser.add_argument("--rounds", type=int, default=40, help="damaged streams for each cell (default 40)")
    parser.add_argument("--seed", type=int, default=0, help="number of the series (default 0)")
    parser.add_argument("--json", action="store_true", help="print all figures as JSON")
    arguments = parser.parse_args()
    animation = read(arguments.file) if arguments.file else sample_performance()
    results = run(animation, rounds=arguments.rounds, seed=arguments.seed)
    if arguments.json:
        sys.stdout.write(json.dumps([asdict(result) for result in results], indent=2) + "\n")
        return
    for line in tables(results):
        sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    main()
