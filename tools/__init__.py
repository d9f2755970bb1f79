"""What makes the data that comes with fba, and what tries and measures the code; not installed with it."""
