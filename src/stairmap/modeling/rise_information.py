"""What frames say of a stairway's rise together with how far the sensor moves edges.

Heights that are read off edges of the image all move by one angle where a sensor fattens or thins
edges. In one frame that looks nearly like another rise; over many distances it does not. So each frame
hands on its information on both, and the flight's fit solves for one rise and one shift.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array


def with_rise_variance(information: Float64Array, variance: Float64Array | float) -> Float64Array:
    """Weaken information by an independent error of the rise.

    Parameters
    ----------
    information
        (..., 2, 3) information matrix of (rise, shift), and its product with their estimate.
    variance
        (...) variance of the error, m^2.

    Returns
    -------
    (..., 2, 3) of the same estimate: by Woodbury's identity, so that it may be singular.
    """
    rise_row = information[..., :1, :]
    column = information[..., :, :1]
    total = 1.0 / np.maximum(variance, 1e-12) + information[..., 0, 0]
    return np.asarray(information - column @ rise_row / np.asarray(total)[..., None, None])


def solve_rise_and_shift(information: Float64Array, *, shift_std: float) -> tuple[Float64Array, Float64Array]:
    """Return the estimate (rise, shift) of summed information and its (2, 2) covariance.

    ``shift_std`` is the standard deviation that the shift has about zero before any frame is seen.
    """
    covariance = np.linalg.inv(information[:, :2] + np.diag([0.0, 1.0 / shift_std**2]))
    return np.asarray(covariance @ information[:, 2]), np.asarray(covariance)
