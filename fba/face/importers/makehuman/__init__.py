"""MakeHuman's base mesh, targets and clothes, as a face."""
