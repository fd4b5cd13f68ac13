# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every example runs alone, has a one-line docstring, and finds the hidden value."""

import importlib.util
import os
from pathlib import Path
import re
import subprocess
import sys

import armid_ros as ar
import pytest

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / 'examples').glob('*.py'))
#: Pattern in the output of each example.
FOUND = {
    'askew_base': r'tilt|gravity',
    'elastic_joints': r'elbow +(39|40)\d\d N m/rad',
    'exoskeleton': r'^(99|100)\d\d ± \d+ N/m',
    'from_csv': r'^GOOD: ',
    'gait_torques': r'error of the knee at 200 Hz: 0\.0\d+ deg',
    'gravity_of_the_moon': r'gravity',
    'hidden_effect_in_mujoco': r'elbow.*spring',
    'inspect_recording': r'velocities of waist.*degrees/s',
    'own_effect': r'stiffness 1\.[45]\d+.*Hose in elbow',
    'own_urdf': r'^GOOD: ',
    'payload_between_days': r'added: 0\.40 kg',
    'physical_urdf': r'together +5\.000 kg',
    'positions_alone': r'friday_positions\.npz: \d+ samples',
}
LONGEST = 60


@pytest.mark.parametrize('path', EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_says_what_it_is_about(path):
    text = path.read_text()
    assert len(text.splitlines()) < LONGEST
    assert re.search(r'^""".+\."""$', text, re.MULTILINE)


@pytest.mark.parametrize('name', FOUND)
def test_an_example_finds_what_it_is_about(name, tmp_path):
    done = subprocess.run(
        [sys.executable, ROOT / 'examples' / f'{name}.py'],
        cwd=tmp_path,
        env={**os.environ, 'PYTHONPATH': str(ROOT), 'PYTHONIOENCODING': 'utf-8'},
        capture_output=True,
        encoding='utf-8',
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert re.search(FOUND[name], done.stdout, re.MULTILINE | re.DOTALL), done.stdout


def test_every_example_is_run_and_listed():
    assert {path.stem for path in EXAMPLES} == {*FOUND, 'online'}
    listed = (ROOT / 'examples' / 'README.md').read_text()
    assert [path.name for path in EXAMPLES if f'| {path.name} |' not in listed] == []


def test_the_node_of_the_example_learns_the_friction_while_the_arm_moves():
    from armid_ros.nodes.running.domains import private_context
    from sensor_msgs.msg import JointState

    spec = importlib.util.spec_from_file_location('online', ROOT / 'examples' / 'online.py')
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    friction = ('viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2')
    run = ar.simulate(ar.ArmModel.of(example.URDF, effects=friction), torque_noise=0.02)
    with private_context() as context:
        node = example.Identifier(context=context)
        backwards = list(range(run.n_joints))[::-1]
        for t, q, tau in zip(run.t, run.q, run.tau, strict=True):
            message = JointState(
                name=[run.joints[k] for k in backwards],
                position=q[backwards].tolist(),
                effort=tau[backwards].tolist(),
            )
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(
                10**9 + round(t * 1e9), 10**9
            )
            node.on_joint_states(message)
        node.tell()
        estimate = node.online.estimate()
        node.destroy_node()
    for joint in run.joints:
        viscous = estimate.values[estimate.index('viscous_coefficient', joint)]
        assert viscous == pytest.approx(0.3, abs=0.06)
