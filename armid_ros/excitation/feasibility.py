# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Check that a trajectory keeps all limits and the clearance, at and between all samples.

Position, velocity, acceleration and torque are sampled densely. A bound on the increase of a curve
between two samples is added. The clearance is proven on every interval.

"""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.geometry.clearance import Approach, ClearanceModel
from armid_ros.excitation.limits import check_limits, Limits, Violation
from armid_ros.excitation.schedule import Excitation
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Samples per period and harmonic.
_DENSITY = 200


class Faults(tuple[Violation | Approach, ...]):
    """Reasons not to run a trajectory: exceeded limits, and bodies too close to each other."""

    __slots__ = ()

    def __str__(self) -> str:
        """Return all faults in one line."""
        return '; '.join(map(str, self))


def trajectory_faults(
    arm: ArmModel,
    limits: Limits,
    trajectory: FourierTrajectory,
    clearance: ClearanceModel | None,
    margin: float,
) -> Faults:
    """
    Return the faults of a periodic trajectory, at and between all samples.

    Parameters
    ----------
    arm : ArmModel
        Prior model, for the torque.
    limits : Limits
        The limits.
    trajectory : FourierTrajectory
        The trajectory.
    clearance : ClearanceModel or None
        Bodies to keep apart.
    margin : float
        Clearance to keep [m].

    """
    motion = trajectory.one_period(_DENSITY * trajectory.harmonics)
    violations = _violations(arm, limits, motion, periodic=True)
    if clearance is None:
        return Faults(violations)
    # intervals at the beginning of the proof
    times = np.linspace(0.0, trajectory.period, 20 * trajectory.harmonics + 1)
    _, acceleration, _ = trajectory.bounds()
    approach = clearance.first_fault(trajectory.motion, acceleration, times, margin)
    return Faults(violations if approach is None else (*violations, approach))


def excitation_faults(arm: ArmModel, limits: Limits, excitation: Excitation) -> Faults:
    """
    Return the exceeded limits of run-in and run-out, which follow the path of the trajectory.

    `trajectory_faults` proves the clearance of this path.

    """
    step = excitation.trajectory.period / (_DENSITY * excitation.trajectory.harmonics)
    count = max(int(np.ceil(excitation.run_in / step)), 20)
    violations: list[Violation] = []
    for start in (0.0, excitation.duration - excitation.run_in):
        way = excitation.at(start + np.linspace(0.0, excitation.run_in, count + 1))
        violations += _violations(arm, limits, way, periodic=False)
    return Faults(violations)


def _violations(
    arm: ArmModel, limits: Limits, motion: Motion, *, periodic: bool
) -> tuple[Violation, ...]:
    torque = arm.joint_torque(motion) if np.isfinite(limits.torque).any() else None
    widened = Motion(
        motion.joints,
        motion.t,
        *(_outward(values, periodic) for values in (motion.q, motion.dq, motion.ddq)),
    )
    return check_limits(limits, widened, None if torque is None else _outward(torque, periodic))


def _outward(values: FloatArray, periodic: bool) -> FloatArray:
    """Move samples away from their mean by a bound on the error between two samples."""
    # the bound is h^2 M / 8 for second derivatives below M, estimated from second differences;
    # nothing is added where dry friction makes the second differences jump
    if periodic:
        bend = np.roll(values, -1, axis=0) - 2.0 * values + np.roll(values, 1, axis=0)
    else:
        bend = np.zeros_like(values)
        bend[1:-1] = values[2:] - 2.0 * values[1:-1] + values[:-2]
    size = np.abs(bend)
    typical = 20.0 * np.median(size, axis=0)
    size = np.where(size > typical, 0.0, size)
    return np.asarray(values + np.sign(values - values.mean(axis=0)) * size / 8.0)
