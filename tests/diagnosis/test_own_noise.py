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


@pytest.mark.parametrize('name', CATALOGUE)
def test_what_is_measured_changes_no_column(bench, name):
    recordings = bench.recordings()
    louder = [replace(one, tau=one.tau + np.sin(one.t)[:, np.newaxis]) for one in recordings]
    effect = CATALOGUE[name].on(bench.robot)
    reads = name == 'actuator_saturation'
    if reads:
        effect = effect.with_shape((0.5 * np.abs(recordings[0].tau).max(),))
    (one, other), (read, changed) = (
        [
            columns(part)
            for part in (trajectories(recordings, USED)[0], trajectories(louder, USED)[0])
        ]
        for columns in (
            lambda part: without_measurement(part, bench.arm).columns(bench.arm, effect),
            lambda part: part.columns(bench.arm, effect),
        )
    )
    np.testing.assert_array_equal(one, other)
    assert np.array_equal(read, changed) != reads
