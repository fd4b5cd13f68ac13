# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Relative errors and parameters on recordings of real machines, and the published values."""

from pathlib import Path
import tempfile

from armid_ros.arm import ArmModel
from armid_ros.identification import IdentificationSettings, identify, Score, SignalSettings
from armid_ros.recording import read_recording
from armid_ros.robots import load_robot
import numpy as np

from benchmarks import real_recordings

FRICTION = ('viscous_friction', 'coulomb_friction', 'torque_offset')
EMPS_PUBLISHED = {'M': 95.1089, 'Fv': 203.5034, 'Fc': 20.3935, 'offset': -3.1648}


def fit(data, effects, method='wls', **signals):
    """Identify one machine; return the identification and the robot."""
    robot = load_robot(str(data.robot))
    arm = ArmModel.of(robot, effects=effects)
    settings = IdentificationSettings(method, SignalSettings(**signals))
    recording = read_recording(data.bags[0], joints=robot.joints)
    return identify(arm, [recording], settings, rng=np.random.default_rng(0)), robot


def line(what, error, wanted, detail=''):
    """Print one row."""
    print(f'{what:58s} {error:7.2f} %   wanted {wanted:10s} {detail}')


def main():
    """Print the table."""
    data = real_recordings.folder()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        emps = real_recordings.emps(data, out)
        result, robot = fit(emps, FRICTION)
        error = Score.of(result.training).relative_error_percent
        line('EMPS, viscous + Coulomb + offset', error, '<= 4.10 %')
        pulses = result.predict([read_recording(emps.bags[1], joints=robot.joints)])
        line('EMPS, pulses (held out)', Score.of(pulses).relative_error_percent, '<= 6.0 %')
        for (name, published), value in zip(
            EMPS_PUBLISHED.items(), result.estimate.values, strict=True
        ):
            off = 100 * abs(value / published - 1)
            print(f'    {name:7s}{value:9.3f}, published {published:9.3f}: {off:.2f} % off')
        ladder = [(), FRICTION[:1], FRICTION[:2], FRICTION, (*FRICTION, 'asymmetric_friction')]
        errors = [Score.of(fit(emps, e)[0].training).relative_error_percent for e in ladder]
        print('    ladder', ' -> '.join(f'{e:.2f}' for e in errors), '(69.4 17.9 7.1 4.04 3.06)')

        tx40 = real_recordings.tx40(data, out)
        effects = (*FRICTION, 'rotor_inertia')
        for decimation in (100, None):
            settings = {'method': 'ols', 'decimation': decimation}
            coupled, _ = fit(tx40, (*effects, 'coupled_joint_friction'), **settings)
            score = Score.of(coupled.training)
            used = f'decimation {coupled.used.decimation}'
            line('TX40 with the wrist coupling', score.relative_error_percent, '<= 5.2 %', used)
        without = Score.of(fit(tx40, effects, method='ols', decimation=100)[0].training)
        joint = without.joint_relative_error_percent[4]
        line('TX40 without it, joint 5', joint, '> 40 %')

        ur10 = real_recordings.ur10(data)
        for decimation in (1, None):
            result, _ = fit(ur10, FRICTION, decimation=decimation)
            error = Score.of(result.training).relative_error_percent
            line('UR10', error, '<= 6.6 %', f'decimation {result.used.decimation}')


if __name__ == '__main__':
    main()
