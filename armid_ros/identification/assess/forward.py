# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Forward validation: a model is driven by recorded torques, and its positions are looked at.

A torque error says how well inverse dynamics fit; what a torque does to the motion is another
question, and the one that a simulation has to answer. The model is given the recorded torque and,
since errors of an integrated torque grow without bounds, a feedback that holds it to the
recorded motion: tau = tau_recorded + M (omega^2 e + 2 omega de). A joint that would need a torque
error d more than it gets is off by about d / (M omega^2). The feedback has one inertia matrix for
every model, so that their errors compare.

"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.identification.rows.signals import Conditioning, decimate, segments
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.robots import Robot
from armid_ros.simulation import Controller, Plant, simulate
from armid_ros.simulation.controller import Desired
import numpy as np
import pinocchio as pin

#: Natural frequency of the feedback [rad/s]: 8 Hz, as of arms. A softer one would leave a light
#: joint to its friction, whose sign at a reversal no model has to the millisecond.
BANDWIDTH = 50.0
#: Far enough for no joint to be at a limit [rad or m].
_FAR = 1e4


@dataclass(frozen=True)
class ForwardScore:
    """
    How far a simulated arm was from the recorded one under the same torques.

    Attributes
    ----------
    source : str
        The recording.
    joints, units : tuple of str
        Joints in column order, and the units of their positions.
    position_error : ndarray, shape (n,)
        Root mean square of the position error [rad or m]; times 1000, mrad.
    torque_error : ndarray, shape (n,)
        Root mean square of recorded minus predicted torque, filtered as for the fit [N m].
    feedback_torque : ndarray, shape (n,)
        Root mean square of what the feedback had to add [N m].
    motion : Motion
        What was recorded, filtered.
    simulated : ndarray, shape (N, n)
        Position of the simulated arm [rad or m].

    """

    source: str
    joints: tuple[str, ...]
    units: tuple[str, ...]
    position_error: FloatArray
    torque_error: FloatArray
    feedback_torque: FloatArray
    motion: Motion
    simulated: FloatArray

    @property
    def worst(self) -> str:
        """Return the largest position error and its joint, as it is read."""
        joint = int(np.argmax(self.position_error))
        return (
            f'{1e3 * self.position_error[joint]:.3g} m{self.units[joint]} ({self.joints[joint]})'
        )


@dataclass(frozen=True, eq=False)
class _RecordedTorque(Controller):
    """The recorded torque, and a feedback of an inertia that holds the arm to its motion."""

    motion: Motion
    robot: Robot
    bandwidth: float
    inertia: FloatArray
    _data: pin.Data = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Make scratch memory."""
        object.__setattr__(self, '_data', self.robot.model.createData())

    def feedforward(self, desired: Motion) -> FloatArray:
        """Return the recorded torque at the times of a reference, shape (N, n) [N m]."""
        assert self.motion.tau is not None
        t = self.motion.t - self.motion.t[0]
        return np.column_stack([np.interp(desired.t, t, column) for column in self.motion.tau.T])

    def torque(
        self, q: FloatArray, dq: FloatArray, desired: Desired, feedforward: FloatArray
    ) -> FloatArray:
        """Return the recorded torque and the feedback, shape (n,)."""
        omega = self.bandwidth
        pull = omega**2 * (desired[0] - q) + 2.0 * omega * (desired[1] - dq)
        mass = pin.crba(self.robot.model, self._data, q)
        return np.asarray(feedforward + mass @ pull + self.inertia * pull)


def forward_validation(
    arm: ArmModel,
    recording: Recording,
    used: Conditioning,
    *,
    nominal: ArmModel | None = None,
    bandwidth: float = BANDWIDTH,
    duration: float = 30.0,
) -> ForwardScore:
    """
    Simulate an arm in closed loop along a recording, driven by the recorded torques.

    Parameters
    ----------
    arm : ArmModel
        The model to judge.
    recording : Recording
        Held-out data.
    used : Conditioning
        Filters of the identification.
    nominal : ArmModel, optional
        Gives the inertia matrix of the feedback; the same for all models that are compared, by
        default the model itself.
    bandwidth : float
        Natural frequency of the feedback [rad/s].
    duration : float
        At most this much of the first unbroken stretch is simulated [s].

    Returns
    -------
    ForwardScore
        Position error of every joint.

    Raises
    ------
    IdentificationError
        If no stretch of the recording can be filtered.
    ModelError
        If the arm cannot be simulated, as when its links are no bodies.

    """
    motion = next(iter(segments(recording, used)), None)
    if motion is None:
        raise IdentificationError(f'{recording.source}: no stretch is long enough to be filtered')
    motion = motion.select(motion.t <= motion.t[0] + duration)
    reference = replace(motion, t=motion.t - motion.t[0])
    nominal = nominal or arm
    added = nominal.action().inertia
    rotors = np.zeros(motion.n_joints) if added is None else np.diag(added)
    controller = _RecordedTorque(reference, nominal.body, bandwidth, rotors)
    plant = Plant(unlimited(arm.along(reference)), hard_stops=False)
    run = simulate(plant, reference, rng=np.random.default_rng(0), controller=controller)
    t = run.truth.t
    recorded = np.column_stack([np.interp(t, reference.t, column) for column in reference.q.T])
    given = controller.feedforward(run.truth)
    assert motion.tau is not None
    left = decimate(motion.tau - arm.torque(motion), used)
    return ForwardScore(
        source=recording.source,
        joints=motion.joints,
        units=arm.robot.position_units,
        position_error=np.sqrt(np.mean((run.truth.q - recorded) ** 2, axis=0)),
        torque_error=np.sqrt(np.mean(left**2, axis=0)),
        feedback_torque=np.sqrt(np.mean((run.tau - given) ** 2, axis=0)),
        motion=motion,
        simulated=np.column_stack([np.interp(reference.t, t, q) for q in run.truth.q.T]),
    )


def unlimited(arm: ArmModel) -> ArmModel:
    """Return an arm whose joints have no limits that a simulation could run into."""
    n = arm.robot.n_joints
    far, free = np.full(n, _FAR), np.full(n, np.inf)
    robot = replace(arm.robot, lower=-far, upper=far, velocity_limit=free, torque_limit=free)
    return replace(arm, robot=robot)
