"""Recordings of known stairways, with honest sensors and honest odometry."""
