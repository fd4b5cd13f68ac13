# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The fit of what was named, and the columns that it is fitted by."""

from dataclasses import replace

from armid_ros.diagnosis.data.evidence import Evidence, noise_floor
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.search.cause import NamedEffect
from armid_ros.diagnosis.search.joint_fit import JointFit, patch_columns
from armid_ros.effects import CATALOGUE
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest

from tests.diagnosis.test_floor import cut


def test_what_does_nothing_along_the_motion_is_not_told(bench):
    """A strap that is never taut has no torque to be fitted to."""
    data = cut(bench.recordings())
    sigma = [noise_floor(part, bench.arm).sigma for part in data]
    strap = CATALOGUE['interface_slack'].on(bench.robot, ('elbow',))
    shape = strap.shape_values.copy()
    shape[:, -1] = 5.0
    problem = JointFit.over_noise(
        bench.arm, Evidence.over_noise(data, sigma), np.random.default_rng(0)
    )
    fitted = problem.fit([NamedEffect(strap.with_shape(shape), (0,), np.zeros(1))])
    assert np.all(np.isinf(fitted.estimate.std))


@pytest.mark.parametrize(
    ('name', 'shape', 'values'),
    [
        ('interface_slack', [0.05, 0.0, 0.1, 0.3, 0.1, 0.2, 0.05], [300.0]),
        ('stribeck_friction', [0.3, 1.5], [0.4]),
        ('actuator_saturation', [1.5], [0.3, 0.1]),
        ('joint_elasticity', [0.002], [1e-3]),
    ],
)
def test_columns_of_a_shape_are_the_derivative_of_the_torque(bench, name, shape, values):
    (part,) = cut(bench.recordings()[:1])
    effect = CATALOGUE[name].on(bench.robot, ('elbow',)).with_shape(shape)
    kept = tuple(range(len(values)))
    named = NamedEffect(effect, kept, np.array(values))
    columns = patch_columns(bench.arm, [named], part)[0][:, :, len(values) :]
    for index in range(len(shape)):
        step = 1e-3 * max(abs(shape[index]), 0.01) * np.eye(len(shape))[index]
        log_odds_over, behind = (
            part.residual(bench.arm.with_effect(effect.with_shape(shape + change), values))
            for change in (step, -step)
        )
        slope = (behind - log_odds_over) / (2.0 * step[index])
        np.testing.assert_allclose(columns[:, :, index], slope, atol=2e-3 * np.abs(slope).max())
        assert np.any(slope)


@pytest.fixture(scope='module')
def parts(bench):
    """Return a recording, and the same with another measured torque."""
    one = bench.recordings()[0]
    louder = replace(one, tau=one.tau + np.sin(one.t)[:, np.newaxis])
    return [trajectories([each], Conditioning(200.0, 20.0, 5))[0] for each in (one, louder)]


@pytest.mark.parametrize('name', CATALOGUE)
def test_what_is_measured_changes_no_column(bench, parts, name):
    """A prediction that contained the measurement would explain everything."""
    effect = CATALOGUE[name].on(bench.robot)
    reads = name == 'actuator_saturation'
    if reads:
        effect = effect.with_shape((0.5 * np.abs(parts[0].motion.tau).max(),))
    torques = [part.motion.with_torque(bench.arm.torque(part.motion)) for part in parts]
    pairs = zip(parts, torques, strict=True)
    one, other = (replace(x, motion=y).columns(bench.arm, effect) for x, y in pairs)
    np.testing.assert_array_equal(one, other)
    read, changed = (part.columns(bench.arm, effect) for part in parts)
    assert np.array_equal(read, changed) != reads
