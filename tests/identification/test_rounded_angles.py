# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm that hangs, described with an angle of 3.14159, is identified as any other."""

from armid_ros.identification import identify
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench, UPRIGHT_URDF

CEILING = (
    '<robot name="upright"><link name="world"/><joint name="ceiling" type="fixed">'
    '<parent link="world"/><child link="base"/><origin xyz="0 0 2" rpy="3.14159 0 0.4"/></joint>'
)


@pytest.mark.slow
def test_links_stay_as_light_as_they_are():
    hung = UPRIGHT_URDF.replace('<robot name="upright">', CEILING)
    bench = Bench(hung, (0.4, 0.3, 0.2), (0.6, 0.5, 0.3))
    found = identify(bench.arm, bench.recordings(), rng=np.random.default_rng(0))
    masses = [body.mass for body in found.arm.robot.model.inertias][1:]
    np.testing.assert_allclose(masses, [4.0, 3.0, 1.5], rtol=0.05)
    assert found.condition_number < 1e4
