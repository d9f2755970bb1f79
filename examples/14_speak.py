"""A face that speaks: phones with their times become visemes (FAP 1) or low-level FAPs."""

from pathlib import Path

import fba
from fba.speech import Coding, Phone, Speech, encoder_options, perform, read_shapes

times = {"SIL": 0.2, "M": 0.08, "UW": 0.16, "V": 0.07, "IH": 0.09, "NG": 0.12, "pau": 0.3}
phones, at = [], 0.0
for name, seconds in times.items():
    phones.append(Phone(name, at, at + seconds))
    at += seconds
speech = Speech(tuple(phones), (), at)

Path("out").mkdir(exist_ok=True)
codings: tuple[Coding, ...] = ("visemes", "faps")
for coding in codings:
    animation = perform(speech, coding=coding, style=0.7, life=0.5)
    data = fba.encode(animation, encoder_options(coding))
    Path(f"out/moving_{coding}.fba").write_bytes(data)
    print(f"{coding}: {len(animation)} frames, {len(data)} bytes")

visemes = read_shapes(fba.read("out/moving_visemes.fba"))
print("visemes:", *(shape.viseme for shape in visemes))
