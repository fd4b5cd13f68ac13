# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Time to identify a 7-joint arm from ten minutes at 1 kHz, with standard deviations.

This package reads a bag; figaroh (1.0.2) gets the same samples as arrays. Both use the same
filter, decimation and parameters, and weighted least squares. Both run in separate processes,
one after the other; processor time is also valid on a busy machine.

"""

import argparse
import json
from pathlib import Path
import subprocess
import sys
import tempfile
import time

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.recording import read_recording, write_recording
from armid_ros.robots import load_robot
import numpy as np

from benchmarks.multisine import multisine
from benchmarks.real_recordings import example_robot

RATE = 1000.0
CUTOFF_HZ = 20.0
DECIMATION = 20
FRICTION = {'viscous_friction': 0.5, 'coulomb_friction': 0.3, 'torque_offset': 0.1}


def panda():
    """Return the model of the Panda arm with friction."""
    arm = ArmModel(load_robot(str(example_robot('panda_description/urdf/panda.urdf'))))
    for name, value in FRICTION.items():
        arm = arm.with_effect(make_effect(name, arm.robot), np.full(7, value))
    return arm


def motion(arm, minutes, rng):
    """Return a recording of three sines per joint with noisy torque."""
    t = np.arange(round(60 * minutes * RATE)) / RATE
    exact = multisine(arm.robot.joints, t, rng)
    return exact.with_torque(arm.torque(exact) + 0.05 * rng.normal(size=exact.q.shape))


def ours(bag):
    """Identify with this package; return wall and processor time, and friction of joint 1."""
    from armid_ros.identification import IdentificationSettings, identify, SignalSettings

    arm = panda()
    arm = ArmModel(arm.robot, arm.effects)
    start = _now()
    recording = read_recording(bag, joints=arm.robot.joints)
    settings = IdentificationSettings('wls', SignalSettings(CUTOFF_HZ, DECIMATION))
    result = identify(arm, [recording], settings, rng=np.random.default_rng(0))
    seconds = _since(start)
    index = result.estimate.index('viscous_coefficient', arm.robot.joints[0])
    return seconds, result.estimate.values[index], result.estimate.std[index]


def figaroh_arm(robot, recording, cutoff_hz, every=1):
    """Return a subclass of figaroh's identification that uses every k-th sample."""
    from figaroh.identification.base_identification import BaseIdentification

    n = robot.n_joints

    class Arm(BaseIdentification):
        def load_param(self, config_file, setting_type='identification'):
            self.identif_config = {
                'robot_name': robot.name,
                'act_idxq': list(range(n)),
                'act_idxv': list(range(n)),
                'active_joints': list(robot.joints),
                'has_friction': True,
                'has_actuator_inertia': False,
                'has_joint_offset': True,
                'is_joint_torques': True,
                'is_external_wrench': False,
                'force_torque': None,
                **dict.fromkeys(('fv', 'fs', 'Ia', 'off'), [0.0] * n),
                'filter_config': {
                    'differentiation_method': 'gradient',
                    'filter_params': {
                        'nbutter': 4,
                        'f_butter': cutoff_hz,
                        'med_fil': 5,
                        'f_sample': 1.0 / (every * recording.period),
                    },
                },
            }

        def load_trajectory_data(self, data_source=None):
            return {
                'timestamps': recording.t[::every],
                'positions': recording.q[::every],
                'velocities': None,
                'accelerations': None,
                'torques': recording.tau[::every],
            }

    return Arm


def theirs(bag):
    """Identify with figaroh; return wall and processor time, and friction of joint 1."""
    from pinocchio.robot_wrapper import RobotWrapper

    robot = panda().robot
    arm = figaroh_arm(robot, read_recording(bag, joints=robot.joints), CUTOFF_HZ)
    start = _now()
    task = arm(RobotWrapper(robot.model.copy()), '')
    task.initialize()
    task.solve(decimation_factor=DECIMATION, plotting=False, wls=True)
    seconds = _since(start)
    index = next(k for k, name in enumerate(task.params_base) if name.startswith('fv'))
    deviation = abs(task.phi_base[index]) * task.result['wls_std_deviations'][index] / 100
    return seconds, task.phi_base[index], deviation


def _now():
    return time.perf_counter(), time.process_time()


def _since(start):
    return [now - then for now, then in zip(_now(), start, strict=True)]


def main():
    """Print the times of both packages and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--minutes', type=float, default=10.0)
    parser.add_argument('--run', choices=['ours', 'theirs'], help=argparse.SUPPRESS)
    parser.add_argument('--bag', type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.run:
        print(json.dumps({'ours': ours, 'theirs': theirs}[arguments.run](arguments.bag)))
        return
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder, 'panda')
        arm = panda()
        write_recording(bag, motion(arm, arguments.minutes, np.random.default_rng(0)))
        seconds = {}
        for name in ('ours', 'theirs'):
            command = [sys.executable, '-m', 'benchmarks.offline_speed', '--run', name]
            done = subprocess.run(
                [*command, '--bag', str(bag)], capture_output=True, text=True, check=True
            )
            seconds[name], value, std = json.loads(done.stdout.splitlines()[-1])
            wall, processor = seconds[name]
            print(
                f'{name:7s}{wall:8.1f} s, {processor:6.1f} s of processor; viscous friction of '
                f'joint 1: {value:.4f} ± {std:.4f} N m s/rad '
                f'(true {FRICTION["viscous_friction"]})'
            )
        wall, processor = np.divide(seconds['theirs'], seconds['ours'])
        print(f'ratio {wall:.1f} x, of processor time {processor:.1f} x, wanted 10 x')


if __name__ == '__main__':
    main()
