"""A track that sends only what an interpolation table is computed from."""

from __future__ import annotations

import numpy as np

from fba.arrays import Bool
from fba.face.interpolation.table import InterpolationTable, sources_of
from fba.face.mates import donors
from fba.face.resolve import known_faps
from fba.parameters import FAP_COUNT
from fba.tracks import FaceTrack


def send_sources(track: FaceTrack, table: InterpolationTable) -> FaceTrack:
    """Return a track that does not send the FAPs that a face with this table computes.

    Sent are the FAPs that the table starts from, as 0 where nothing determines them (the table needs them
    all), and the FAPs to which no link leads, if they move or a mate that does would be copied. What is
    computed may differ from what the track had. A track that redefines visemes or expressions, which
    depends on what is sent, stays as it is, and so do visemes and expressions.
    """
    if track.viseme[:, 3].any() or track.expression[:, 5].any():
        return track
    values, known = known_faps(track)
    linked = linked_columns(table)
    moves = np.asarray(values.any(axis=0)) | linked
    needed = moves | np.logical_or.reduce([moves[columns] for columns in donors()])
    mask = known & needed & ~linked
    mask[:, source_columns(table)] = True
    mask[:, :2] = track.mask[:, :2]
    return FaceTrack(values, mask, track.viseme, track.expression)


def linked_columns(table: InterpolationTable) -> Bool:
    """Return bool (68,): FAPs to which a link leads."""
    result = np.zeros(FAP_COUNT, dtype=np.bool_)
    result[[number - 1 for number in table.order]] = True
    return result


def source_columns(table: InterpolationTable) -> Bool:
    """Return bool (68,): low-level FAPs that links start from and to which none leads."""
    result = np.zeros(FAP_COUNT, dtype=np.bool_)
    for numbers in sources_of(table.links).values():
        result[[number - 1 for number in numbers]] = True
    result[:2] = False
    return result & ~linked_columns(table)
