"""Benchmarks of faces, bodies and what moves them."""
