"""The sample performance: curves, a skeleton and a face that follow keys, and their files."""
