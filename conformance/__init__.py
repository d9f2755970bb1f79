"""Former name of the package `fba_conformance`, which is in this folder; importing it raises ImportError."""

raise ImportError(
    "the package 'conformance' is now called 'fba_conformance': from fba_conformance import ...",
    name="conformance",
)
