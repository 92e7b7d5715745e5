"""ROS 2 node of stairmap: converts messages, calls the pipeline, publishes what it says."""
