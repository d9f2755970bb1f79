"""Datagrams of Live Link Face, as `fba.formats.face_tables.livelink_udp` reads them from files."""

from __future__ import annotations

import numpy as np

from fba.capture.blendshapes.shape_table import ARKIT_ORDER
from fba.errors import FormatError, UnsupportedError
from fba.formats.face_tables.livelink_udp import divide_values, read_packet
from fba.formats.face_tables.shape_weights import check_weights
from fba.live._protocols.sample import DatagramError, Sample

PLACE = "the datagram"
EMPTY = "empty"
LARGEST_RATE = 240
"""Frames in a second; no camera of a telephone takes more."""


class LiveLinkReader:
    """Reads datagrams of version 6, each of which is a frame."""

    def __init__(self) -> None:
        self._newest: Sample | None = None

    def read(self, data: bytes, now: float) -> list[Sample]:
        """Return the moment of a datagram; see `DatagramReader`."""
        try:
            if not data:
                raise DatagramError(EMPTY)
            packet, stop = read_packet(data, 0, PLACE)
            if packet is None:
                raise DatagramError("cut short")
            if stop != len(data):
                raise DatagramError("longer than a datagram of Live Link Face")
            if packet.rate > LARGEST_RATE:
                raise DatagramError(f"with more than {LARGEST_RATE} frames in a second")
            (weights,), (head,), (eyes,) = divide_values(packet.values[None])
            seen = not np.isnan(packet.values).any()
            check_weights(weights[None], ARKIT_ORDER, PLACE)
        except UnsupportedError as error:
            raise DatagramError(f"of another kind: {error.what}") from error
        except FormatError as error:
            said = (
                "with weights that are no shares of 1"
                if "weight" in str(error)
                else "no datagrams of Live Link Face"
            )
            raise DatagramError(said) from error
        device, subject = packet.sender
        self._newest = Sample(
            packet.seconds, ARKIT_ORDER, weights if seen else None, head, eyes,
            subject.decode("utf-8", errors="replace"), device, packet.rate,
        )  # fmt: skip
        return [self._newest]

    def newest(self) -> Sample | None:
        """Return the moment of the last datagram."""
        return self._newest
