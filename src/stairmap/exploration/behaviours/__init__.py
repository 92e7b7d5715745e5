"""The parts of a mission as behaviours of py-trees, one in a file."""
