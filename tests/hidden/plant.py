# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The arm in MuJoCo, following a reference with hidden effects in it.

Feedback is MuJoCo's own actuators, stiff in position and damped, with a feed-forward of a model
that is a little wrong, so that the arm does not follow exactly. Integration is semi-implicit:
position differences of the second order are the acceleration at the middle sample, exactly, so
the torque of a step belongs to the position at its beginning.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from armid_ros.robots import Robot
import mujoco
import numpy as np
import pinocchio as pin

from tests.hidden.arrays import FloatArray, sampled, Signals
from tests.hidden.base import HiddenEffect, Live
from tests.hidden.descriptions import bare_urdf
from tests.hidden.machines import with_rigid_errors
from tests.hidden.trajectories import Reference

#: Natural frequency of the feedback [rad/s] and its damping ratio.
BANDWIDTH, DAMPING_RATIO = 25.0, 0.8

#: Share of the known friction that the controller compensates.
COMPENSATION = 0.7

#: An arm that is further from its reference has lost it [rad].
LOST = 0.6


@dataclass(frozen=True)
class Plant:
    """
    An arm with known drives and hidden effects.

    Attributes
    ----------
    robot : Robot
        With the true rigid parameters.
    known : mapping of str to ndarray, shape (n,)
        True values of viscous_friction, coulomb_friction and rotor_inertia that the model given
        to the diagnosis has as well; the arm has none of those that are missing.
    effects : sequence of HiddenEffect
        What is hidden.
    dt : float
        Step [s].

    """

    robot: Robot
    known: Mapping[str, FloatArray]
    effects: Sequence[HiddenEffect] = ()
    dt: float = 1e-3

    def build(self) -> Live:
        """Compile the arm."""
        spec = mujoco.MjSpec.from_string(bare_urdf(self.robot))
        spec.compiler.fusestatic = True
        spec.compiler.balanceinertia = False
        spec.option.timestep = self.dt
        spec.option.gravity = self.robot.gravity
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
        spec.option.tolerance = 1e-12
        zero = np.zeros(self.robot.n_joints)
        damping = self.known.get('viscous_friction', zero)
        friction = self.known.get('coulomb_friction', zero)
        rotor = self.known.get('rotor_inertia', zero)
        for j, joint in enumerate(self.robot.joints):
            hinge = spec.joint(joint)
            hinge.damping = [damping[j], 0.0, 0.0]
            hinge.frictionloss, hinge.armature = friction[j], rotor[j]
            actuator = spec.add_actuator(name=joint, target=joint)
            actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
            actuator.gaintype = mujoco.mjtGain.mjGAIN_FIXED
            actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        for effect in self.effects:
            effect.edit(spec, self.robot)
        model = spec.compile()
        for stiffness in (model.dof_solref, model.tendon_solref_fri):
            stiffness[:] = [2.0 * self.dt, 1.0]  # dry friction as hard as it can be
        for impedance in (model.dof_solimp, model.tendon_solimp_fri):
            impedance[:] = [0.9999, 0.9999, 0.001, 0.5, 2.0]
        live = Live.of(self.robot, model)
        for effect in self.effects:
            effect.prepare(live)
        return live


def run(plant: Plant, reference: Reference, rng: np.random.Generator) -> Signals:
    """
    Let the arm follow a reference and return what perfect sensors on it would show.

    Parameters
    ----------
    plant : Plant
        The arm.
    reference : Reference
        Sampled at the step of the plant.
    rng : Generator
        Draws the errors of the controller's model.

    Returns
    -------
    Signals
        True motion of the joints (of the motors, where the transmission gives) and the torque
        of the drives; the faults of the effects' sensors are in it.

    """
    live = plant.build()
    feedforward, inertia = _controller_model(plant, reference, rng)
    stiffness = BANDWIDTH**2 * inertia
    damping = 2.0 * DAMPING_RATIO * BANDWIDTH * inertia
    live.model.actuator_gainprm[:, 0] = stiffness
    live.model.actuator_biasprm[:, 1] = -stiffness
    live.model.actuator_biasprm[:, 2] = -damping
    control = reference.q + (damping * reference.dq + feedforward) / stiffness
    live.data.qpos[live.dofs] = reference.q[0]
    q, dq, tau = _integrate(live, control, plant.effects)
    error = np.abs(q - reference.q).max()
    if not error < LOST:
        raise FloatingPointError(
            f'{plant.robot.name}: the arm is {error:.3g} rad off its reference'
        )
    middle = np.empty_like(dq)
    middle[1:-1] = (dq[2:] + dq[1:-1]) / 2.0
    middle[[0, -1]] = dq[[0, -1]]
    ddq = np.empty_like(dq)
    ddq[:-1] = np.diff(dq, axis=0) / plant.dt
    ddq[-1] = ddq[-2]
    command = stiffness * (control - q) - damping * dq
    signals = Signals(reference.t, q, middle, ddq, tau, command)
    for effect in plant.effects:
        signals = effect.distort(signals, plant.robot)
    return signals


def _integrate(
    live: Live, control: FloatArray, effects: Sequence[HiddenEffect]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    model, data, dofs = live.model, live.data, live.dofs
    acting = [effect for effect in effects if effect.acts]
    dry = model.dof_frictionloss[dofs].copy()
    q, dq = np.empty((2, len(control), model.nv))
    tau = np.empty_like(control)
    for k in range(len(control)):
        q[k], dq[k] = data.qpos, data.qvel
        data.ctrl[:] = control[k]
        if acting:
            live.friction[:], live.applied[:] = dry, 0.0
            live.load[:] = _gear_load(live)
            for effect in acting:
                effect.act(live)
            model.dof_frictionloss[dofs] = live.friction
            data.qfrc_applied[dofs] = live.applied
        mujoco.mj_step(model, data)
        tau[k] = data.actuator_force
    return q[:, dofs], dq[:, dofs], tau


def _gear_load(live: Live) -> FloatArray:
    """Return what the rigid arm took from each joint in the last step: all but its own inertia."""
    data, dofs = live.data, live.dofs
    total = data.qfrc_actuator + data.qfrc_passive + data.qfrc_constraint + data.qfrc_applied
    return total[dofs] - live.model.dof_armature[dofs] * data.qacc[dofs]


def _controller_model(
    plant: Plant, reference: Reference, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Return the feed-forward torque, shape (N, n), and mean inertias of the joints, (n,)."""
    robot = with_rigid_errors(plant.robot, rng)
    data = robot.model.createData()
    coarse = slice(None, None, 5)
    states = list(
        zip(reference.q[coarse], reference.dq[coarse], reference.ddq[coarse], strict=True)
    )
    rigid = np.array([pin.rnea(robot.model, data, *state) for state in states])
    torque = sampled(reference.t, reference.t[coarse], rigid)
    zero = np.zeros(robot.n_joints)
    speed = 0.02 * np.abs(reference.dq).max(axis=0) + 1e-6
    friction = plant.known.get('viscous_friction', zero) * reference.dq
    friction = friction + plant.known.get('coulomb_friction', zero) * np.tanh(reference.dq / speed)
    rotor = plant.known.get('rotor_inertia', zero)
    inertia = np.mean([np.diag(pin.crba(robot.model, data, s[0])) for s in states[::20]], axis=0)
    return torque + COMPENSATION * friction + rotor * reference.ddq, inertia + rotor
