"""Parts of the head that the neutral figure lacks."""
