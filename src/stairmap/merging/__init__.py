"""The runs of one site as one map."""
