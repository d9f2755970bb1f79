"""What is measured of speech: starts of phones, visemes, lips that shut, and what streams keep of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from bench.speech.spoken import Spoken
from fba.animation import Animation
from fba.arrays import Array, Float64, Int16, Int64
from fba.codec import decode
from fba.errors import FbaError
from fba.face import Deformer, FaceModel, resolve
from fba.parameters import fap_numbers
from fba.planning import encode
from fba.speech import (
    RATE,
    Coding,
    Phone,
    Shape,
    Speech,
    encoder_options,
    find_shapes,
    find_speech,
    perform,
    read_shapes,
    split_text,
)

FRAME = 0.01
"""Seconds between the moments at which visemes are compared."""
SHUT, CLOSURE = 40, 0.04
"""How far apart inner lips that count as shut may be, in MNS / 1024, and how far off, in seconds."""


def visemes(shapes: tuple[Shape, ...], seconds: float) -> Int64:
    """Return the viseme of each hundredth of a second."""
    result = np.zeros(round(seconds / FRAME), dtype=np.int64)
    for each in shapes:
        result[round(each.start / FRAME) : round(each.end / FRAME)] = each.viseme
    return result


def start_errors(found: Speech, truth: list[Phone]) -> Float64:
    """Return by how many seconds the nearest start of a found phone misses each true one."""
    starts = np.array([each.start for each in found.phones if each.name != "SIL"])
    true = np.array([each.start for each in truth if each.name != "pau"])
    return np.abs(starts[None] - true[:, None]).min(axis=1) if len(starts) else np.full(len(true), np.inf)


@dataclass
class Counts:
    """Sums over sentences. closures: seconds by which the lips miss each p, b or m, found with the text."""

    starts: list[Float64] = field(default_factory=list)
    with_text: list[Array] = field(default_factory=list)
    without: list[Array] = field(default_factory=list)
    closures: list[float] = field(default_factory=list)
    failed: int = 0


def measure(sentences: Iterable[Spoken], change: Callable[[Int16], Int16]) -> Counts:
    """Return what is found in sentences whose sound is changed before."""
    counts = Counts()
    for each in sentences:
        sound = change(each.sound)
        seconds = len(sound) / RATE
        true = visemes(find_shapes(each.phones), seconds)
        free = find_speech([sound])
        counts.without.append(visemes(find_shapes(free.phones), seconds) == true)
        try:
            found = find_speech([sound], split_text(each.text))
        except FbaError:
            counts.failed += 1
            continue
        counts.starts.append(start_errors(found, each.phones))
        counts.with_text.append(visemes(find_shapes(found.phones), seconds) == true)
        made = perform(found, life=0)
        counts.closures += closure_errors(decode(encode(made, encoder_options("faps"))), each.phones)
    return counts


def closure_errors(animation: Animation, truth: Iterable[Phone]) -> list[float]:
    """Return the seconds from each true p, b or m to the nearest moment at which the lips are shut."""
    times = np.arange(0, float(animation.times[-1]), 0.005)
    faps = _at(animation, times, FaceModel.default())
    upper, lower = (faps[:, fap_numbers()[name] - 1] for name in ("lower_t_midlip", "raise_b_midlip"))
    shut = times[-upper - lower <= SHUT]
    errors = []
    for shape in find_shapes(truth):
        if shape.viseme == 1:
            away = np.maximum(np.maximum(shape.start - shut, shut - shape.end), 0)
            errors.append(float(away.min(initial=np.inf)))
    return errors


def add_noise(sound: Int16) -> Int16:
    """Return a sound with white noise 10 dB below it."""
    level = float(np.sqrt((sound.astype(np.float64) ** 2).mean())) / 10**0.5
    noisy = sound + np.random.default_rng(7).normal(0, level, len(sound))
    return np.asarray(np.clip(noisy, -32768, 32767), dtype=np.int16)


def telephone(sound: Int16) -> Int16:
    """Return a sound as of 8 kHz, 300 to 3400 Hz."""
    from scipy.signal import butter, sosfiltfilt

    band = butter(4, (300, 3400), "bandpass", fs=RATE, output="sos")
    return np.asarray(np.clip(sosfiltfilt(band, sound.astype(np.float64)), -32768, 32767), dtype=np.int16)


@dataclass(frozen=True)
class Coded:
    """A stream of speech: bits in a second, share of right visemes, and errors of the lips in mm.

    seconds: its length. left_out: share of the sounds that are left out to keep the goal of the coding.
    closures: seconds by which the lips miss each p, b or m.
    """

    seconds: float
    bits: float
    left_out: float
    right: float
    mean: float
    largest: float
    closures: list[float]


def measure_coding(coding: Coding, sentences: Iterable[Spoken]) -> Coded:
    """Return what a stream keeps of sentences, one after another, of their true phones."""
    phones: list[Phone] = []
    end = 0.0
    for each in sentences:
        phones += [Phone(phone.name, phone.start + end, phone.end + end) for phone in each.phones]
        end += len(each.sound) / RATE
    speech = Speech(tuple(phones), (), end)
    made = perform(speech, coding=coding, life=0)
    data = encode(made, encoder_options(coding))
    decoded = decode(data)
    sounds = len(perform(speech, coding=coding, life=0, keep_goal=False))
    full = perform(speech, coding=coding, life=0, rate=Fraction(100), keep_goal=False)
    mean, largest = _lip_errors(decoded, full)
    true = visemes(find_shapes(phones), end)
    right = float((visemes(read_shapes(decoded), end)[: len(true)] == true).mean())
    left_out = 1 - len(made) / sounds
    closures = closure_errors(decoded, phones)
    return Coded(end, 8 * len(data) / end, left_out, right, mean, largest, closures)


def _lip_errors(decoded: Animation, full: Animation) -> tuple[float, float]:
    """Return the mean and the 95th percentile of errors at lips, in mm, ten times a second."""
    model = FaceModel.default()
    deformer = Deformer(model)
    moments = np.arange(0, int(full.index[-1]) - 10, 10)
    shown = [_at(each, moments / float(full.rate), model) for each in (decoded, full)]
    first, second = (np.stack([deformer(row) for row in faps]) for faps in shown)
    lips = np.linalg.norm(second - deformer(np.zeros(68, np.float32)), axis=-1).max(axis=0) > 0.004
    errors = 1000 * np.linalg.norm(first - second, axis=-1)[:, lips]
    return float(errors.mean()), float(np.percentile(errors, 95))


def _at(animation: Animation, times: Float64, model: FaceModel) -> Any:
    """Return the FAPs that a player shows at times: linear between the frames."""
    assert animation.face is not None
    faps = resolve(animation.face, model)
    frames = animation.index / float(animation.rate)
    return np.stack([np.interp(times, frames, column) for column in faps.T], axis=1).astype(np.float32)
