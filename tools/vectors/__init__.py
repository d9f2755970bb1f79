"""The test vectors of `fba conformance`: what makes them, what they reach, the faults that they find.

`python -m tools.vectors.generate`, `.coverage` and `.broken` are commands.
May use: the second decoder and the suite; of the codec, nothing.
"""
