"""What the figures wear."""
