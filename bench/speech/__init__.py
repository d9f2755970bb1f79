"""How well speech is found and shown: `python -m bench.speech`."""
