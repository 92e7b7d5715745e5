"""From stairways to action: can a robot climb them, and where do they lead."""
