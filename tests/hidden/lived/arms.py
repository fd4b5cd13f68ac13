# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The arms that have lived: published descriptions, and drawn ones of three to seven joints."""

from __future__ import annotations

from functools import cache

from armid_ros.robots import Robot, robot_from_urdf
import numpy as np

from tests.hidden.arrays import body_parts, body_vector, FloatArray
from tests.hidden.machines import load_published

#: Where the description of each arm is: a shipped name or a file of example-robot-data.
PUBLISHED = {
    'humanoid': 'humanoid_arm',
    'ur3': 'ur_description/urdf/ur3_robot.urdf',
    'ur5': 'ur_description/urdf/ur5_robot.urdf',
    'ur10': 'ur_description/urdf/ur10_robot.urdf',
    'panda': 'panda_description/urdf/panda.urdf',
    'xarm7': 'xarm_description/urdf/xarm7.urdf',
    'so101': 'so_arm_description/urdf/so101.urdf',
    'z1': 'z1_description/urdf/z1.urdf',
    'talos': 'robots/talos_data/robots/talos_left_arm.urdf',
}

#: The arms of each set. 'drawn-n-k' is drawn arm number k of n joints.
ARMS = {
    'development': (
        *('humanoid', 'ur5', 'panda', 'drawn-6-0', 'z1', 'drawn-4-0', 'ur10', 'drawn-7-0'),
        *('drawn-5-0', 'drawn-3-0'),
    ),
    'development_2': (
        *('xarm7', 'drawn-6-1', 'ur3', 'panda', 'talos', 'drawn-7-1', 'ur5', 'drawn-4-1'),
        *('drawn-5-1', 'drawn-6-2', 'drawn-3-1', 'humanoid'),
    ),
    'locked': (
        *('drawn-6-3', 'so101', 'drawn-7-2', 'drawn-4-2', 'xarm7', 'drawn-5-2', 'drawn-3-2'),
        *('ur3', 'drawn-6-4', 'talos', 'drawn-7-3', 'drawn-5-3', 'drawn-4-3'),
    ),
}


@cache
def load_arm(name: str) -> Robot:
    """Load an arm as its engineer describes it."""
    if name.startswith('drawn-'):
        return robot_from_urdf(drawn_urdf(name), gravity='earth')
    return load_published(PUBLISHED[name], 'earth')


def drawn_urdf(name: str) -> str:
    """
    Return the description of a drawn arm: tapering links whose axes turn and cross in turn.

    Parameters
    ----------
    name : str
        'drawn-n-k': n joints, number k.

    """
    count, number = (int(part) for part in name.split('-')[1:])
    rng = np.random.default_rng([20261122, count, number])
    reach, weight = rng.uniform(0.7, 1.4), rng.uniform(6.0, 30.0)
    share = np.linspace(1.0, 0.25, count)
    lengths = reach * share / share.sum() * rng.uniform(0.8, 1.2, count)
    masses = weight * share**2 / (share**2).sum() * rng.uniform(0.8, 1.2, count)
    axes = _axes(count, rng)
    parts = [f'<robot name="{name}">', '  <link name="base"/>']
    for j in range(count):
        beyond = masses[j:].sum() * 9.81 * lengths[j:].sum()
        before = lengths[j - 1] if j else 0.15
        parts += _link(f'link_{j + 1}', float(masses[j]), float(lengths[j]), rng)
        parts += [
            f'  <joint name="joint_{j + 1}" type="revolute">',
            f'    <parent link="{f"link_{j}" if j else "base"}"/><child link="link_{j + 1}"/>',
            f'    <origin xyz="{0.02 * (j % 2):.4f} 0 {before:.4f}" rpy="0 0 0"/>',
            f'    <axis xyz="{axes[j]}"/>',
            f'    <limit lower="-2.6" upper="2.6" effort="{2.5 * beyond + 4.0:.2f}" '
            f'velocity="{rng.uniform(1.6, 3.2):.2f}"/>',
            '  </joint>',
        ]
    return '\n'.join([*parts, '</robot>', ''])


def worn_bodies(bodies: FloatArray, rng: np.random.Generator) -> FloatArray:
    """
    Return bodies as they are, of which a description is the drawing, both of shape (n, 10).

    Masses are off by up to 6 per cent, centres by up to 4 mm in each direction.

    """
    worn = bodies.copy()
    for body in worn:
        mass, centre, central = body_parts(body)
        if mass <= 0.0:
            continue
        factor = 1.0 + rng.uniform(-0.06, 0.06)
        body[:] = body_vector(
            mass * factor, centre + rng.uniform(-0.004, 0.004, 3), central * factor
        )
    return worn


def _axes(count: int, rng: np.random.Generator) -> list[str]:
    """Return axes that turn (z) or swing (y or x), never two turning ones in a row."""
    axes = ['0 0 1' if count > 3 or rng.random() < 0.5 else '0 1 0']
    while len(axes) < count:
        swings = ['0 1 0', '0 1 0', '1 0 0']
        choices = swings if axes[-1] == '0 0 1' or len(axes) < 3 else [*swings, '0 0 1', '0 0 1']
        axes.append(str(rng.choice(choices)))
    return axes


def _link(name: str, mass: float, length: float, rng: np.random.Generator) -> list[str]:
    """Return the description of a bar that is not quite straight."""
    radius = 0.12 * length + 0.02
    centre = [*rng.uniform(-0.15, 0.15, 2) * length, length * rng.uniform(0.35, 0.6)]
    across = mass * (3.0 * radius**2 + length**2) / 12.0
    along = mass * radius**2 / 2.0
    xyz = ' '.join(f'{value:.5f}' for value in centre)
    return [
        f'  <link name="{name}">',
        f'    <inertial><origin xyz="{xyz}" rpy="0 0 0"/><mass value="{mass:.4f}"/>',
        f'      <inertia ixx="{across:.6f}" ixy="0" ixz="0" iyy="{across * 1.05:.6f}" iyz="0" '
        f'izz="{along:.6f}"/></inertial>',
        '  </link>',
    ]
