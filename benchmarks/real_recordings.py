# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Recordings of real machines as bags and URDFs.

The recordings, in the formats of their authors, are in the folder of the environment variable
ARMID_DATA; its README files give sources and licences.

"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import distribution
import os
from pathlib import Path
import sys

from armid_ros.recording import Recording, write_recording
import numpy as np
from scipy.io import loadmat

EMPS_URDF = """<robot name="emps">
  <link name="rail"/>
  <link name="carriage">
    <inertial>
      <mass value="100"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
    </inertial>
  </link>
  <joint name="slide" type="prismatic">
    <parent link="rail"/><child link="carriage"/><axis xyz="1 0 0"/>
    <limit lower="-0.5" upper="0.5" effort="352" velocity="0.5"/>
  </joint>
</robot>
"""

#: Force per controller volt of the EMPS drive [N/V]; from its data set.
EMPS_GAIN = 35.15065

#: Motor to joint of the TX40: positions q = inv(RQ) motor, torques tau = RT motor.
_RATIOS = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
TX40_POSITION = _RATIOS + 32.0 * np.eye(6)[:, [5]] @ np.eye(6)[[4]]
TX40_TORQUE = _RATIOS + 32.0 * np.eye(6)[:, [4]] @ np.eye(6)[[5]]
TX40_OFFSET = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])
TX40_PERIOD = 2e-4


@dataclass(frozen=True)
class RealData:
    """
    Bags and description of one real machine.

    Attributes
    ----------
    robot : Path
        URDF.
    bags : tuple of Path
        Training bag first.

    """

    robot: Path
    bags: tuple[Path, ...]


def folder() -> Path:
    """Return the folder of the recordings; end the program with a message without ARMID_DATA."""
    if 'ARMID_DATA' not in os.environ:
        print('ARMID_DATA names no folder with recordings of real machines', file=sys.stderr)
        raise SystemExit(0)
    return Path(os.environ['ARMID_DATA'])


def emps(data: Path, out: Path) -> RealData:
    """Return bags of the electro-mechanical positioning system, without and with pulses."""
    robot = out / 'emps.urdf'
    robot.write_text(EMPS_URDF, encoding='utf-8')
    bags = []
    for name in ('DATA_EMPS', 'DATA_EMPS_PULSES'):
        table = loadmat(data / 'emps' / f'{name}.mat')
        t, q, volts = (table[key].ravel().astype(float) for key in ('t', 'qm', 'vir'))
        tau = EMPS_GAIN * volts
        bags.append(_bag(out / name.lower(), ('slide',), t - t[0], q[:, None], tau[:, None]))
    return RealData(robot, tuple(bags))


def tx40(data: Path, out: Path) -> RealData:
    """Return a bag of the Staubli TX40 on the joint side, with its wrist coupling resolved."""
    files = data / 'tx40_staubli'
    motor = np.loadtxt(files / 'pos_read_data.csv', delimiter=',', skiprows=1)
    current = np.loadtxt(files / 'curr_data.csv', delimiter=',', skiprows=1)
    q = motor @ np.linalg.inv(TX40_POSITION).T + TX40_OFFSET
    joints = tuple(f'joint_{number}' for number in range(1, 7))
    t = TX40_PERIOD * np.arange(len(q))
    bag = _bag(out / 'tx40', joints, t, q, current @ TX40_TORQUE.T)
    return RealData(files / 'tx40_mdh_modified.urdf', (bag,))


def ur10(data: Path) -> RealData:
    """Return the unchanged ROS 2 bag of the UR10, and its description."""
    robot = example_robot('ur_description/urdf/ur10_robot.urdf')
    return RealData(robot, (data / 'ur10_ros2bag' / 'ur10_exciting_trajectory.db3',))


def example_robot(path: str) -> Path:
    """Return the URDF of a robot of the package example-robot-data."""
    package = distribution('example-robot-data')
    wanted = f'share/example-robot-data/robots/{path}'
    (found,) = [file for file in package.files or [] if str(file).endswith(wanted)]
    return Path(str(package.locate_file(found)))


def _bag(
    path: Path, joints: tuple[str, ...], t: np.ndarray, q: np.ndarray, tau: np.ndarray
) -> Path:
    write_recording(path, Recording(joints=joints, t=t, q=q, tau=tau))
    return path
