"""Proof that a codec does what the standard says, for this one and for others.

Nothing in here is needed to encode, decode or play. It is the second opinion: `trace` reads an FBA
stream element by element with other tools than `fba.codec` uses (bitstring, and the arithmetic
decoder of `textbook`, a linear search in plain Python), so that an error would have to be made twice
to go unseen. `fba info --trace` prints what it finds.
"""
