# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The fit of what was named."""

from armid_ros.diagnosis.fit import fit
from armid_ros.diagnosis.floor import noise_floor
from armid_ros.diagnosis.patch import Named
from armid_ros.effects import CATALOGUE
import numpy as np

from tests.diagnosis.test_floor import cut


def test_what_does_nothing_along_the_motion_is_not_told(bench):
    """A strap that is never taut has no torque to be fitted to."""
    data = cut(bench.recordings())
    sigma = [noise_floor(part, bench.arm).sigma for part in data]
    strap = CATALOGUE['interface_slack'].on(bench.robot, ('elbow',))
    shape = strap.shape_values.copy()
    shape[:, -1] = 5.0
    fitted = fit(bench.arm, [Named(strap.with_shape(shape), (0,))], data, sigma, None)
    assert np.all(np.isinf(fitted.estimate.std))
