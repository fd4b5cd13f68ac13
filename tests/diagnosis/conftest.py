# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Small arms, and recordings of them made without the simulator."""

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnose
from armid_ros.effects import make_effect
from armid_ros.identification import identify
from armid_ros.model import inverse_dynamics
from armid_ros.motion import Motion
from armid_ros.recording import Recording
from armid_ros.robots import robot_from_urdf
import numpy as np
import pytest

LINK = """
  <link name="{name}"><inertial><origin xyz="0 0 {com}"/><mass value="{mass}"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.002"/></inertial>
    <collision><origin xyz="0 0 0.15"/><geometry><box size="0.04 0.04 0.28"/></geometry>
    </collision></link>
"""
PEDESTAL = """
  <link name="base"><collision><origin xyz="0 0 0.1"/><geometry><box size="0.5 0.3 0.2"/>
    </geometry></collision></link>
"""
JOINT = """
  <joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="0 0 {height}"/><axis xyz="{axis}"/>
    <limit lower="-3" upper="3" effort="50" velocity="6"/></joint>
"""
URDF = (
    '<robot name="two_links">'
    + PEDESTAL
    + LINK.format(name='upper', mass=3.0, com=0.15)
    + LINK.format(name='lower', mass=1.5, com=0.12)
    + JOINT.format(name='shoulder', parent='base', child='upper', height=0.5, axis='0 1 0')
    + JOINT.format(name='elbow', parent='upper', child='lower', height=0.35, axis='0 1 0')
    + '</robot>'
)
UPRIGHT_URDF = (
    '<robot name="upright"><link name="base"/>'
    + LINK.format(name='column', mass=4.0, com=0.1)
    + LINK.format(name='upper', mass=3.0, com=0.15)
    + LINK.format(name='lower', mass=1.5, com=0.12)
    + JOINT.format(name='turn', parent='base', child='column', height=0.2, axis='0 0 1')
    + JOINT.format(name='shoulder', parent='column', child='upper', height=0.2, axis='0 1 0')
    + JOINT.format(name='elbow', parent='upper', child='lower', height=0.35, axis='0 1 0')
    + '</robot>'
)
PERIODS = (5.0, 4.0, 4.0)
SPEEDS = (0.6, 1.6, 3.2)
RATE = 200.0
TORQUE_NOISE, POSITION_NOISE = 0.03, 2e-5


class Bench:
    """Makes recordings of an arm: three speeds of two equal periods each."""

    def __init__(self, urdf=URDF, viscous=(0.3, 0.2), coulomb=(0.5, 0.3)):
        self.robot = robot_from_urdf(urdf, gravity='earth')
        self.friction = np.array([viscous, coulomb])
        arm = ArmModel(self.robot)
        arm = arm.with_effect(make_effect('viscous_friction', self.robot), viscous)
        self.arm = arm.with_effect(make_effect('coulomb_friction', self.robot), coulomb)

    def named_friction(self):
        """Return the arm with friction effects whose values are not given."""
        return self.arm.with_theta(
            np.concatenate([self.robot.rigid_parameters, 0.0 * self.friction.ravel()])
        )

    def motion(self, speed, period, seed):
        """Return a motion of sums of harmonics over two periods and a second."""
        rng = np.random.default_rng(seed)
        t = np.arange(round((2 * period + 1.0) * RATE)) / RATE
        joints = self.robot.n_joints
        q, dq, ddq = np.zeros((3, len(t), joints))
        for joint in range(joints):
            phases = rng.uniform(0.0, 2 * np.pi, 4)
            sizes = rng.uniform(0.5, 1.0, 4)
            w = 2 * np.pi / period * np.arange(1, 5)
            scale = speed / np.sum(sizes * w / 3)
            angle = np.outer(t, w) + phases
            q[:, joint] = scale * np.sin(angle) @ sizes
            dq[:, joint] = scale * np.cos(angle) @ (sizes * w)
            ddq[:, joint] = -scale * np.sin(angle) @ (sizes * w**2)
        return Motion(self.robot.joints, t, q, dq, ddq)

    def recordings(self, hidden=None, seed=0, noise=1.0):
        """
        Return recordings.

        Parameters
        ----------
        hidden : callable, optional
            Function from a motion and the torque of the known arm to an additional torque (N, n).
        seed : int
            Seed of motions and noise.
        noise : float
            Factor on both noises.

        """
        rng = np.random.default_rng(seed + 100)
        result = []
        for k, (speed, period) in enumerate(zip(SPEEDS, PERIODS, strict=True)):
            motion = self.motion(speed, period, seed + 10 * k)
            tau = self.torque(motion)
            if hidden is not None:
                tau = tau + hidden(motion, tau)
            shape = motion.q.shape
            result.append(
                Recording(
                    joints=self.robot.joints,
                    t=motion.t,
                    q=motion.q + noise * POSITION_NOISE * rng.normal(size=shape),
                    tau=tau + noise * TORQUE_NOISE * rng.normal(size=shape),
                    source=f'speed {speed:g}',
                )
            )
        return result

    def torque(self, motion):
        """Return the torque of rigid body and known friction, computed without effects."""
        friction = self.friction[0] * motion.dq + self.friction[1] * np.sign(motion.dq)
        return inverse_dynamics(self.robot, motion) + friction


def diagnosed(arm, recordings, **options):
    """Diagnose recordings, always with the same random numbers."""
    return diagnose(arm, recordings, rng=np.random.default_rng(0), **options)


def changed_since(arm, before, after, new=()):
    """Identify a model from recordings, and ask what has changed since."""
    model = identify(arm, before, rng=np.random.default_rng(0)).arm
    return diagnosed(model, after, validate=new, baseline=before)


def on_elbow(torque):
    """Return a torque (N,) of the elbow, the second of two joints, as one of all joints."""
    return np.outer(torque, [0.0, 1.0])


def drag(size):
    """Return a torque of the elbow that grows with the square of its speed."""
    return lambda motion, tau: on_elbow(size * motion.dq[:, 1] * np.abs(motion.dq[:, 1]))


@pytest.fixture(scope='session')
def bench():
    """Return a bench of an arm of two links in a vertical plane."""
    return Bench()


@pytest.fixture(scope='session')
def upright():
    """Return a bench of an arm with an upright axis and two level ones."""
    return Bench(UPRIGHT_URDF, (0.4, 0.3, 0.2), (0.6, 0.5, 0.3))
