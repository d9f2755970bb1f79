"""What makes the files of the web player that are not written by hand."""
