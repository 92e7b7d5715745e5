"""What can be typed: one module per command with its options and its help.

They import nothing heavy, so that ``--help`` is quick; a command imports its work when it is called.
"""
