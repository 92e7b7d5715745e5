"""Bags of ROS 1, ROS 2 and the RealSense recorder as recordings."""
