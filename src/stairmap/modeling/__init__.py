"""Observations and poses in, stairways out."""
