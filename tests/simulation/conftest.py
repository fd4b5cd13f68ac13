# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Small machines with closed-form motion."""

from collections.abc import Callable

from armid_ros.arm import ArmModel
from armid_ros.robots import load_robot, Robot
from armid_ros.simulation import Controller
from armid_ros.simulation.controller import BANDWIDTH, LinearFeedback
import numpy as np
import pytest


def gravity_pd(arm: ArmModel) -> Controller:
    """Return a spring and a damper on every joint, and gravity; Siciliano et al. 2009, 8.5.1."""
    robot, body = arm.robot, LinearFeedback.of(arm)
    inertia = np.diag(robot.inertia(robot.model.createData(), robot.middle_pose))
    inertia = inertia + np.diag(body.added_inertia)
    gains = {'stiffness': inertia * BANDWIDTH**2, 'damping': 2.0 * BANDWIDTH * inertia}
    return Controller(LinearFeedback.of(arm, **gains))


def link(name, com, mass):
    """Return the URDF of a link."""
    return (
        f'<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def joint(name, kind, links, origin, axis, reach, effort):
    """Return the URDF of a joint between two links, with a reach to either side."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{links[0]}"/><child link="{links[1]}"/>'
        f'<origin xyz="{origin}"/><axis xyz="{axis}"/>'
        f'<limit lower="{-reach}" upper="{reach}" velocity="50" effort="{effort}"/></joint>'
    )


@pytest.fixture(scope='session')
def slider() -> Callable[..., Robot]:
    """Return a maker of a block of 2 kg on a rail of 1 km."""

    def make(axis: str = '1 0 0') -> Robot:
        block = link('block', '0 0 0', 2.0)
        rail = joint('slide', 'prismatic', ('rail', 'block'), '0 0 0', axis, 500, 1000)
        return load_robot(f'<robot name="slider"><link name="rail"/>{block}{rail}</robot>')

    return make


@pytest.fixture(scope='session')
def pendulum() -> Callable[..., Robot]:
    """
    Return a maker of hanging chains: links of 0.5 m, each with 1 kg at 0.4 m.

    The inertia of a link about its centre of mass is 0.01 kg m^2.

    """

    def make(links: int = 1, axis: str = '0 1 0', stop: float = 100.0) -> Robot:
        text = '<robot name="pendulum"><link name="link0"/>'
        for k in range(1, links + 1):
            text += link(f'link{k}', '0 0 -0.4', 1.0)
            between, origin = (f'link{k - 1}', f'link{k}'), f'0 0 {0 if k == 1 else -0.5}'
            text += joint(f'joint{k}', 'revolute', between, origin, axis, stop, 100)
        return load_robot(text + '</robot>')

    return make
