# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm in MuJoCo with hidden zeros, gains, tilt, tool and dry friction that plays a tour."""

from dataclasses import dataclass

from armid_ros.recording import Recording
import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tests.hidden.load import Payload
from tests.hidden.machines import drive_size
from tests.hidden.plant import Plant, run
from tests.hidden.trajectories import Reference


@dataclass(frozen=True)
class Secret:
    """What is hidden in an arm: per joint arrays, tilt as a rotation vector, tool."""

    zero: np.ndarray
    gain: np.ndarray
    friction: np.ndarray
    tilt: np.ndarray
    mass: float
    center: np.ndarray

    @classmethod
    def draw(cls, robot, rng):
        """Draw zeros up to 5 % of the drives, gains to 10 %, a tilt to 5 deg, a tool."""
        n, drive = robot.n_joints, drive_size(robot)
        whole = robot.rigid_parameters[::10].sum()
        return cls(
            zero=0.05 * drive * rng.uniform(-1.0, 1.0, n),
            gain=1.0 + rng.uniform(-0.1, 0.1, n),
            friction=drive * rng.uniform(0.005, 0.03, n),
            tilt=np.radians(rng.uniform(-3.5, 3.5, 2)),
            mass=float(whole * rng.uniform(0.03, 0.12)),
            center=rng.uniform(-0.05, 0.05, 3) + [0.0, 0.0, 0.08],
        )

    def gravity(self, robot):
        """Return gravity in the frame of the tilted base [m/s^2]."""
        return Rotation.from_rotvec([*self.tilt, 0.0]).inv().apply(np.array(robot.gravity))


def play(robot, excitation, secret, rng, rate=200):
    """Return what instruments record while the arm plays an excitation."""
    t = np.arange(0.0, excitation.duration, 1e-3)
    wanted = excitation.at(t)
    effects = [Payload(robot.joints[-1], secret.mass, tuple(secret.center))]
    tilted = robot.with_gravity(secret.gravity(robot))
    known = {'coulomb_friction': secret.friction, 'viscous_friction': 3.0 * secret.friction}
    known['rotor_inertia'] = 0.005 * drive_size(robot)
    reference = Reference('slow', 0.0, (), t, wanted.q, wanted.dq, wanted.ddq)
    signals = run(Plant(tilted, known, effects), reference, rng)
    step = round(1000 / rate)
    q, tau = signals.q[::step], signals.tau[::step]
    tau = secret.zero + secret.gain * tau
    return Recording(
        joints=robot.joints,
        t=t[::step],
        q=q + 2e-5 * rng.normal(size=q.shape),
        tau=tau + 0.003 * drive_size(robot) * rng.normal(size=q.shape),
        source='tour',
    )
