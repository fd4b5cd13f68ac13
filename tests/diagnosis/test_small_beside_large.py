# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A cause pays for its values by what it takes of what is left, however large another one is."""

from armid_ros.arm import Misfit
from armid_ros.diagnosis import diagnose, DiagnosisSettings
from armid_ros.effects import CATALOGUE
import numpy as np
import pytest


def hidden(size):
    """Return drag of the shoulder, and a spring at the elbow that is so much weaker."""
    return lambda m, tau: np.array([6.0, 0.0]) * m.dq * np.abs(m.dq) + np.array([0.0, size]) * m.q


@pytest.mark.parametrize('size', [0.05, pytest.param(0.2, marks=pytest.mark.long)])
def test_a_small_cause_is_named_beside_one_that_takes_everything(bench, size):
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


@pytest.mark.long
def test_a_payload_is_not_lost_in_a_body_fitted_anew_where_something_else_is_small(bench):
    """Links of a model that was right when it was identified do not change."""
    heavier = CATALOGUE['payload'].on(bench.robot, ('elbow',))
    mass = np.array([0.5, 0.0, 0.0, 0.12, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    payload = bench.arm.with_effect(heavier, mass)

    def extra(m, tau):
        load = payload.torque(m) - bench.arm.torque(m)
        return load + np.array([0.0, 0.2]) * np.sin(9.0 * m.q)

    misfit = Misfit('held-out', {'shoulder': 0.01, 'elbow': 0.01}, 0.2)
    found = diagnose(
        bench.arm, bench.recordings(extra), misfit=misfit, rng=np.random.default_rng(0)
    )
    load, ripple = found.findings
    assert load.name == 'payload' and load.values[0] == pytest.approx(0.5, abs=0.03)
    assert (ripple.name, ripple.joints) == ('torque_ripple', ('elbow',))
    assert not load.rivals
