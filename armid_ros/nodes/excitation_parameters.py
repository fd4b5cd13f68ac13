# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the parameters of the excitation publisher say, as the excitation they describe."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    design,
    DesignSettings,
    Excitation,
    Limits,
    load_excitation,
    require_within,
    SPEED_CLASSES,
    whole_period,
)
from armid_ros.motion import Motion
from armid_ros.nodes.parameters import NodeParameter
from armid_ros.robots import collision_model, load_robot, Robot
import numpy as np

Values = Callable[[str], Any]

#: Samples a second at which a loaded excitation is compared with the limits [Hz].
_CHECK_RATE = 200.0

EXCITATION_PARAMETERS = (
    NodeParameter('robot', 'humanoid_arm', 'A shipped robot, or the path of a URDF or xacro.'),
    NodeParameter('gravity', 'earth', 'earth, moon, or x,y,z in the base frame [m/s^2].'),
    NodeParameter('file', '', 'Excitation to use (.yaml or .csv); empty: design one.'),
    NodeParameter('duration', 44.0, 'From rest to rest.', 's', lower=1.0, upper=3600.0),
    NodeParameter('n_periods', 2, 'Identical periods in it.', lower=1, upper=100),
    NodeParameter('run_in', 2.0, 'Of the run-in, and the run-out.', 's', lower=0.1, upper=60.0),
    NodeParameter('harmonics', 5, 'Harmonics of every joint.', lower=1, upper=30),
    NodeParameter(
        'speed', 'fast', 'Share of the velocity limits used.', choices=tuple(SPEED_CLASSES)
    ),
    NodeParameter(
        'effects',
        ['viscous_friction', 'coulomb_friction', 'torque_offset'],
        'Effects that are to be seen, beside the rigid body.',
    ),
    NodeParameter('clearance', 0.01, 'Kept between bodies.', 'm', lower=0.0, upper=1.0),
    NodeParameter(
        'design_time', 20.0, 'What the search may take at most.', 's', lower=1.0, upper=86400.0
    ),
    NodeParameter(
        'seed',
        0,
        'Of the search; the same gives the same, if it has the time.',
        lower=0,
        upper=2**62,
    ),
)


def make_excitation(value: Values, rate: float) -> Excitation:
    """
    Load or design the excitation that parameters describe.

    Parameters
    ----------
    value : callable
        Returns the value of a parameter of `EXCITATION_PARAMETERS`.
    rate : float
        Samples per second at which it will be sent [Hz].

    Raises
    ------
    ArmidError
        If there is no such file or robot, or the excitation does not keep the limits.

    """
    robot = load_robot(value('robot'), gravity=value('gravity'))
    if value('file'):
        return _loaded(value('file'), robot, value('clearance'))
    arm = ArmModel(robot)
    for name in filter(None, value('effects')):
        arm = arm.with_effect(make_effect(name, robot))
    periods, run_in = value('n_periods'), value('run_in')
    settings = DesignSettings(
        period=whole_period(value('duration'), periods, run_in, rate),
        harmonics=value('harmonics'),
        n_periods=periods,
        run_in=run_in,
        speed=value('speed'),
        clearance=value('clearance'),
        starts=2,
        time_budget=value('design_time'),
        processes=1,  # a signal to the node must not leave others behind
    )
    rng = np.random.default_rng(value('seed'))
    return design(arm, settings, rng, collision=collision_model(robot)).excitation


def _loaded(path: str, robot: Robot, clearance: float) -> Excitation:
    excitation = load_excitation(path)
    if set(excitation.joints) != set(robot.joints):
        raise TrajectoryError(
            f'{path}: moves {", ".join(excitation.joints)}, but {robot.name} has '
            f'{", ".join(robot.joints)}'
        )
    t = np.arange(0.0, excitation.duration, 1.0 / _CHECK_RATE)
    run = excitation.at(t)
    order = [run.joints.index(joint) for joint in robot.joints]
    motion = Motion(robot.joints, t, run.q[:, order], run.dq[:, order], run.ddq[:, order])
    limits = Limits.of(
        robot,
        speed=1.0,
        torque_fraction=1.0,
        position_margin=0.0,
        acceleration=np.full(robot.n_joints, np.inf),  # no description knows it
    )
    require_within(limits, motion, ArmModel(robot).torque(motion))
    closest = collision_model(robot).path_clearance(motion.q)
    worst = int(np.argmin(closest))
    if closest[worst] < clearance:
        raise TrajectoryError(
            f'{path}: {robot.name} comes as near as {closest[worst]:.3g} m to itself at '
            f'{t[worst]:.2f} s; {clearance:g} m are wanted'
        )
    return excitation
