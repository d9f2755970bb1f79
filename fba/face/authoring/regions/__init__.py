"""How FAPs move each region of a face: jaw, lips, lids, eyes, tongue, ears, brows, cheeks, nose."""
