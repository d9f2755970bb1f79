"""Reading of the expressions of whole animations, with a summary."""

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
from fba.face import FaceSettings, known_faps, resolve
from fba.parameters import faps
from fba.tracks import FaceTrack

BASELINES: tuple[Baseline, ...] = get_args(Baseline)
"""The face at rest: that of the standard, the mean of the start, the median of each FAP."""
START_SECONDS = 0.5
"""Longest duration of the start of a recording, seconds."""
START_SHARE = 0.1
"""Largest share of a recording that is its start."""
SILENT_SECONDS = 1.0
"""Length of a recording from which a FAP that is 0 throughout counts as not sent."""
CHUNK = 4096
"""Number of frames that are read at once."""
MOUTH_GROUPS = (2, 8)


@dataclass(frozen=True, eq=False)
class Readings:
    """The expressions in each frame of an animation.

    times: float64 (T,), seconds. readings: T. baseline: one of `BASELINES`. unsent: names of FAPs that are
    never sent, or are 0 throughout a second or more; they are ignored.
    """

    times: Float64
    readings: tuple[Reading, ...]
    baseline: Baseline
    unsent: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.readings)

    def summary(self) -> dict[str, Any]:
        """Return shares of frames by label with mean intensities, most frequent first, and the main label.

        "main" is the label with the largest sum of intensities; None without any but neutral and unknown.
        """
        counts = Counter(reading.label for reading in self.readings)
        shares = [
            {
                "label": label,
                "share": count / len(self.readings),
                "intensity": float(np.mean([r.intensity for r in self.readings if r.label == label])),
            }
            for label, count in counts.most_common()
        ]
        amounts: dict[str, float] = defaultdict(float)
        for reading in self.readings:
            if reading.label not in (NEUTRAL, UNKNOWN):
                amounts[reading.label] += reading.intensity
        main = max(amounts, key=lambda label: amounts[label], default=None)
        changes = sum(a.label != b.label for a, b in zip(self.readings, self.readings[1:], strict=False))
        return {"main": main, "shares": shares, "changes": changes}


def read_expressions(
    animation: Animation, model: FaceSettings | None = None, *, baseline: Baseline = "none"
) -> Readings:
    """Return the expressions in each frame of an animation.

    FAPs are resolved (`fba.face.resolve`), so that visemes, FAP 2 and mates count. model: as for `resolve`.
    baseline: the face at rest, which is subtracted: "none", the neutral face of the standard; "start", the
    mean of the first half second, or of a tenth of a short recording; "median", of each FAP, for a recording
    in which the face is mostly at rest. The head's angles are ignored.

    Raises OptionError for an animation without a face or without frames, and for another baseline.
    """
    if baseline not in BASELINES:
        raise OptionError(f"the baseline must be one of {', '.join(BASELINES)}, not {baseline!r}")
    if animation.face is None or not len(animation):
        raise OptionError("there is no face to read: the animation sends no FAPs")
    times = (animation.index - animation.index[0]) / float(animation.rate)
    shown = resolve(animation.face, model)
    known = find_known_faps(animation.face)
    if len(shown) >= SILENT_SECONDS * animation.rate:
        known &= shown.any(axis=0)
    at_rest = _find_rest(shown, times, baseline)
    recogniser = ExpressionRecogniser(animation.rate, known=known, baseline=at_rest)
    readings: list[Reading] = []
    for start in range(0, len(shown), CHUNK):
        readings += recogniser.push_frames(shown[start : start + CHUNK])
    unsent = tuple(fap.name for fap, sent in zip(faps(), known.tolist(), strict=True) if not sent)
    return Readings(times, tuple(readings), baseline, unsent[2:])


def find_known_faps(track: FaceTrack) -> Bool:
    """Return which FAPs a track determines, bool (68,): sent, mates, all by FAP 2, the mouth by FAP 1."""
    known: Bool = np.asarray(known_faps(track)[1].any(axis=0))
    if track.mask[:, 1].any():
        known[2:] = True
    if track.mask[:, 0].any():
        known |= np.array([fap.group in MOUTH_GROUPS for fap in faps()])
    known[:2] = False
    return known


def _find_rest(shown: Any, times: Float64, baseline: Baseline) -> Float64 | None:
    if baseline == "none":
        return None
    first = times <= min(START_SECONDS, START_SHARE * float(times[-1]))
    rest = np.median(shown, axis=0) if baseline == "median" else shown[first].mean(axis=0)
    return np.asarray(rest, dtype=np.float64)
