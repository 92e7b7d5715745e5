"""One depth frame in, stair edges or reasons out."""
