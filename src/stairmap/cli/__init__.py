"""The command line: the only place, beside the ROS node, that catches errors and talks to people.

``commands`` declares what can be typed and imports nothing heavy, so that ``--help`` is quick;
each command's work stands in a module of its own.
"""
