"""Streams to browsers: planes over a WebSocket, each at its time, beside a page that shows them.

    with Server(page, ["talk.fba"]) as server:
        print(server.url)
        server.start(0, lambda stage: show_file(stage, split_stream(data), loop=True))
        server.wait()

One port serves the page at `/` and the streams at `/stream?n=0`, `/stream?n=1` ... (`/stream` is the first).
A server that listens beyond this computer has a random token before both: `/TOKEN/`, `/TOKEN/stream`.

The protocol. Viewers send nothing. They get binary messages, which are bytes of an FBA stream, and text
messages, which are JSON objects with an `event`:

- `hello`, once. `streams`: the titles of all streams; `stream`: the number of this one.
- `start`, before the first bytes, and whenever decoding begins anew: at the start of a file, after losses and
  damage. `time`: seconds, in the stream, of the plane that follows. `rate`: frames per second. The binary
  messages from here on are for a new decoder: joined, they are an FBA stream. The first of them begins with
  the configuration: the headers that name the table of BAP steps, for a body, and the start code of the
  object. An I plane follows in it; for a viewer who comes late, all planes since the last I plane.
- Each binary message after that completes one plane: it ends with the byte in which the plane ends.
- `lost`. `planes`: number of those that were left out, because this viewer did not take them in time.
- `end`: the stream has ended; perhaps another `start` follows. The message before it holds the end code.

A connection that closes with code 1000 is over; after any other code, viewers may try again.

May use: codec and the data model. Independent of the page, of captures and of the command line.
"""

from fba.serving._pacing import Pace, Stage, arriving, paced, show_file, show_pipe
from fba.serving._planes import Plane, PlaneSplitter, split_stream
from fba.serving._server import MOST_VIEWERS, Server, listen

__all__ = [
    "MOST_VIEWERS", "Pace", "Plane", "PlaneSplitter", "Server", "Stage", "arriving", "listen", "paced",
    "show_file", "show_pipe", "split_stream",
]  # fmt: skip
