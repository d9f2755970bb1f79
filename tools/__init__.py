"""What makes the data that comes with fba, and what measures it; no part of the installed package."""
