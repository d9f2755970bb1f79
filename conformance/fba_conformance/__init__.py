"""Conformance tests for FBA codecs, this one and others.

Encoding, decoding and playing do not need this package. `trace` reads an FBA stream element by element,
independently of `fba.codec`, with an arithmetic decoder in plain Python with a linear search
(`_textbook`), so that an error goes unseen only if it is made twice. `fba info --trace` prints a trace.
"""
