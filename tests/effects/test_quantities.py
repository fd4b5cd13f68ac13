# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An interval of a shape says something, or nothing."""

from armid_ros.effects import Shape
import numpy as np
import pytest

TIME = Shape('time', 's', 0.1, 1e5, 600.0, (10.0, 60.0, 3000.0))
LAG = Shape('lag', 's', 0.0, 1.0, 0.0, (0.0, 0.001, 0.01))
POWER = Shape('power', '', 0.3, 4.0, 2.0, (1.0, 2.0))


@pytest.mark.parametrize(
    ('shape', 'value', 'half', 'told'),
    [
        (TIME, 206.0, 40.0, True),
        (TIME, 206.0, 25000.0, False),
        (TIME, 206.0, np.inf, False),
        (LAG, 0.0, 0.002, True),
        (LAG, 0.0, 0.05, False),
        (POWER, 2.0, 0.5, True),
        (POWER, 2.0, 3.0, False),
    ],
)
def test_a_shape_is_determined_where_its_interval_leaves_something_out(shape, value, half, told):
    assert shape.determined(value, half) is told
