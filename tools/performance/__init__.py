"""The sample performance: curves, a skeleton and a face animated by keys, and their files."""
