"""Fuzzing: mutated streams and files, thousands a second, fed to everything that reads bytes.

`python -m tools.fuzz --minutes 10` runs all targets side by side; `targets` lists them. An input
depends on the seed and its number only, so a finding can be made again; it is saved with a smaller input that
fails in the same way, and the command that repeats it.
"""
