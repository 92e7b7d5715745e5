"""Files of points: PCD, PLY, LAS, LAZ, E57 and text, in chunks."""
