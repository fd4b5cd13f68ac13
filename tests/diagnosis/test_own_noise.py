# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A prediction does not contain the measurement: columns are made of the torque of the model."""

from dataclasses import replace

from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.search.candidates import without_measurement
from armid_ros.effects import CATALOGUE
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest

USED = Conditioning(200.0, 20.0, 5)


@pytest.fixture(scope='module')
def parts(bench):
    """Return a recording, and the same with another measured torque."""
    one = bench.recordings()[0]
    louder = replace(one, tau=one.tau + np.sin(one.t)[:, np.newaxis])
    return [trajectories([each], USED)[0] for each in (one, louder)]


@pytest.mark.parametrize('name', CATALOGUE)
def test_what_is_measured_changes_no_column(bench, parts, name):
    effect = CATALOGUE[name].on(bench.robot)
    reads = name == 'actuator_saturation'
    if reads:
        effect = effect.with_shape((0.5 * np.abs(parts[0].motion.tau).max(),))
    one, other = (
        without_measurement(part, bench.arm).columns(bench.arm, effect) for part in parts
    )
    np.testing.assert_array_equal(one, other)
    read, changed = (part.columns(bench.arm, effect) for part in parts)
    assert np.array_equal(read, changed) != reads
