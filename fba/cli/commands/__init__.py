"""The subcommands of `fba`, one module each, imported when they are called.

May use: everything.
"""
