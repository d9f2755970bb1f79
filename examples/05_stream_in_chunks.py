"""A live stream: frames go in one by one, bytes arrive in chunks of 16, and frames come out at once."""

from pathlib import Path

import fba

CHUNK = 16  # bytes

animation = fba.read(Path(fba.__file__).parent / "samples" / "hello.fap")
encoder, decoder = fba.Encoder(), fba.Decoder()
waiting = b""  # encoded, but less than a chunk
received = 0
lags = []
for sent, frame in enumerate(animation, 1):
    waiting += encoder.push(frame)  # bytes as soon as they are complete
    while len(waiting) >= CHUNK:
        received += len(decoder.push(waiting[:CHUNK]))  # frames as soon as they are complete
        waiting = waiting[CHUNK:]
    lags.append(sent - received)
print(f"received {received} frames while sending")
print(f"latency: {sum(lags) / len(lags):.2f} frames on average, {max(lags)} at most")

received += len(decoder.push(waiting + encoder.finish())) + len(decoder.finish())
print(f"received {received} frames in all")
