"""One FBA plane as bits: the arithmetic coder, headers, and the compiled loops over planes.

May use: parameters, errors, compiled loops. `fba.codec` decides what is coded; this package codes it.
"""
