"""Live captures: datagrams from phones and programs to a growing stream.

    capture = Capture(find_kind("livelink"), StreamRecorder([StreamFile("face.fba")]).push)
    with Receiver(capture) as receiver:
        receiver.run(seconds=10)
    print(capture.finish())

Streams that are sent and received as they are, over RTP, UDP and TCP, are in `fba.live.streams`.

May use: capture, carriage, codec, formats and serving. Independent of windows and the command line.
"""

from fba.live._capture import Capture
from fba.live._protocols.kinds import KINDS, Kind, find_kind
from fba.live._summary import Summary
from fba.live.receiver import Receiver
from fba.live.recording import StreamFile, StreamRecorder

__all__ = ["KINDS", "Capture", "Kind", "Receiver", "StreamFile", "StreamRecorder", "Summary", "find_kind"]
