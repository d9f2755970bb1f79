"""What makes the pictures of the documentation: functions that `docs/make_pictures.py` runs."""
