# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Temperatures of a simulated arm."""

from armid_ros.errors import ModelError
from armid_ros.simulation.warm_up import temperature_course
import numpy as np
import pytest


def test_joints_warm_up_with_a_time_constant_or_stay_as_they_are():
    course = temperature_course('20:45:600,30', 2, 600.0)
    warm = 45.0 - 25.0 * np.exp(-1.0)
    np.testing.assert_allclose(course.at([0.0, 600.0]), [[20.0, 30.0], [warm, 30.0]])


@pytest.mark.parametrize('text', ['hot', '20:45', '20,30,40', '20:45:600:1', ''])
def test_other_texts_are_refused(text):
    with pytest.raises(ModelError, match='write 25, or 20:45:600'):
        temperature_course(text, 2, 10.0)
