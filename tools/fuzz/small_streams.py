"""Small streams that together have every element of the syntax: fuzzing begins with them."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np

from fba.animation import Animation, FaceTrack
from fba.codec import EncoderOptions, write_mark, write_opening
from fba.planning import encode
from tools import synthetic_motion as motion

_END_CODE = b"\0\0\1\xb1"


def small_streams() -> dict[str, bytes]:
    """Return streams by a name that says what is special about them."""
    few_faps = (3, 5, 19, 20, 48)
    face = motion.face(5, faps_sent=few_faps)
    talking = motion.face(4, faps_sent=(3, 4), high_level=True)
    body = motion.body(5, baps_sent=(1, 19, 124, 181, 186))
    mask = face.mask.copy()
    mask[2:4] = False
    gaps = FaceTrack(face.values, mask)
    make = motion.animation
    both = motion.face(5, faps_sent=few_faps, high_level=True)
    every_other: dict[str, object] = {"intra_period": Fraction(2, 25), "start_codes": True}
    made: dict[str, tuple[Animation, dict[str, object]]] = {
        "face": (make(face), {}),
        "talking": (make(talking), {"fap_quant": 9}),
        "body": (make(None, body), {"bap_quant": 3}),
        "both": (make(both, body), every_other),
        "gaps_start_codes": (make(gaps, body), every_other),
        "gaps": (make(gaps, body), {}),
        "one_fap": (make(motion.face(6, faps_sent=(3,))), every_other),
        "nothing_sent": (make(motion.face(4, faps_sent=())), {"intra_period": Fraction(1, 25)}),
        "interpolated_ntsc": (
            make(face, rate=Fraction(30000, 1001), index=[0, 1, 16, 17, 300]),
            {"unsent": "interpolate"},
        ),
        "time_code": (make(face, index=[75, 76, 77, 80, 81]), {"gender": 1, "fap_quant": 31}),
        "extension_baps": (make(None, motion.body(3, baps_sent=(187, 208, 296))), {"bap_quant": 0}),
        "zeros": (make(FaceTrack(np.zeros_like(face.values), face.mask)), every_other),
    }
    streams = {
        name: encode(animation, EncoderOptions(mark=False, **options))  # type: ignore[arg-type]
        for name, (animation, options) in made.items()
    }
    marked = EncoderOptions(intra_period=Fraction(2, 25), start_codes=True)
    streams["checked"] = encode(make(both, body), marked)
    fine = replace(marked, bap_steps="visage", checksums=False)
    streams["named_before"] = write_opening("visage") + encode(make(None, body), fine)
    streams["two_objects"] = streams["face"] + streams["body"]
    streams["no_end_code"] = streams["face"].removesuffix(_END_CODE)
    streams["old_start_codes"] = b"\0\0\1\x01\0\0\1\x03" + streams["talking"][4:]
    return streams


def doubtful_marks() -> dict[str, bytes]:
    """Return streams whose marks contradict each other or the stream, were cut off, or claim too much."""
    options = EncoderOptions(intra_period=Fraction(2, 25), start_codes=True, mark=False)
    bare = encode(motion.animation(None, motion.body(5, baps_sent=(1, 181))), options)
    named = write_mark("iso")
    checked = encode(motion.animation(None, motion.body(5, baps_sent=(1, 181))), replace(options, mark=True))
    return {
        "contradicting_marks": write_opening("visage") + bare + named,
        "several_marks": write_opening("iso") + bare + named + write_mark("visage"),
        "wrong_checks": bare + write_mark("iso", bytes(range(1, 13))),
        "few_checks": bare + write_mark("iso", b""),
        "cut_checks": checked[:-5],
        "many_checks": bare + b"\0\0\1\xb2fba crc32=999999999;" + bytes(range(1, 60)),
        "unknown_words": bare + b"\0\0\1\xb2fba bap_steps=iso;colour=red;",
    }


def long_streams() -> dict[str, bytes]:
    """Return streams of 400 planes and 1 to 2 kB, with a start code every 2 seconds: many planes at once."""
    face = motion.face(400, faps_sent=(3, 48))
    body = motion.body(400, baps_sent=(1, 181))
    options = EncoderOptions(intra_period=Fraction(2), start_codes=True, mark=False)
    return {
        "long_face": encode(motion.animation(face), options),
        "long_body": encode(motion.animation(None, body), options),
        "long_both": encode(motion.animation(face, body), options),
    }
