# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arms with hidden zeros, gains, tilt, tool and dry friction, without a model of the package."""

from dataclasses import dataclass

from armid_ros.motion import Motion
from armid_ros.recording import Recording
import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from tests.hidden.load import Payload
from tests.hidden.machines import drive_size
from tests.hidden.plant import Plant, run
from tests.hidden.trajectories import Reference


@dataclass(frozen=True)
class Secret:
    """What is hidden: arrays over joints, tilt as a rotation vector (2,), mass and centre."""

    zero: np.ndarray
    gain: np.ndarray
    friction: np.ndarray
    tilt: np.ndarray
    mass: float
    center: np.ndarray

    @classmethod
    def draw(cls, robot, rng):
        """Draw zeros up to 5 % of the drives, gains up to 10 %, a tilt up to 5 deg, a tool."""
        n, drive = robot.n_joints, drive_size(robot)
        return cls(
            zero=0.05 * drive * rng.uniform(-1.0, 1.0, n),
            gain=1.0 + rng.uniform(-0.1, 0.1, n),
            friction=drive * rng.uniform(0.005, 0.03, n),
            tilt=np.radians(rng.uniform(-3.5, 3.5, 2)),
            mass=float(robot.rigid_parameters[::10].sum() * rng.uniform(0.03, 0.12)),
            center=rng.uniform((-0.05, -0.05, 0.03), (0.05, 0.05, 0.13)),
        )

    def gravity(self, robot):
        """Return gravity in the frame of the tilted base [m/s^2]."""
        return Rotation.from_rotvec([*self.tilt, 0.0]).inv().apply(np.array(robot.gravity))

    def truth(self, robot):
        """Return the true quantities by name and joint."""
        found = {('zero', j): value for j, value in zip(robot.joints, self.zero, strict=True)}
        found |= {('gain', j): value for j, value in zip(robot.joints, self.gain, strict=True)}
        gravity = self.gravity(robot)
        found |= {(f'gravity_{axis}', ''): gravity[k] for k, axis in enumerate('xyz')}
        found |= {(f'center_{axis}', ''): self.center[k] for k, axis in enumerate('xyz')}
        return found | {('mass', ''): self.mass}


def rests_of(robot, secret, count, rng):
    """Return rests in random poses from both sides, with scattered friction."""
    lower, upper = np.maximum(robot.lower, -2.5), np.minimum(robot.upper, 2.5)
    q = np.repeat(rng.uniform(lower, upper, (count, robot.n_joints)), 2, axis=0)
    side = np.tile([[1.0], [-1.0]], (count, robot.n_joints))
    parameters = robot.rigid_parameters.copy()
    tool = pin.Inertia(secret.mass, secret.center, np.zeros((3, 3)))
    parameters[-10:] += tool.toDynamicParameters()
    true = robot.with_inertias(parameters).with_gravity(secret.gravity(robot))
    data = true.model.createData()
    weight = np.array([pin.rnea(true.model, data, pose, 0 * pose, 0 * pose) for pose in q])
    held = secret.friction * side * (1.0 + 0.05 * rng.normal(size=q.shape))
    return Motion.of_states(robot.joints, q, side, 0.0).with_torque(
        secret.zero + secret.gain * (weight + held)
    )


def play(robot, excitation, secret, rng, rate=200):
    """Return what instruments record while the arm plays an excitation in MuJoCo."""
    t = np.arange(0.0, excitation.duration, 1e-3)
    wanted = excitation.at(t)
    known = {
        'coulomb_friction': secret.friction,
        'viscous_friction': 3.0 * secret.friction,
        'rotor_inertia': 0.005 * drive_size(robot),
    }
    tool = Payload(robot.joints[-1], robot.n_joints - 1, secret.mass, tuple(secret.center))
    plant = Plant(robot.with_gravity(secret.gravity(robot)), known, [tool])
    reference = Reference(0.0, (), t, wanted.q, wanted.dq, wanted.ddq)
    signals = run(plant, reference, rng)
    step = round(1000 / rate)
    tau = secret.zero + secret.gain * signals.tau[::step]
    return Recording(
        joints=robot.joints,
        t=t[::step],
        q=signals.q[::step] + 2e-5 * rng.normal(size=tau.shape),
        tau=tau + 0.003 * drive_size(robot) * rng.normal(size=tau.shape),
        source='tour',
    )
