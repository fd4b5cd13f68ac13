# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Several causes at once: a small one beside a large one, and one that resembles two others."""

from armid_ros.arm import Misfit
from armid_ros.diagnosis import diagnose, DiagnosisSettings
from armid_ros.identification import identify
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench, UPRIGHT_URDF
from tests.diagnosis.test_payload import held_by


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


def test_a_cause_that_resembles_two_others_is_exchanged_for_them():
    """A person who pulls is accepted first, and then the spring."""
    bench = Bench(UPRIGHT_URDF, 3 * (0.3,), 3 * (0.5,))
    held = held_by(bench.robot, link=1)

    def both(motion, tau):
        return held(motion, tau) + np.array([0.0, 0.0, 2.0]) * motion.q

    before, after = bench.recordings(seed=1)[:2], bench.recordings(both, seed=2)[:2]
    arm = identify(bench.arm, before, rng=np.random.default_rng(0)).arm
    found = diagnose(arm, after, baseline=before, rng=np.random.default_rng(0))
    assert {one.name for one in found.findings} == {'payload', 'joint_spring'}
