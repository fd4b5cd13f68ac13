# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Check of trajectories against limits and clearance, and random feasible trajectories.

Position, velocity, acceleration and torque are sampled densely. A bound on the increase between
two samples is added. The clearance is proven for every interval.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.geometry.clearance import Approach, ClearanceModel
from armid_ros.excitation.limits import check_limits, Limits, Violation
from armid_ros.excitation.schedule import Excitation
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Samples per period and harmonic.
_CHECK_SAMPLES = 200


class Faults(tuple[Violation | Approach, ...]):
    """Faults of a trajectory: exceeded limits, and pairs of bodies that come too close."""

    __slots__ = ()

    def __str__(self) -> str:
        """Return all faults in one line, separated by semicolons."""
        return '; '.join(map(str, self))


def trajectory_faults(
    arm: ArmModel,
    limits: Limits,
    trajectory: FourierTrajectory,
    clearance: ClearanceModel | None,
) -> Faults:
    """
    Return the limits that a periodic trajectory exceeds, and the bodies that come too close.

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

    """
    count = _CHECK_SAMPLES * trajectory.harmonics
    # two samples beyond the period, as the first and the last sample get no bound
    path = trajectory.motion(np.arange(count + 2) * (trajectory.period / count))
    violations = _violations(arm, limits, path)
    if clearance is None:
        return Faults(violations)
    # initial number of intervals of the proof
    times = np.linspace(0.0, trajectory.period, 20 * trajectory.harmonics + 1)
    approach = clearance.first_fault(trajectory.motion, trajectory.acceleration_bound(), times)
    return Faults(violations if approach is None else (*violations, approach))


def excitation_faults(arm: ArmModel, limits: Limits, excitation: Excitation) -> Faults:
    """
    Return the limits that the run-in and the run-out of an excitation exceed.

    Both follow the path of the trajectory, whose clearance `trajectory_faults` proves.

    """
    step = excitation.trajectory.period / (_CHECK_SAMPLES * excitation.trajectory.harmonics)
    count = max(int(np.ceil(excitation.run_in / step)), 20)
    violations: list[Violation] = []
    for start in (0.0, excitation.duration - excitation.run_in):
        path = excitation.at(start + np.linspace(0.0, excitation.run_in, count + 1))
        violations += _violations(arm, limits, path)
    return Faults(violations)


def _violations(arm: ArmModel, limits: Limits, motion: Motion) -> tuple[Violation, ...]:
    torque = arm.joint_torque(motion) if np.isfinite(limits.torque).any() else None
    states = (_outward(values) for values in (motion.q, motion.dq, motion.ddq))
    widened = Motion(motion.joints, motion.t, *states)
    return check_limits(limits, widened, None if torque is None else _outward(torque))


def _outward(values: FloatArray) -> FloatArray:
    """Move samples away from their mean by a bound on the overshoot between samples."""
    # the bound is h^2 M / 8 for second derivatives below M, estimated from second differences.
    # Nothing is added where dry friction makes the second differences jump
    bend = np.zeros_like(values)
    bend[1:-1] = np.diff(values, 2, axis=0)
    size = np.abs(bend)
    typical = 20.0 * np.median(size, axis=0)
    size = np.where(size > typical, 0.0, size)
    return np.asarray(values + np.sign(values - values.mean(axis=0)) * size / 8.0)


#: Samples per period and harmonic for the first check of a drawn trajectory.
_DRAW_SAMPLES = 40


def random_feasible(
    arm: ArmModel,
    limits: Limits,
    period: float,
    harmonics: int,
    rng: np.random.Generator,
    *,
    clearance: ClearanceModel | None = None,
) -> FourierTrajectory:
    """
    Draw a random trajectory that obeys all limits and the clearance, even between samples.

    The coefficients are normally distributed, with equal position amplitudes in all harmonics.
    Each joint moves about a random centre, with a random share of the largest amplitude that its
    limits allow. All amplitudes are reduced until the trajectory is feasible.

    Parameters
    ----------
    arm : ArmModel
        Prior model, for the torque.
    limits : Limits
        The limits.
    period : float
        Period [s].
    harmonics : int
        Number of harmonics.
    rng : Generator
        Source of randomness.
    clearance : ClearanceModel, optional
        Bodies to keep apart.

    Raises
    ------
    TrajectoryError
        If no trajectory was found; the message names the joint and its limit, or the bodies.

    """
    for _ in range(60):
        trajectory = _draw(limits, period, harmonics, rng)
        found = _shrunk(arm, limits, trajectory, clearance, 6)
        if found is not None:
            return found
    centre = _feasible_pose(arm, limits, rng, clearance)
    trajectory = _draw(limits, period, harmonics, rng)
    centred = FourierTrajectory(limits.joints, period, centre, trajectory.a, trajectory.b)
    found = _shrunk(arm, limits, centred, clearance, 48)
    if found is None:
        raise TrajectoryError(
            f'no motion around the pose {", ".join(f"{x:.2f}" for x in centre)} is feasible: '
            f'{trajectory_faults(arm, limits, centred.scaled(0.01), clearance)}'
        )
    return found


def _feasible_pose(
    arm: ArmModel, limits: Limits, rng: np.random.Generator, clearance: ClearanceModel | None
) -> FloatArray:
    """Draw random poses; return the pose within torque limits with the largest clearance."""
    lower, upper = limits.position_range()
    q = rng.uniform(lower, upper, (2000, len(lower)))
    motion = Motion.of_states(limits.joints, q, 0.0, 0.0)
    load = np.abs(arm.joint_torque(motion)) / limits.torque
    held = load.max(axis=1) <= 1.0
    if not held.any():
        best = int(load.max(axis=1).argmin())
        worst = int(load[best].argmax())
        limit, unit = limits.torque[worst], limits.unit('torque', worst)
        raise TrajectoryError(
            f'joint {limits.joints[worst]} cannot hold the arm in any pose: its torque limit is '
            f'{limit:.4g} {unit}, and the pose with the least load needs '
            f'{load[best, worst] * limit:.4g} {unit}'
        )
    if clearance is None:
        best = np.flatnonzero(held)[int(np.argmin(load[held].max(axis=1)))]
        return np.asarray(q[best])
    apart = np.where(held, clearance.smallest(q, reach=clearance.margin + 1.0), -np.inf)
    best = int(np.argmax(apart))
    if apart[best] <= clearance.margin:
        nearest = clearance.closest(motion.select(np.array([best])))
        assert nearest is not None  # without pairs the clearance is infinite
        raise TrajectoryError(
            f'no pose keeps a clearance of {clearance.margin:g} m; {nearest.first} and '
            f'{nearest.second} are {nearest.distance:.4f} m apart at best; lower --clearance'
        )
    return np.asarray(q[best])


def _draw(
    limits: Limits, period: float, harmonics: int, rng: np.random.Generator
) -> FourierTrajectory:
    n = len(limits.joints)
    k = np.arange(1, harmonics + 1)
    raw = FourierTrajectory(
        limits.joints,
        period,
        np.zeros(n),
        k * rng.normal(size=(n, harmonics)),
        k * rng.normal(size=(n, harmonics)),
    )
    motion = raw.one_period(_DRAW_SAMPLES * harmonics)
    low, high = motion.q.min(axis=0), motion.q.max(axis=0)
    lower, upper = limits.position_range()
    largest = np.minimum.reduce(
        [
            (upper - lower) / (high - low),
            limits.velocity / np.abs(motion.dq).max(axis=0),
            limits.acceleration / np.abs(motion.ddq).max(axis=0),
        ]
    )
    factor = largest * rng.uniform(0.3, 0.98, n)
    centre = rng.uniform(lower - factor * low, upper - factor * high)
    scaled = raw.scaled(factor)
    return FourierTrajectory(limits.joints, period, centre, scaled.a, scaled.b)


def _shrunk(
    arm: ArmModel,
    limits: Limits,
    trajectory: FourierTrajectory,
    clearance: ClearanceModel | None,
    shrinks: int,
) -> FourierTrajectory | None:
    """Return the trajectory with amplitudes reduced to be feasible; None after `shrinks` steps."""

    def clear(q: FloatArray) -> bool:
        if clearance is None:
            return True
        return bool(clearance.smallest(q, clearance.margin + 1e-6).min() > clearance.margin)

    for _ in range(shrinks):
        # most colliding trajectories collide already in a few samples
        coarse = trajectory.one_period(_DRAW_SAMPLES * trajectory.harmonics).q
        if clear(trajectory.q0[np.newaxis]) and clear(coarse):
            if not trajectory_faults(arm, limits, trajectory, clearance):
                return trajectory
        trajectory = trajectory.scaled(0.75)
    return None


#: Clearance between links that excitations keep [m].
CLEARANCE = 0.01


@dataclass(frozen=True)
class Template:
    """
    Settings for random motions of chosen joints, at a share of velocity and acceleration limits.

    Attributes
    ----------
    name : str
        Description of the motion.
    speed : float
        Share of the velocity and acceleration limits.
    period : float
        Period [s].
    harmonics : int
        Number of harmonics.
    joints : tuple of str
        The joints that move; all if empty.
    amplitude : float
        Largest amplitude [rad or m].
    loaded : bool
        Whether the motion is run twice, without and with a known payload.

    """

    name: str
    speed: float
    period: float
    harmonics: int
    joints: tuple[str, ...] = ()
    amplitude: float = np.inf
    loaded: bool = False

    def draw(
        self, arm: ArmModel, clearance: ClearanceModel, rng: np.random.Generator
    ) -> FourierTrajectory:
        """
        Draw a random trajectory from the template that obeys all limits and the clearance.

        Raises
        ------
        TrajectoryError
            If no motion is feasible; the message names the obstruction.

        """
        limits = Limits.of(arm.robot, speed=self.speed)
        faults = ''
        # number of draws of a single-joint motion; each draw has a different pose of the other
        # joints
        for _ in range(6):
            drawn = random_feasible(
                arm, limits, self.period, self.harmonics, rng, clearance=clearance
            )
            size = np.ptp(drawn.one_period(40 * self.harmonics).q, axis=0) / 2.0
            moving = [not self.joints or joint in self.joints for joint in drawn.joints]
            share = np.minimum(1.0, self.amplitude / np.maximum(size, 1e-9))
            trajectory = drawn.scaled(np.where(moving, share, 0.0))
            found = trajectory_faults(arm, limits, trajectory, clearance)
            if not found:
                return trajectory
            faults = str(found)
        raise TrajectoryError(f'no {self.name} is feasible: {faults}')


#: Motions of all joints: slow, medium, fast, and with the largest accelerations.
_WHOLE_ARM = (
    Template('slow motion of all joints', 0.1, 12.0, 3),
    Template('motion of all joints at medium speed', 0.4, 10.0, 5),
    Template('fast motion of all joints', 0.9, 8.0, 6),
    Template('shaking of all joints', 0.9, 4.0, 20),
)


def templates(joints: Sequence[str]) -> tuple[Template, ...]:
    """Return templates of motions that identify effects: of the whole arm, and of given joints."""
    chosen = list(_WHOLE_ARM)
    if joints:
        names, alone = ', '.join(joints), tuple(joints)
        chosen += [
            Template(f'slow motion of {names} alone', 0.1, 12.0, 3, alone),
            Template(f'fast motion of {names} alone', 0.9, 8.0, 6, alone),
            Template(f'reversals of {names} by less than 0.02', 0.4, 4.0, 2, alone, 0.01),
        ]
    loaded = [
        replace(t, name=f'{t.name}, without and with a known payload', loaded=True)
        for t in _WHOLE_ARM[:3]
    ]
    return (*chosen, *loaded)
