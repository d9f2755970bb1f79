"""The surface that regions move: neighbours, weights, landmarks, and limits where it would fold."""
