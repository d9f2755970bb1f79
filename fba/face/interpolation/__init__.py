"""The FAP interpolation table (FIT): values that a stream leaves out, computed from those it sends."""
