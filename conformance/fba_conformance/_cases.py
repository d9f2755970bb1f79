"""Definitions of the test vectors that come with fba, each for one feature.

`python -m fba_conformance.generate` writes them. They are streams of this project's encoder, checked by the
independent reader (`fba_conformance.trace`) when they are written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.animation import Animation, FaceTrack
from fba.codec import EncoderOptions, encode
from fba_conformance import _motion as motion


@dataclass(frozen=True)
class Case:
    """Definition of a test vector.

    name: of the file. tests: what it tests, in one line. make: returns its bytes. encodes: whether decoding
    it and encoding the result with the same plane settings gives the same bytes; not so for streams with
    other start codes or layers.
    """

    name: str
    tests: str
    make: Callable[[], bytes]
    bap_steps: str = "iso"
    encodes: bool = True


def cases() -> Iterator[Case]:
    """Yield all vectors, in the order of the index."""
    yield from _quantisers()
    yield from _masks()
    yield from _planes()
    yield from _times()
    yield from _ranges()
    yield from _frames_around()


def _encoding(animation: Animation, **options: object) -> Callable[[], bytes]:
    """Return a function that encodes an animation."""
    return lambda: encode(animation, EncoderOptions(**options))  # type: ignore[arg-type]


def _quantisers() -> Iterator[Case]:
    for quant in (0, 1, 2, 3, 8, 17, 31):
        track = motion.face(12, high_level=True)
        if quant == 0:  # unquantised ranges end at 1860
            track = FaceTrack(np.clip(track.values, -1860, 1860), track.mask, track.viseme, track.expression)
        yield Case(
            f"face_q{quant:02}", f"all FAPs, viseme and expression at fap_quant {quant}",
            _encoding(motion.animation(track), fap_quant=quant),
        )  # fmt: skip
    for quant in (1, 5, 12, 31):
        yield Case(
            f"body_q{quant:02}", f"BAPs 1..186 at bap_quant {quant}, the standard's steps",
            _encoding(motion.animation(None, motion.body(8)), bap_quant=quant),
        )  # fmt: skip
    small = motion.body(8)
    clipped = type(small)(np.clip(small.values, -1860, 1860), small.mask)
    yield Case("body_q00", "BAPs unquantised", _encoding(motion.animation(None, clipped), bap_quant=0))
    for quant in (1, 9):
        yield Case(
            f"body_visage_q{quant:02}", f"BAPs 1..186 at bap_quant {quant}, the vendor's steps",
            _encoding(
                motion.animation(None, motion.body(8, table="visage")), bap_quant=quant, bap_steps="visage"
            ),
            "visage",
        )  # fmt: skip
    yield Case(
        "both_q6_9", "FAPs and BAPs in one plane, fap_quant 6, bap_quant 9",
        _encoding(motion.animation(motion.face(10), motion.body(10)), fap_quant=6, bap_quant=9),
    )  # fmt: skip


def _masks() -> Iterator[Case]:
    few_baps = (1, 4, 5, 19, 33, 50, 90, 125, 180, 181, 186)
    few_faps = (3, 4, 8, 19, 20, 33, 48, 51, 60, 61, 68)
    for unsent in ("keep", "interpolate"):
        yield Case(
            f"mask_{unsent}", f"some FAPs of most groups, unsent ones: {unsent}",
            _encoding(motion.animation(motion.face(12, faps_sent=few_faps)), unsent=unsent),
        )  # fmt: skip
    yield Case(
        "mask_body", "some BAPs of many groups, in listed order",
        _encoding(motion.animation(None, motion.body(10, baps_sent=few_baps))),
    )  # fmt: skip
    yield Case(
        "mask_high_level_only", "viseme and expression, no low-level FAP: an empty last segment",
        _encoding(motion.animation(motion.face(20, faps_sent=(), high_level=True))),
    )  # fmt: skip
    yield Case(
        "mask_nothing", "masks of type 0 in every group: planes of a header and two flush bits",
        _encoding(motion.animation(motion.face(3, faps_sent=()))),
    )  # fmt: skip
    track = motion.face(12)
    mask = track.mask.copy()
    mask[4:8, 30:50] = False
    mask[8:, 3:9] = False
    yield Case(
        "mask_changes", "masks that change twice: an I plane each, with new range lists",
        _encoding(motion.animation(FaceTrack(track.values, mask))),
    )  # fmt: skip
    mask = track.mask.copy()
    mask[3:9] = False
    yield Case(
        "part_comes_and_goes", "planes without FAPs between planes with both: fba_object_mask 3, 2, 3",
        _encoding(motion.animation(FaceTrack(track.values, mask), motion.body(12))),
    )  # fmt: skip
    yield Case(
        "extension_baps", "user-defined BAPs 187..296",
        _encoding(motion.animation(None, motion.body(6, baps_sent=tuple(range(187, 297))))),
    )  # fmt: skip


def _planes() -> Iterator[Case]:
    long = motion.animation(motion.face(40))
    yield Case("all_intra", "I planes only", _encoding(long[:8], intra_period=Fraction(1, 25)))
    yield Case("intra_period", "an I plane every 10 frames", _encoding(long, intra_period=Fraction(10, 25)))
    yield Case(
        "start_codes", "a plane start code and range lists with every I plane",
        _encoding(long, intra_period=Fraction(10, 25), start_codes=True, time_codes=False), encodes=True,
    )  # fmt: skip
    resting = np.zeros((600, 68), dtype=np.int32)
    mask = np.zeros((600, 68), dtype=bool)
    mask[:, 2:] = True
    yield Case(
        "emulation_guard", "a face at rest: runs of zero bits, a 1 inserted after every 22",
        _encoding(motion.animation(FaceTrack(resting, mask))),
    )  # fmt: skip
    many = 17_000
    values = np.zeros((many, 68), dtype=np.int32)
    values[:, 47] = [170 * (frame // 40 % 9) for frame in range(many)]
    mask = np.zeros((many, 68), dtype=bool)
    mask[:, 47] = True
    yield Case(
        "counts_halved", "one FAP long enough for its counts to reach 16383 and be halved",
        _encoding(motion.animation(FaceTrack(values, mask), rate=100)),
    )  # fmt: skip
    yield Case("one_frame", "a single I plane", _encoding(long[:1]))


def _times() -> Iterator[Case]:
    track = motion.face(9, faps_sent=tuple(range(3, 19)))
    for name, rate in (
        ("rate_30_5", Fraction(61, 2)),
        ("rate_ntsc", Fraction(30000, 1001)),
        ("rate_fraction_ntsc", Fraction(479, 16) * Fraction(1000, 1001)),
        ("rate_slowest", Fraction(1, 16)),
        ("rate_fastest", Fraction(4095, 16)),
    ):
        yield Case(name, f"{rate} frames/s", _encoding(motion.animation(track, rate=rate)))
    gaps = [0, 1, 3, 18, 34, 51, 83, 284, 285]  # skips of 0, 1, 14, 15, 16, 31, 200
    yield Case(
        "skips", "skipped frames: 1, 14, 15, 16, 31, 200", _encoding(motion.animation(track, index=gaps))
    )
    start = 25 * (5 * 3600 + 59 * 60 + 59)
    yield Case(
        "time_code", "a first time code of 5:59:59",
        _encoding(motion.animation(track, index=list(range(start, start + 9)))),
    )  # fmt: skip


def _ranges() -> Iterator[Case]:
    jumps = np.zeros((10, 68), dtype=np.int32)
    mask = np.zeros((10, 68), dtype=bool)
    mask[:, 2:18] = True
    jumps[::2, 4], jumps[1::2, 4] = 3720, -3720
    yield Case(
        "ranges_too_narrow", "differences that no range holds: an I plane for each",
        _encoding(motion.animation(FaceTrack(jumps, mask))),
    )  # fmt: skip
    constant = np.zeros((10, 68), dtype=np.int32)
    yield Case(
        "ranges_of_one_symbol", "ranges 0..0: alphabets of a single symbol, no bits",
        _encoding(motion.animation(FaceTrack(constant, mask))),
    )  # fmt: skip


def _frames_around() -> Iterator[Case]:
    """Yield streams as other programs write them: other start codes, layers around the object."""
    plain = encode(motion.animation(motion.face(6)))
    end = b"\x00\x00\x01\xb1"
    yield Case(
        "old_start_codes", "the old codes of object (01 01) and plane (01 03)",
        lambda: b"\x00\x00\x01\x01" + b"\x7f\x00\x00\x01\x03" + plain[4:], encodes=False,
    )  # fmt: skip
    yield Case(
        "no_end_code", "the data ends with the last plane", lambda: plain.removesuffix(end), encodes=False
    )
    yield Case(
        "layers_around", "visual object sequence and visual object headers before the object",
        lambda: b"\x00\x00\x01\xb0\x61" + b"\x00\x00\x01\xb5\x41\xff" + plain, encodes=False,
    )  # fmt: skip
