"""Limbs of the retargeted body: elbows, knees, legs and feet that go where the source's do.

May use: rotations, compiled loops, the captured motion.
"""
