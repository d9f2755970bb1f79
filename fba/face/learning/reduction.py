"""A track that sends only what an interpolation table is computed from."""

from __future__ import annotations

import numpy as np

from fba.arrays import Bool, Int32
from fba.face._resolve import known_faps
from fba.face.interpolation.table import InterpolationTable, sources_of
from fba.parameters import FAP_COUNT, mate_columns
from fba.tracks import FaceTrack


def send_sources(track: FaceTrack, table: InterpolationTable) -> FaceTrack:
    """Return a track that does not send the FAPs that a face with this table computes.

    Sent are the FAPs that the table starts from, as 0 where nothing determines them (the table needs them
    all), and the FAPs to which no link leads, if they move or a mate that does would be copied; but not if
    they equal the mate that a face copies. What is computed may differ from what the track had. A track that
    redefines visemes or expressions, which depends on what is sent, stays as it is.
    """
    if track.viseme[:, 3].any() or track.expression[:, 5].any():
        return track
    values, known = known_faps(track)
    linked = linked_columns(table)
    moves = np.asarray(values.any(axis=0)) | linked
    needed = moves | np.logical_or.reduce([moves[columns] for columns in mate_columns()])
    mask = known & needed & ~linked
    mask[:, _copies(values, mask, linked)] = False
    mask[:, source_columns(table)] = True
    mask[:, :2] = track.mask[:, :2]
    return FaceTrack(values, mask, track.viseme, track.expression)


def _copies(values: Int32, mask: Bool, linked: Bool) -> list[int]:
    """Return columns of the mask (T, 68) that a face copies from what is sent, or computed (`linked`)."""
    kept: Bool = np.asarray(mask.all(axis=0)) | linked
    copies: list[int] = []
    for column in range(FAP_COUNT - 1, 1, -1):  # outer lips before inner ones
        if linked[column] or not kept[column]:
            continue
        kept[column] = False
        if all(_equals_its_donor(values, each, kept) for each in (*copies, column)):
            copies.append(column)
        else:
            kept[column] = True
    return copies


def _equals_its_donor(values: Int32, column: int, kept: Bool) -> bool:
    """Return whether the first mate of a column that is kept has the same values."""
    donor = next((int(one[column]) for one in mate_columns() if kept[one[column]]), None)
    return donor is not None and bool((values[:, donor] == values[:, column]).all())


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
