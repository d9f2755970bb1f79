"""All test vectors, by group."""

from __future__ import annotations

from collections.abc import Iterator

from tools.vectors.definitions import _coder, _masks, _ranges, _start_codes, _times, _values
from tools.vectors.definitions.case import Case


def cases() -> Iterator[tuple[str, Case]]:
    """Yield group and definition of every valid stream, the simple ones first."""
    for group, made in (
        ("first steps", _values.first_cases()),
        ("quantisers", _values.quantiser_cases()),
        ("extreme values", _values.extreme_cases()),
        ("masks", _masks.mask_cases()),
        ("planes", _masks.plane_cases()),
        ("ranges", _ranges.range_cases()),
        ("arithmetic coder", _coder.coder_cases()),
        ("start codes", _start_codes.start_code_cases()),
        ("around the object", _start_codes.surrounding_cases()),
        ("times", _times.time_cases()),
        ("joining", _times.join_cases()),
    ):
        for case in made:
            yield group, case
