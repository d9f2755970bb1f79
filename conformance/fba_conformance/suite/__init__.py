"""The conformance suite: streams with the values that decoders must find, and what checks them.

`fba conformance` runs it on this codec or on other programs. `generate` writes the vectors, which come with
the package; `coverage` says which vectors reach what, `broken` which of them find decoders with a fault.
May use: the second decoder, the codec's public names, formats.
"""
