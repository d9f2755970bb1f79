"""BAPs to joint matrices and back, the conventions of the angles, and the limits of human joints."""
