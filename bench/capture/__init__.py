"""Benchmarks of capture: faces, markers and the way of live ones to the picture."""
