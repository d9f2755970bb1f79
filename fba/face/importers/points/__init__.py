"""Files that give feature points: FDP text, Xface XML, CSV and JSON.

May use: the face model's names of points.
"""
