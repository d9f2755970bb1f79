"""Visemes as files that other programs open: JSON with Oculus' names, and Praat's TextGrid."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Literal

from fba.speech._mouth_cues import OCULUS
from fba.speech._sounds import Shape
from fba.speech._timings import PHONES

_NAMES = {number: name for name, number in reversed(OCULUS.items())}

VisemeFormat = Literal["json", "textgrid"]


def format_visemes(shapes: Sequence[Shape], kind: VisemeFormat) -> str:
    """Return visemes as the text of a file, which `read_timings` reads.

    json: times in seconds, names of Oculus' lip sync, MPEG-4's numbers, and the share of the shape, 0 to 1.
    textgrid: an interval tier "phones" with a phone in ARPAbet that shows each viseme, empty for none.
    """
    if kind == "json":
        events = [
            {
                "time": round(each.start, 4),
                "end": round(each.end, 4),
                "viseme": _NAMES[each.viseme],
                "number": each.viseme,
                "share": round(each.size, 3),
            }
            for each in shapes
        ]
        return json.dumps({"visemes": events}, indent=1) + "\n"
    end = shapes[-1].end if shapes else 0.0
    lines = ['File type = "ooTextFile"', 'Object class = "TextGrid"', "", "0", f"{end:g}", "<exists>", "1"]
    lines += ['"IntervalTier"', '"phones"', "0", f"{end:g}", str(len(shapes))]
    for each in shapes:
        name = PHONES[each.viseme] if each.viseme else ""
        lines += [f"{each.start:.4f}", f"{each.end:.4f}", f'"{name}"']
    return "\n".join(lines) + "\n"
