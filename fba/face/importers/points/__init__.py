"""Files that give feature points: FDP text, Xface XML, CSV and JSON."""
