"""The folder of the package `fba_conformance`; `conformance` was its name, which could be anyone's."""

raise ImportError(
    "the package 'conformance' is now called 'fba_conformance': from fba_conformance import ...",
    name="conformance",
)
