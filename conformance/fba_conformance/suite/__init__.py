"""The conformance suite: streams with the values that decoders must find, and what checks them.

`fba conformance` runs it on this codec or on other programs. In a checkout, `tools/vectors` makes the
vectors, and measures what they reach and which faulty decoders they find.
"""
