"""Find stairways in depth imagery, model each one as a whole, and hand it to a planner."""

from __future__ import annotations

__version__ = "0.1.0"
