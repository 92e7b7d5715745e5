"""Depth recordings: what a sensor saw and where it was."""
