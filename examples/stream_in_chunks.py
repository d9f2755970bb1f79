"""A live stream: frames go in one by one, bytes arrive in small chunks, and frames come out at once.

    python examples/stream_in_chunks.py [BYTES]        # bytes a chunk, default 16

Prints by how many frames the receiver lags behind the sender, and what coding costs a frame.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import fba

SAMPLE = Path(fba.__file__).parent / "samples" / "hello.fap"


def main(size: int) -> None:
    """Send the sample's face in chunks of so many bytes."""
    animation = fba.read(SAMPLE)
    fba.decode(fba.encode(animation[:2]))  # loads the compiled code, once, before the clock runs
    encoder, decoder = fba.Encoder(), fba.Decoder()
    waiting = b""  # on its way, less than a chunk
    chunks = total = 0
    delays: list[int] = []
    encoding = decoding = 0.0
    for sent, frame in enumerate(animation):
        started = perf_counter()
        data = encoder.push(frame)
        encoding += perf_counter() - started
        waiting += data
        total += len(data)
        while len(waiting) >= size:
            started = perf_counter()
            received = decoder.push(waiting[:size])
            decoding += perf_counter() - started
            waiting = waiting[size:]
            chunks += 1
            delays += [sent - (len(delays) + i) for i in range(len(received))]
    rest = waiting + encoder.finish()
    live = len(delays)
    ended = decoder.push(rest) + decoder.finish()
    period = 1000 / float(animation.rate)
    print(f"sent {len(animation)} frames, {total} bytes in {chunks} chunks of {size}")
    print(f"received {live} frames while sending, {len(ended)} at the end")
    mean = sum(delays) / max(live, 1)
    print(f"latency: {mean:.2f} frames ({mean * period:.0f} ms) on average, {max(delays, default=0)} at most")
    per_frame = 1e3 / len(animation)
    print(f"time a frame: encoding {encoding * per_frame:.2f} ms, decoding {decoding * per_frame:.2f} ms")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 16)
