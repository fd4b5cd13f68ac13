# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A residual is described by the joint and the quantity it follows, in the units of the joint."""

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.verdict.where import locate
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest

from .conftest import Bench, URDF

SLIDES = URDF.replace('type="revolute"', 'type="prismatic"', 1)


def located(bench, joint, curve):
    """Locate a residual that is a curve of the position of a joint; return it and the residual."""
    data = trajectories(bench.recordings(), Conditioning(200.0, 10.0, 11))
    residual = [np.zeros_like(part.torque) for part in data]
    for part, left in zip(data, residual, strict=True):
        left[:, joint] = curve(part.at_rows.q[:, joint])
    evidence = Evidence.over_noise(data, tuple(np.full(2, 0.1) for _ in data))
    (found,) = locate(bench.arm, evidence, residual, evidence.chi2_per_row(residual))
    told = np.concatenate([part.informative[:, joint] for part in data])
    return found, np.concatenate([left[:, joint] for left in residual])[told]


@pytest.mark.parametrize(
    'urdf, joint, units',
    [
        (SLIDES, 0, ('m/s', 'm', 'N', 'N', 'm/s^2', 's')),
        (SLIDES, 1, ('rad/s', 'rad', 'N m', 'N m', 'rad/s^2', 's')),
        (URDF, 0, ('rad/s', 'rad', 'N m', 'N m', 'rad/s^2', 's')),
    ],
)
def test_a_spring_is_in_proportion_to_position_in_the_units_of_its_joint(urdf, joint, units):
    bench = Bench(urdf)
    found, _ = located(bench, joint, lambda q: 30.0 * q)
    assert found.joint == bench.robot.joints[joint]
    assert found.unit == units[2]
    assert found.share_of_gap == pytest.approx(1.0)
    assert 'proportion' in found.signature and 'position' in found.signature
    order = ('velocity', 'position', 'load', 'load against motion', 'acceleration', 'time')
    by_name = {axis.name: axis.unit for axis in found.axes}
    assert tuple(by_name[name] for name in order) == units
    position = found.axes[0]
    np.testing.assert_allclose(position.means, 30.0 * position.centres, rtol=1e-6, atol=1e-9)


def test_an_offset_is_a_constant_and_in_proportion_to_nothing(bench):
    found, _ = located(bench, 1, lambda q: 1.2 + 0.0 * q)
    assert found.joint == bench.robot.joints[1]
    assert found.signature.startswith('constant')
    assert (found.mean, found.mean_share) == (pytest.approx(1.2), pytest.approx(1.0))


def test_a_line_that_misses_zero_is_in_proportion_to_nothing_and_its_mean_is_known(bench):
    found, every = located(bench, 1, lambda q: 5.0 + 3.0 * q)
    assert found.mean == pytest.approx(every.mean())
    assert found.mean_share == pytest.approx(every.mean() ** 2 / np.mean(every**2))
    assert 'proportion' not in found.signature
