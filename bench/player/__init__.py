"""Benchmarks of the player: start, pictures, panels."""
