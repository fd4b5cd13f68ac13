# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Small machines with closed-form motion, and the robots that others made."""

from collections.abc import Callable

from armid_ros.robots import load_robot, Robot
import pytest

_LINK = """
  <link name="{name}">
    <inertial>
      <origin xyz="{com}"/>
      <mass value="{mass}"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>"""

_JOINT = """
  <joint name="{name}" type="{kind}">
    <origin xyz="{origin}"/>
    <parent link="{parent}"/>
    <child link="{child}"/>
    <axis xyz="{axis}"/>
    <limit lower="{lower}" upper="{upper}" velocity="50" effort="{effort}"/>
  </joint>"""


@pytest.fixture(scope='session')
def slider() -> Callable[..., Robot]:
    """Return a maker of a block of 2 kg on a rail of 1 km."""

    def make(axis: str = '1 0 0', effort: float = 1000.0) -> Robot:
        text = '<robot name="slider"><link name="rail"/>'
        text += _LINK.format(name='block', com='0 0 0', mass=2.0)
        text += _JOINT.format(
            name='slide',
            kind='prismatic',
            origin='0 0 0',
            parent='rail',
            child='block',
            axis=axis,
            lower=-500,
            upper=500,
            effort=effort,
        )
        return load_robot(text + '</robot>')

    return make


@pytest.fixture(scope='session')
def pendulum() -> Callable[..., Robot]:
    """
    Return a maker of chains that hang down: 1 kg at 0.4 m of each link of 0.5 m.

    The inertia of a link about its centre of mass is 0.01 kg m^2.

    """

    def make(links: int = 1, axis: str = '0 1 0', stop: float = 100.0) -> Robot:
        text = '<robot name="pendulum"><link name="link0"/>'
        for number in range(1, links + 1):
            text += _LINK.format(name=f'link{number}', com='0 0 -0.4', mass=1.0)
            text += _JOINT.format(
                name=f'joint{number}',
                kind='revolute',
                origin='0 0 0' if number == 1 else '0 0 -0.5',
                parent=f'link{number - 1}',
                child=f'link{number}',
                axis=axis,
                lower=-stop,
                upper=stop,
                effort=100,
            )
        return load_robot(text + '</robot>')

    return make
