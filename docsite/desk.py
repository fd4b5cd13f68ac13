# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The files in the examples of pages and docstrings: an arm, its plan, and a week of recordings.

``my_arm.urdf`` is the arm of the examples. The recorded arm has friction that ``my_arm.urdf``
lacks. The arm is unchanged on Monday and Tuesday, holds 0.4 kg on Friday, and has a spring at its
elbow today. ``bags`` and ``examples`` are folders of the repository.

"""

from __future__ import annotations

from pathlib import Path
import shutil

import armid_ros as ar
import numpy as np

ARM = Path(__file__).parents[1] / 'examples' / 'arm.urdf'
FRICTION = ('viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2')
LOAD = (
    'payload@elbow:payload_m=0.4,payload_mz=0.12,'
    'payload_Ixx=0.04,payload_Iyy=0.04,payload_Izz=0.001'
)
SPRING = 'joint_spring@elbow:spring_stiffness=2'
#: Torque constant times gear ratio of the motors, for the currents in log.csv [N m/A].
GAIN = 4.0


def lay_out(folder: Path) -> Path:
    """Write the files of the examples into a folder, and return the folder."""
    urdf = folder / 'my_arm.urdf'
    shutil.copy(ARM, urdf)
    for name in ('bags', 'examples'):
        shutil.copytree(ARM.parents[1] / name, folder / name)
    arms = {
        'monday': FRICTION,
        'tuesday': FRICTION,
        'friday': (*FRICTION, LOAD),
        'today_1': (*FRICTION, SPRING),
        'today_2': (*FRICTION, SPRING),
    }
    plan = ar.design_excitation(urdf, duration=20.0, starts=1, iterations=20)
    plan.save(folder / 'plan')
    runs = {}
    for seed, (name, effects) in enumerate(arms.items()):
        arm = ar.ArmModel.of(urdf, effects=effects)
        runs[name] = ar.simulate(arm, plan, torque_noise=0.05, rng=seed)
        ar.write_recording(folder / name, runs[name], robot_description=urdf.read_text())
    write_log(folder / 'log.csv', runs['monday'])
    for name in ('monday', 'friday'):
        ar.identify(urdf, runs[name]).save(folder / f'{name}_result')
    return folder


def write_log(path: Path, run: ar.Recording) -> None:
    """Write a recording as the CSV file of a data logger: milliseconds, degrees, currents."""
    numbers = range(1, run.n_joints + 1)
    names = ['t_ms', *(f'angle_deg_{k}' for k in numbers), *(f'amps_{k}' for k in numbers)]
    rows = np.column_stack([1e3 * run.t, np.degrees(run.q), run.tau / GAIN])
    np.savetxt(path, rows, fmt='%.9g', delimiter=',', header=','.join(names), comments='')
