"""How well outlines are found again: `python -m bench.outlines kimia FOLDER | objects | poses`."""
