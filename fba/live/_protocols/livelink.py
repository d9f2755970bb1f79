"""Datagrams of Live Link Face, in the form of the files of `fba.formats.face_tables.livelink_udp`."""

from __future__ import annotations

import numpy as np

from fba.errors import FormatError, UnsupportedError
from fba.face import arkit_names
from fba.formats.face_tables.livelink_udp import divide_values, read_packet
from fba.formats.face_tables.shape_weights import check_weights
from fba.live._protocols.sample import DatagramError, Sample

PLACE = "the datagram"
MAX_CAMERA_RATE = 240
"""Largest frame rate of phones' cameras, frames a second."""


class LiveLinkReader:
    """Reads datagrams of version 6; each is a frame."""

    def __init__(self) -> None:
        self._newest: Sample | None = None

    def read(self, data: bytes, now: float) -> list[Sample]:
        """Return the sample of a datagram; see `DatagramReader`."""
        try:
            if not data:
                raise DatagramError("empty")
            packet, stop = read_packet(data, 0, PLACE)
            if packet is None:
                raise DatagramError("cut short")
            if stop != len(data):
                raise DatagramError("longer than a datagram of Live Link Face")
            if packet.rate > MAX_CAMERA_RATE:
                raise DatagramError(f"with more than {MAX_CAMERA_RATE} frames in a second")
            (weights,), (head,), (eyes,) = divide_values(packet.values[None])
            seen = not np.isnan(packet.values).any()
            check_weights(weights[None], arkit_names(), PLACE)
        except UnsupportedError as error:
            raise DatagramError(f"of another kind: {error.what}") from error
        except FormatError as error:
            reason = "with weights outside 0 to 1" if "weight" in str(error) else "not of Live Link Face"
            raise DatagramError(reason) from error
        device, subject = packet.sender
        self._newest = Sample(
            packet.seconds, arkit_names(), weights if seen else None, head, eyes,
            subject.decode("utf-8", errors="replace"), device, packet.rate,
        )  # fmt: skip
        return [self._newest]

    def newest(self) -> Sample | None:
        """Return the last sample."""
        return self._newest
