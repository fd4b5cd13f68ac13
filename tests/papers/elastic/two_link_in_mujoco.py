# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The two-link arm with elastic joints in MuJoCo, an engine with other dynamics and friction.

The plant is the printed set after tuning. Excitation: experiments of 4 s, sensor noise 0.006 rad/s
(motors, at the joints), 0.003 rad/s and 0.2 rad/s^2 (links). Tuning: four steps of 0.5 s,
beginning at the set before tuning.

"""

from __future__ import annotations

from dataclasses import replace

from armid_ros.motion import ElasticRun, FloatArray
from armid_ros.papers.elastic.experiments import resonance_experiments
from armid_ros.papers.elastic.identification.response import unpack
from armid_ros.robots import load_robot
from armid_ros.robots.reference import Reference
from armid_ros.robots.two_link import ROBOT, TwoLinkParameters
from armid_ros.simulation.controller import VelocityLoop
from armid_ros.simulation.plant import Plant
import numpy as np
import pinocchio as pin

DT = 1e-3
MAIN, SPRING_DAMPING = slice(0, 7), slice(11, 13)
#: Frequencies of the printed set after tuning [Hz], motors free and locked, by pose [deg].
FREE = {0: (31.5, 63.0), 45: (31.9, 55.7), 90: (33.3, 47.0), 135: (36.4, 42.9), 180: (38.9, 42.2)}
LOCKED = {0: (14.6, 55.5), 45: (15.5, 47.1), 90: (18.3, 36.4), 180: (27.7, 29.4)}
#: Steps of MuJoCo per sample: its error falls with the first power of the step.
MANY = 200


def modes(plant: Plant, q: FloatArray, *, locked: bool = False) -> FloatArray:
    """
    Return the natural frequencies and damping ratios of an elastic arm without dry friction.

    Parameters
    ----------
    plant : Plant
        The arm, with springs.
    q : ndarray, shape (n,)
        Position of the links [rad].
    locked : bool
        Whether the motors are held, as by a stiff velocity loop.

    Returns
    -------
    ndarray, shape (K, 2)
        Undamped frequency [Hz] and damping ratio of each oscillation, lowest first.

    """
    springs = plant.springs
    assert springs is not None
    model, e = plant.robot.model, len(springs.joints)
    inertia = springs.rotors.copy()
    inertia[e:, e:] += pin.crba(model, model.createData(), np.asarray(q, dtype=float))
    w = springs.to_twists
    resist = springs.damping + (w.T * springs.transmission.damping) @ w
    spring = w.T * springs.transmission.stiffness
    if locked:
        inertia, resist, spring, w = inertia[e:, e:], resist[e:, e:], spring[e:], w[:, e:]
    size = e + len(inertia)
    a = np.zeros((size, size))
    a[:e, e:] = w
    a[e:] = np.linalg.solve(inertia, -np.hstack([spring, resist]))
    poles = np.linalg.eigvals(a)
    poles = poles[poles.imag > 1e-6]
    found = np.column_stack([np.abs(poles) / (2.0 * np.pi), -poles.real / np.abs(poles)])
    return np.asarray(found[np.argsort(found[:, 0])])


def excitation(count: int, seed: int = 0) -> list[Reference]:
    """Return experiments that excite the resonances."""
    return resonance_experiments(count, np.random.default_rng(seed))


def measured(
    run: ElasticRun,
    rng: np.random.Generator,
    motor: float = 0.006,
    link: float = 0.003,
    acceleration: float = 0.2,
) -> ElasticRun:
    """Return a run with noise of the velocities [rad/s] and accelerations [rad/s^2]."""

    def noisy(values: FloatArray, std: float) -> FloatArray:
        return np.asarray(values + std * rng.standard_normal(values.shape))

    links = replace(run.link, dq=noisy(run.link.dq, link), ddq=noisy(run.link.ddq, acceleration))
    return replace(run, motor=replace(run.motor, dq=noisy(run.motor.dq, motor)), link=links)


def mujoco_arm(parameters: TwoLinkParameters, substeps: int = 20):
    """Return a MuJoCo model of the arm: links, separate rotors, and tendons as springs."""
    import mujoco

    body = parameters.body(load_robot(ROBOT))
    pi = np.array(body.rigid_parameters).reshape(2, 10)
    length = float(body.model.jointPlacements[2].translation[0])
    inertia = pi[:, 9] - pi[:, 1] ** 2 / pi[:, 0]
    links = [
        f'<inertial pos="{p[1] / p[0]:.17g} 0 0" mass="{p[0]:.17g}" '
        f'diaginertia="{i:.17g} {i:.17g} {i:.17g}"/>'
        for p, i in zip(pi, inertia, strict=True)
    ]
    rotors, springs = '', ''
    for joint in range(2):
        rotors += (
            f'<body name="rotor{joint}"><inertial pos="0 0 0" mass="1" '
            f'diaginertia="1e-9 1e-9 1e-9"/><joint name="m{joint}" axis="0 0 1" '
            f'armature="{parameters.rotor[joint]:.17g}" '
            f'damping="{parameters.joint_motor_damping[joint]:.17g}" '
            f'frictionloss="{parameters.joint_coulomb[joint]:.17g}"/></body>'
        )
        springs += (
            f'<fixed stiffness="{parameters.stiffness[joint]:.17g}" springlength="0" '
            f'damping="{parameters.spring_damping[joint]:.17g}">'
            f'<joint joint="m{joint}" coef="1"/><joint joint="l{joint}" coef="-1"/></fixed>'
        )
    step = DT / substeps
    text = f"""<mujoco>
      <compiler angle="radian" balanceinertia="false"/>
      <option timestep="{step}" gravity="0 0 0" integrator="implicitfast" tolerance="1e-14"/>
      <default><joint solreffriction="{2 * step} 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"/>
      </default>
      <worldbody>{rotors}
        <body name="link1">{links[0]}
          <joint name="l0" axis="0 0 1" damping="{parameters.link_damping[0]:.17g}"/>
          <body name="link2" pos="{length} 0 0">{links[1]}
            <joint name="l1" axis="0 0 1" damping="{parameters.link_damping[1]:.17g}"/>
      </body></body></worldbody>
      <tendon>{springs}</tendon>
    </mujoco>"""
    return mujoco.MjModel.from_xml_string(text)


def run_mujoco(model, loop: VelocityLoop, reference: Reference) -> ElasticRun:
    """Run one experiment under the velocity loop, as ``run_experiment`` does."""
    from armid_ros.motion import Motion
    import mujoco

    data, substeps = mujoco.MjData(model), round(DT / model.opt.timestep)
    data.qpos[:] = [*reference.q[0], *reference.q[0]]
    t = DT * np.arange(round(reference.duration / DT))
    wanted = reference.sample(t)
    velocity = np.diff(wanted.q, axis=0, prepend=wanted.q[:1]) / DT
    count, extra = len(t), np.zeros((len(t), 2)) if wanted.tau is None else wanted.tau
    q, v, a = np.empty((3, count, 4))
    tau, integral = np.empty((count, 2)), np.zeros(2)
    for k in range(count):
        error = velocity[k] - data.qvel[:2]
        integral += DT * error
        tau[k] = loop.proportional * error + loop.integral * integral + extra[k]
        data.qfrc_applied[:2] = tau[k]
        q[k], v[k] = data.qpos, data.qvel
        mujoco.mj_forward(model, data)
        a[k] = data.qacc
        mujoco.mj_step(model, data, substeps)
    motor = Motion(wanted.joints, t, q[:, :2], v[:, :2], a[:, :2], tau)
    links = Motion(wanted.joints, t, q[:, 2:], v[:, 2:], a[:, 2:])
    return ElasticRun(motor, links, velocity)


def errors(found: TwoLinkParameters, truth: TwoLinkParameters) -> dict[str, float]:
    """Return the largest error of each kind of parameter [%]."""
    share = 100.0 * np.abs(unpack(found) / unpack(truth) - 1.0)
    total = 100.0 * np.abs(found.total_damping / truth.total_damping - 1.0)
    return {
        'main': float(share[MAIN].max()),
        'dg': float(share[SPRING_DAMPING].max()),
        'sum': float(total.max()),
    }
