# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arms in MuJoCo under position control, with hidden gains, delay, friction, rotors and tool."""

from dataclasses import dataclass

from armid_ros.recording import Recording
from armid_ros.robots import robot_from_urdf
import mujoco
import numpy as np
import pinocchio as pin

from tests.hidden.descriptions import bare_urdf
from tests.hidden.machines import drive_size

#: Width of the tool, a cube [m].
CUBE = 0.06


@dataclass(frozen=True)
class Secret:
    """What is hidden: arrays over joints, delay [s], mass [kg] and centre [m] of the tool."""

    kp: np.ndarray
    kd: np.ndarray
    delay: float
    armature: np.ndarray
    viscous: np.ndarray
    coulomb: np.ndarray
    mass: float
    center: np.ndarray
    noise: float  # standard deviation of the encoders [rad]
    resolution: float  # [rad]
    velocities: bool  # whether velocities are commanded

    @classmethod
    def draw(cls, robot, rng):
        """Draw drives in proportion to their torque, gains of 2 to 5 Hz, a delay up to 20 ms."""
        n, drive = robot.n_joints, drive_size(robot)
        armature = drive * rng.uniform(0.002, 0.01, n)
        coulomb = drive * rng.uniform(0.005, 0.03, n)
        body = pin.crba(robot.model, robot.model.createData(), robot.middle_pose)
        inertia = np.diag(body) + armature
        rate = 2.0 * np.pi * rng.uniform(2.0, 5.0, n)
        return cls(
            kp=inertia * rate**2,
            kd=2.0 * rng.uniform(0.4, 1.2, n) * inertia * rate,
            delay=rng.uniform(0.0, 0.02),
            armature=armature,
            viscous=drive * rng.uniform(0.01, 0.08, n),
            coulomb=coulomb,
            mass=float(robot.rigid_parameters[::10].sum() * rng.uniform(0.0, 0.1)),
            center=rng.uniform((-0.05, -0.05, 0.03), (0.05, 0.05, 0.13)),
            noise=10.0 ** rng.uniform(-5.0, -3.7),
            resolution=2.0 * np.pi / 2 ** rng.integers(15, 20),
            velocities=bool(rng.integers(2)),
        )

    def truth(self, robot, dt=1e-4):
        """
        Return the true values by name and joint.

        MuJoCo integrates damping implicitly with a step dt. To first order, this adds half a step
        times the damping to the inertia. A command acts from the first step after its arrival,
        half a step before the position that the step begins with.

        """
        of_joints = {
            'position_gain': self.kp,
            'velocity_gain': self.kd,
            'rotor_inertia': self.armature + 0.5 * dt * (self.kd + self.viscous),
            'viscous_coefficient': self.viscous,
            'coulomb_torque': self.coulomb,
        }
        found = {('command_delay', ''): (np.ceil(self.delay / dt) - 0.5) * dt}
        for name, values in of_joints.items():
            found |= {(name, j): float(v) for j, v in zip(robot.joints, values, strict=True)}
        last = robot.joints[-1]
        found |= {
            (f'payload_center_{a}', last): c for a, c in zip('xyz', self.center, strict=True)
        }
        found['payload_gyration_radius', last] = CUBE / np.sqrt(6.0)
        return found | {('payload_m', last): self.mass}


def compiled(robot, secret, dt, hard=True):
    """Return the arm as a model of MuJoCo, and the places of its joints."""
    spec = mujoco.MjSpec.from_string(bare_urdf(robot))
    spec.compiler.fusestatic = True
    spec.compiler.balanceinertia = False
    spec.option.timestep, spec.option.gravity = dt, robot.gravity
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for j, joint in enumerate(robot.joints):
        hinge = spec.joint(joint)
        hinge.damping = [secret.viscous[j], 0.0, 0.0]
        hinge.frictionloss, hinge.armature = secret.coulomb[j], secret.armature[j]
        drive = spec.add_actuator(name=joint, target=joint)
        drive.trntype = mujoco.mjtTrn.mjTRN_JOINT
        drive.gaintype = mujoco.mjtGain.mjGAIN_FIXED
        drive.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        drive.gainprm[0] = secret.kp[j]
        drive.biasprm[1:3] = -secret.kp[j], -secret.kd[j]
    last = spec.joint(robot.joints[-1]).parent
    tool = last.add_body(name='tool', ipos=secret.center)
    tool.mass, tool.inertia = (
        max(secret.mass, 1e-9),
        np.full(3, secret.mass * CUBE**2 / 6.0 + 1e-12),
    )
    tool.explicitinertial = True
    model = spec.compile()
    if hard:  # dry friction as hard as it can be
        model.dof_solref[:] = [2.0 * dt, 1.0]
        model.dof_solimp[:] = [0.9999, 0.9999, 0.001, 0.5, 2.0]
    return model, np.array([model.joint(joint).qposadr[0] for joint in robot.joints])


def random_chain(rng, links=None):
    """Return a serial arm of some links, 3 to 6 by default, with random axes, masses, centres."""
    n = int(rng.integers(3, 7)) if links is None else links
    length = rng.uniform(0.08, 0.35, n)
    mass = 3.0 * rng.uniform(0.5, 1.5) * rng.uniform(0.6, 0.9, n).cumprod()
    parts = ['<robot name="chain"><link name="base"/>']
    for j in range(n):
        axis = '0 0 1' if j == 0 else ('0 1 0', '1 0 0', '0 0 1')[int(rng.integers(3))]
        above = length[j - 1] if j else 0.1
        reach = length[j:].sum()
        effort = 20.0 + 2.0 * 9.81 * mass[j:].sum() * reach
        x, y, z = rng.uniform((-0.03, -0.03, 0.2), (0.03, 0.03, 0.6)) * (1.0, 1.0, length[j])
        round_axis, along = mass[j] * 0.04**2, mass[j] * length[j] ** 2 / 10.0
        parts.append(
            f'<link name="link{j}"><inertial><origin xyz="{x} {y} {z}"/><mass value="{mass[j]}"/>'
            f'<inertia ixx="{along}" iyy="{along}" izz="{round_axis}" ixy="0" ixz="0" iyz="0"/>'
            f'</inertial></link><joint name="joint{j}" type="revolute"><axis xyz="{axis}"/>'
            f'<origin xyz="0 0 {above}"/><parent link="{f"link{j - 1}" if j else "base"}"/>'
            f'<child link="link{j}"/><limit lower="-2.5" upper="2.5" velocity="3" '
            f'effort="{effort}"/></joint>'
        )
    return robot_from_urdf(''.join([*parts, '</robot>']))


def waves(rng, t, n):
    """Return positions and velocities of random sums of waves."""
    w = 2.0 * np.pi * rng.uniform(0.1, 1.2, (5, n))
    phase, size = rng.uniform(0.0, 2.0 * np.pi, (5, n)), rng.uniform(0.3, 1.0, (5, n)) / w
    angle = w * t[:, np.newaxis, np.newaxis] + phase
    return (size * np.sin(angle)).sum(axis=1), (size * w * np.cos(angle)).sum(axis=1)


def chirps(rng, t, n):
    """Return waves whose frequency rises to 1 to 2 Hz and whose speed stays."""
    rate, most = rng.uniform(0.05, 0.15, n), rng.uniform(1.0, 2.0, n)
    slope = (most - rate) / t[-1]
    w = 2.0 * np.pi * (rate + slope * t[:, np.newaxis])
    angle = 2.0 * np.pi * (rate + 0.5 * slope * t[:, np.newaxis]) * t[:, np.newaxis]
    q = np.sin(angle) / w
    return q, np.gradient(q, t, axis=0)


def moves(rng, t, n):
    """Return smooth motions from pose to pose with rests between them."""
    times = np.cumsum(rng.uniform(0.6, 1.8, round(2.0 * t[-1]) + 2))
    times = times - times[0]
    poses = rng.uniform(-1.0, 1.0, (len(times), n))
    k = np.searchsorted(times, t, side='right') - 1
    s = np.clip((t - times[k]) / (0.75 * (times[k + 1] - times[k])), 0.0, 1.0)[:, np.newaxis]
    q = poses[k] + (poses[k + 1] - poses[k]) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    return q, np.gradient(q, t, axis=0)


def within(robot, rng, t, kind):
    """Return a motion of a kind within the limits of a robot, up to 2 rad/s."""
    lower, upper = np.maximum(robot.lower, -2.5), np.minimum(robot.upper, 2.5)
    q, dq = kind(rng, t, robot.n_joints)
    fastest = np.minimum(0.6 * robot.velocity_limit, 2.0)
    factor = np.minimum(
        fastest / np.abs(dq).max(axis=0), 0.7 * (upper - lower) / np.ptp(q, axis=0)
    )
    start = rng.uniform(lower, upper - factor * np.ptp(q, axis=0))
    return start + factor * (q - q.min(axis=0)), factor * dq


def play(
    robot, secret, rng, duration=20.0, dt=1e-4, rate=200, command_rate=100, hard=True, kind=waves
):
    """Return the recordings of encoders and of commands."""
    model, places = compiled(robot, secret, dt, hard)
    sent = np.arange(0.0, duration, 1.0 / command_rate)
    u, du = within(robot, rng, sent, kind)
    count, every = round(duration / dt), round(1.0 / (rate * dt))
    t = np.arange(count) * dt
    acting = np.maximum(np.searchsorted(sent, t - secret.delay + 1e-9, side='right') - 1, 0)
    control = u + secret.kd / secret.kp * du * secret.velocities
    data, q = mujoco.MjData(model), np.empty((count, robot.n_joints))
    data.qpos[places] = u[0]
    for k in range(count):
        q[k] = data.qpos[places]
        data.ctrl[:] = control[acting[k]]
        mujoco.mj_step(model, data)
    assert np.abs(q - u[acting]).max() < 3.0, 'the arm is lost'
    q = q[::every] + secret.noise * rng.normal(size=q[::every].shape)
    q = secret.resolution * np.round(q / secret.resolution)
    measured = Recording(joints=robot.joints, t=t[::every], q=q, source='run')
    speeds = du if secret.velocities else None
    return measured, Recording(joints=robot.joints, t=sent, q=u, dq=speeds, source='commands')
