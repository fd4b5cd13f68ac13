# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""No patch leaves more of any joint than the model that was given."""

from armid_ros.diagnosis import diagnose
import numpy as np
import pytest

from tests.diagnosis.conftest import TORQUE_NOISE
from tests.diagnosis.test_floor import cut

pytestmark = pytest.mark.long

SIZE = np.array([0.03, 0.05])


def drag(motion, tau):
    """Return a torque that grows with the cube of the speed, which is in no catalogue."""
    return SIZE * motion.dq**3


def left(arm, data):
    """Return the root mean square that an arm leaves of each joint [N m]."""
    rows = [np.where(part.informative, part.residual(arm), np.nan) for part in data]
    return np.sqrt(np.nanmean(np.concatenate(rows) ** 2, axis=0))


@pytest.mark.parametrize('speed', [0, -1], ids=['slow', 'fast'])
def test_a_substitute_of_cubic_drag_makes_no_joint_worse(bench, speed):
    recordings = bench.recordings(drag)
    new = [bench.recordings(drag, seed=50)[speed]]
    found = diagnose(bench.arm, recordings, validate=new, rng=np.random.default_rng(0))
    assert found.verdict != 'consistent'
    for seen in (recordings, new):
        data = cut(seen)
        before, after = left(bench.arm, data), left(found.arm, data)
        assert np.all(after < np.maximum(1.05 * before, TORQUE_NOISE)), found.summary
