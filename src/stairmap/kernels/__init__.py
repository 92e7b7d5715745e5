"""The few inner loops that cost time, each in NumPy and in C++.

The NumPy twin is the reference, the test's oracle, and what runs where nothing was compiled. A kernel holds
no method, no decision and no constant of the method: those are its arguments.
"""

from __future__ import annotations

from stairmap.kernels import equations, outlines, predictions
from stairmap.kernels.choice import VARIANT, chosen, describe_kernels

__all__ = ["VARIANT", "describe_kernels", "predict_rays", "sum_equations", "trace_outline"]

trace_outline = chosen(outlines.trace_outline)
predict_rays = chosen(predictions.predict_rays)
sum_equations = chosen(equations.sum_equations)
