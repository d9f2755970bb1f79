"""Benchmarks of the codec: speed, memory, bit rates beside a textbook coder, and what losses leave."""
