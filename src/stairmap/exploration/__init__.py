"""The closed loop: a robot that explores a building of several floors by itself."""
