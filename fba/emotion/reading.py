"""Reads the expressions of whole animations, and sums them up."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64
from fba.choices import Baseline
from fba.emotion.recogniser import NEUTRAL, UNKNOWN, ExpressionRecogniser, Reading
from fba.errors import OptionError
from fba.face.resolve import FaceSettings, known_faps, resolve
from fba.parameters import faps
from fba.tracks import FaceTrack

BASELINES: tuple[Baseline, ...] = get_args(Baseline)
"""What is taken for the face at rest: as the standard has it, the first moments, the middle of each FAP."""
START_SECONDS = 0.5
"""Longest duration of the first moments of a recording, in seconds."""
START_SHARE = 0.1
"""Largest share of a recording that its first moments take."""
SILENT = 1.0
"""Seconds for which a FAP must be 0 throughout to be taken for one that is not sent."""
CHUNK = 4096
"""Frames that are read at once."""
MOUTH_GROUPS = (2, 8)


@dataclass(frozen=True, eq=False)
class Readings:
    """What a face shows in each frame of an animation.

    times: float64 (T,), seconds. readings: T. baseline: one of `BASELINES`. unsent: names of FAPs that the
    file never sends, or that are 0 throughout a second or more; they say nothing.
    """

    times: Float64
    readings: tuple[Reading, ...]
    baseline: Baseline
    unsent: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.readings)

    def summary(self) -> dict[str, Any]:
        """Return shares of frames by label with mean intensities, most frequent first, and the main family.

        "main" is the label that is shown most, frames times intensity; None if none is.
        """
        counts = Counter(one.label for one in self.readings)
        shares = [
            {
                "label": label,
                "share": count / len(self.readings),
                "intensity": float(np.mean([one.intensity for one in self.readings if one.label == label])),
            }
            for label, count in counts.most_common()
        ]
        amounts: dict[str, float] = defaultdict(float)
        for one in self.readings:
            if one.label not in (NEUTRAL, UNKNOWN):
                amounts[one.label] += one.intensity
        main = max(amounts, key=lambda label: amounts[label], default=None)
        changes = sum(a.label != b.label for a, b in zip(self.readings, self.readings[1:], strict=False))
        return {"main": main, "shares": shares, "changes": changes}


def read_expressions(
    animation: Animation, model: FaceSettings | None = None, *, baseline: Baseline = "none"
) -> Readings:
    """Return what the face of an animation shows in each frame.

    Works on what a face shows (`fba.face.resolve`), so that visemes, FAP 2 and mates take part. model: as
    for `resolve`. baseline: what is taken for the face at rest and subtracted: "none", nothing, as FAPs
    count from the neutral face; "start", the mean of the first half second, or of a tenth of a short
    recording; "median", of each FAP, for a recording in which a face is mostly at rest. The head's angles are
    never read.

    Raises OptionError for an animation without a face or without frames, and for another baseline.
    """
    if baseline not in BASELINES:
        raise OptionError(f"the baseline must be one of {', '.join(BASELINES)}, not {baseline!r}")
    if animation.face is None or not len(animation):
        raise OptionError("there is no face to read: the animation sends no FAPs")
    times = (animation.index - animation.index[0]) / float(animation.rate)
    shown = resolve(animation.face, model)
    known = find_known_faps(animation.face)
    if len(shown) >= SILENT * animation.rate:
        known &= shown.any(axis=0)
    at_rest = _find_rest(shown, times, baseline)
    recogniser = ExpressionRecogniser(animation.rate, known=known, baseline=at_rest)
    readings: list[Reading] = []
    for start in range(0, len(shown), CHUNK):
        readings += recogniser.push_frames(shown[start : start + CHUNK])
    unsent = tuple(one.name for one, there in zip(faps(), known.tolist(), strict=True) if not there)
    return Readings(times, tuple(readings), baseline, unsent[2:])


def find_known_faps(track: FaceTrack) -> Bool:
    """Return which FAPs a track says something about: bool (68,).

    Those sent, their mates, all if FAP 2 is sent, and those of the mouth if visemes are.
    """
    known: Bool = np.asarray(known_faps(track)[1].any(axis=0))
    if track.mask[:, 1].any():
        known[2:] = True
    if track.mask[:, 0].any():
        known |= np.array([one.group in MOUTH_GROUPS for one in faps()])
    known[:2] = False
    return known


def _find_rest(shown: Any, times: Float64, baseline: Baseline) -> Float64 | None:
    if baseline == "none":
        return None
    first = times <= min(START_SECONDS, START_SHARE * float(times[-1]))
    rest = np.median(shown, axis=0) if baseline == "median" else shown[first].mean(axis=0)
    return np.asarray(rest, dtype=np.float64)
