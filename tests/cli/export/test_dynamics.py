# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The written torque is the torque of the model."""

import shutil
import subprocess

import armid_ros as ar
from armid_ros.cli.export.dynamics import DEAD_BAND, torque_code, torque_tables
from armid_ros.effects.traits import Traits
import numpy as np
import pytest

from tests.effects.test_registry import Hose
from tests.simulation.test_compiled import TREE

STATES = 100
EFFECTS = (
    'viscous_friction:viscous_coefficient=0.3',
    'coulomb_friction:coulomb_torque=0.7',
    'torque_offset:torque_offset=-0.4',
    'rotor_inertia:rotor_inertia=0.05',
    'payload:payload_m=0.4,payload_mx=0.02,payload_mz=0.06,payload_Ixx=0.03,payload_Ixz=0.002',
    'base_tilt:tilt_x=0.2,tilt_y=-0.1',
)
#: Reads states and prints torques.
MAIN = """#include <cstdio>
#include "torque.hpp"
int main() {
  using namespace NAMESPACE;
  double x[3][N], tau[N];
  for (;;) {
    for (auto& row : x) for (double& value : row) if (std::scanf("%lf", &value) != 1) return 0;
    torque(x[0], x[1], x[2], tau);
    for (double value : tau) std::printf("%.17g ", value);
  }
}
"""


@pytest.fixture(scope='module')
def arm():
    """Return an arm of two branches with all effects that the code has, and no identifier."""
    tree = TREE.replace('name="tree"', 'name="2 arms"')
    return ar.ArmModel.of(ar.load_robot(tree), effects=EFFECTS)


@pytest.fixture(scope='module')
def states(arm):
    """Return random positions, velocities beyond the dead band and accelerations, (3, 100, n)."""
    states = np.random.default_rng(0).normal(size=(3, STATES, arm.robot.n_joints))
    states[1] += DEAD_BAND * np.sign(states[1])
    return states


def require_equal(found, arm, states):
    wanted = arm.torque(*states)
    assert np.abs(wanted).max() > 1.0
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


def test_python_computes_the_torque_of_the_model(arm, states):
    text, left_out = torque_code(arm, 'python', 'model.yaml')
    namespace = {}
    exec(compile(text, 'torque.py', 'exec'), namespace)
    rows = states.swapaxes(0, 1).tolist()
    require_equal([namespace['torque'](*state) for state in rows], arm, states)
    still = [0.0] * arm.robot.n_joints
    for share, friction in ((0.99, 0.0), (1.01, 0.7)):
        slow = [share * DEAD_BAND] * len(still)
        both = [namespace['torque'](still, np.multiply(sign, slow), still) for sign in (1, -1)]
        np.testing.assert_allclose(np.subtract(*both), 2 * friction, atol=0.01)
    assert left_out == ()


def test_cpp_computes_the_torque_of_the_model(arm, states, tmp_path):
    compiler = shutil.which('g++') or shutil.which('c++')
    if compiler is None:
        pytest.skip('no C++ compiler')
    text, _ = torque_code(arm, 'cpp', 'model.yaml')
    (namespace,) = (line.split()[1] for line in text.splitlines() if line.startswith('namespace'))
    (tmp_path / 'torque.hpp').write_text(text)
    (tmp_path / 'main.cpp').write_text(MAIN.replace('NAMESPACE', namespace))
    strict = ('-std=c++17', '-Wall', '-Wextra', '-Wpedantic', '-Werror', '-Wshadow')
    subprocess.run([compiler, *strict, 'main.cpp', '-o', 'main'], cwd=tmp_path, check=True)
    given = ' '.join(map(repr, states.swapaxes(0, 1).ravel().tolist()))
    done = subprocess.run(tmp_path / 'main', input=given, capture_output=True, text=True)
    require_equal(np.array(done.stdout.split(), float).reshape(STATES, -1), arm, states)


class UsualHose(Hose):
    """A law of a user that is fitted by default."""

    traits = Traits(usual=True)


def test_an_effect_of_a_user_is_named_and_is_no_offset():
    arm = ar.ArmModel.of('humanoid_arm')
    arm = arm.with_effect(UsualHose.on(arm.robot, ('elbow_pitch',)), [2.0])
    tables, left_out = torque_tables(arm)
    assert not tables['OFFSET'].any()
    assert any('hose' in line and 'elbow_pitch' in line for line in left_out)
