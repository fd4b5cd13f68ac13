# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A cause pays for its values by what it takes of what is left, however large another one is."""

from armid_ros.arm import Misfit
from armid_ros.diagnosis import diagnose, DiagnosisSettings
import numpy as np
import pytest


def hidden(size):
    """Return drag of the shoulder, and a spring at the elbow that is so much weaker."""
    return lambda m, tau: np.array([6.0, 0.0]) * m.dq * np.abs(m.dq) + np.array([0.0, size]) * m.q


def test_a_small_cause_is_named_beside_one_that_takes_everything(bench):
    size = 0.05
    settings = DiagnosisSettings(material=0.0)
    misfit = Misfit('held-out', {'shoulder': 0.01, 'elbow': 0.01}, 0.2)
    found = diagnose(
        bench.arm,
        bench.recordings(hidden(size)),
        misfit=misfit,
        settings=settings,
        rng=np.random.default_rng(0),
    )
    drag, spring = found.findings
    assert found.verdict == 'named'
    assert (drag.name, drag.joints) == ('quadratic_friction', ('shoulder',)) and drag.share > 0.99
    assert (spring.name, spring.joints) == ('joint_spring', ('elbow',)) and spring.share < 0.01
    assert spring.values[0] == pytest.approx(size, rel=0.2)
