# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Two machines connected by straps: strap forces, joint torques, and motions on one foot.

A pair is any two robots with a common base frame. The shipped pair is a man with an exoskeleton,
tied at both thighs and both shanks.

Exercises for an identification are sums of a few sines of hips and knees; the stance foot is
flat and the trunk upright. By assumption, the machine follows its wearer with less amplitude,
with a delay, and with slightly misaligned joints.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from armid_ros.errors import ModelError
from armid_ros.model import inverse_dynamics
from armid_ros.model.spring_ties import extension, tie_geometry, TiedMachines, TieGeometry
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.papers.exo.plant.gait import read_assumptions, stance_motion
from armid_ros.robots import load_robot
from armid_ros.robots.ties import leg_ties, SEGMENTS
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class TiedPair(TiedMachines):
    """
    Two machines, such as exoskeleton and wearer, and S straps between the machines.

    Attributes
    ----------
    stiffness : ndarray, shape (S,)
        Stiffness of each strap [N/m].
    slack : ndarray, shape (S,)
        Extension at which a strap starts to pull [m]; zero by default.

    """

    stiffness: FloatArray
    slack: FloatArray | None = None

    def __post_init__(self) -> None:
        """Apply a single stiffness or slack to all straps, and check the values."""
        size = (len(self.ties),)
        for name in ('stiffness', 'slack'):
            values = getattr(self, name)
            try:
                spread = np.broadcast_to(np.asarray(0.0 if values is None else values), size)
            except ValueError:
                raise ModelError(
                    f'{name} has shape {np.shape(values)}, but the pair has {size[0]} straps: '
                    f'{", ".join(tie.name for tie in self.ties)}'
                ) from None
            if np.any(spread < 0.0) or not np.all(np.isfinite(spread)):
                raise ModelError(f'{name} is {spread}, but must be finite and not negative')
            object.__setattr__(self, name, read_only(np.array(spread, dtype=float)))

    @property
    def segments(self) -> tuple[str, ...]:
        """Names of the straps."""
        return tuple(tie.name for tie in self.ties)

    def with_stiffness(self, stiffness: npt.ArrayLike) -> TiedPair:
        """Return a copy with another stiffness [N/m]: one value, or one value per strap."""
        return replace(self, stiffness=np.asarray(stiffness, dtype=float))

    def with_slack(self, slack: npt.ArrayLike) -> TiedPair:
        """Return a copy with another slack [m]: one value, or one value per strap."""
        return replace(self, slack=np.asarray(slack, dtype=float))

    def geometry(self, motion: Motion, other_motion: Motion) -> TieGeometry:
        """Return the end points of the straps, with their Jacobians, along given motions."""
        return tie_geometry(self.robot, motion.q, self.other, other_motion.q, self.ties)

    def forces(self, way: FloatArray) -> FloatArray:
        """
        Return the strap forces on the first machine, from the vectors between the strap ends.

        The forces on the other machine are opposite.

        Parameters
        ----------
        way : ndarray, shape (..., S, 3)
            Vectors from the strap ends on the second machine to those on the first [m].

        Returns
        -------
        ndarray, shape (..., S, 3)
            Forces [N].

        """
        assert self.slack is not None
        return np.asarray(-self.stiffness[:, np.newaxis] * extension(way, self.slack))


class PairMotion(NamedTuple):
    """
    Motions of exoskeleton and wearer on a common time base.

    Attributes
    ----------
    own, other : Motion
        Motion of the first machine (exoskeleton) and of the second (wearer).

    """

    own: Motion
    other: Motion


@dataclass(frozen=True)
class PairTorques:
    """
    Joint torques of two machines that straps connect, and the strap forces.

    Attributes
    ----------
    tau, other_tau : ndarray, shape (N, n) and (N, m)
        Joint torques of the first and of the second machine [N m].
    forces : ndarray, shape (N, S, 3)
        Strap forces on the first machine [N].

    """

    tau: FloatArray
    other_tau: FloatArray
    forces: FloatArray


def pair_torques(pair: TiedPair, motion: Motion, other_motion: Motion) -> PairTorques:
    """
    Return the joint torques of both machines, and the strap forces, along given motions.

    Parameters
    ----------
    pair : TiedPair
        The machines and their springs.
    motion, other_motion : Motion
        Motion of each machine, on one time base.

    """
    geometry = pair.geometry(motion, other_motion)
    forces = pair.forces(geometry.way)
    tau = inverse_dynamics(pair.robot, motion)
    tau -= np.einsum('nsxj,nsx->nj', geometry.jacobian, forces)
    other_tau = inverse_dynamics(pair.other, other_motion)
    other_tau += np.einsum('nsxj,nsx->nj', geometry.other_jacobian, forces)
    return PairTorques(read_only(tau), read_only(other_tau), read_only(forces))


def with_torques(pair: TiedPair, motions: PairMotion) -> PairMotion:
    """Return a motion of both machines with the exact torques of the exoskeleton."""
    return PairMotion(motions.own.with_torque(pair_torques(pair, *motions).tau), motions.other)


def with_noise(
    motions: PairMotion, angle_noise: float, torque_noise: float, rng: np.random.Generator
) -> PairMotion:
    """
    Return the sensor readings of a motion of both machines, as noisy angles and torques.

    Parameters
    ----------
    motions : PairMotion
        Exact motion, with torques of the exoskeleton.
    angle_noise, torque_noise : float
        Standard deviation of all angles [rad], and of the torques [N m].
    rng : numpy.random.Generator
        Source of the noise.

    """
    assert motions.own.tau is not None
    tau = motions.own.tau + torque_noise * rng.normal(size=motions.own.tau.shape)
    own, other = (replace(m, q=m.q + angle_noise * rng.normal(size=m.q.shape)) for m in motions)
    return PairMotion(own.with_torque(tau), other)


def leg_pair(
    stiffness: npt.ArrayLike | None = None, segments: Sequence[str] = SEGMENTS
) -> TiedPair:
    """
    Return the shipped exoskeleton and wearer, connected by straps.

    Parameters
    ----------
    stiffness : array_like, optional
        Stiffness of all springs or of each [N/m]; by default that of ``assumptions.yaml``.
    segments : sequence of str
        Leg segments with a strap.

    Raises
    ------
    ModelError
        If a segment does not exist.

    """
    exo, human = load_robot('exoskeleton_legs'), load_robot('human_legs')
    return TiedPair(exo, human, leg_ties(exo, human, segments), assumed_stiffness(stiffness))


def assumed_stiffness(stiffness: npt.ArrayLike | None) -> FloatArray:
    """Return the given strap stiffness [N/m], or by default that of `assumptions.yaml`."""
    assumed = read_assumptions()['interaction_stiffness'].value
    return np.asarray(assumed if stiffness is None else stiffness, dtype=float)


def stepping(pair: TiedPair, t: FloatArray, period: float | None = None) -> PairMotion:
    """
    Return the motion of exoskeleton and wearer who step forward and back on a standing foot.

    Parameters
    ----------
    pair : TiedPair
        The shipped pair.
    t : ndarray, shape (N,)
        Time [s].
    period : float, optional
        Time of a step forward and back [s]; by default that of ``assumptions.yaml``.

    """
    known = read_assumptions()
    begin, end = known['single_support'].value
    w = 2.0 * np.pi / (known['stepping_period'].value if period is None else period)
    half = (end - begin) / 2.0

    def wearer(joints: tuple[str, ...], time: FloatArray) -> Motion:
        cosine, sine = np.cos(w * time), np.sin(w * time)
        phase = [begin + half * (1.0 - cosine), half * w * sine, half * w**2 * cosine]
        return stance_motion(joints, time, np.array(phase))

    return following(pair, t, wearer)


def following(
    pair: TiedPair, t: FloatArray, moving: Callable[[tuple[str, ...], FloatArray], Motion]
) -> PairMotion:
    """
    Return the motion of a wearer, and of an exoskeleton that follows with delay and offset.

    Parameters
    ----------
    pair : TiedPair
        The shipped pair.
    t : ndarray, shape (N,)
        Time [s].
    moving : callable (joints, t) -> Motion
        Callback for the motion of the wearer.

    """
    known = read_assumptions()
    own = moving(pair.robot.joints, t - known['exoskeleton_delay'].value)
    scale = known['exoskeleton_scale'].value
    offset = np.radians(known['exoskeleton_offset_deg'].value)
    own = replace(own, t=t, q=scale * own.q + offset, dq=scale * own.dq, ddq=scale * own.ddq)
    return PairMotion(own, moving(pair.other.joints, t))


#: Exercises by name: mean and amplitude of stance hip and knee, swing hip and knee [deg], and the
#: period [s]. Steps follow the gait, forward and back.
EXERCISES = {
    'step': ((0.0,) * 4, (0.0,) * 4, 1.8),
    'quick_step': ((0.0,) * 4, (0.0,) * 4, 0.9),
    'swing': ((2.0, 5.0, 10.0, 25.0), (0.0, 0.0, 30.0, 20.0), 1.2),
    'lift': ((2.0, 5.0, 40.0, 50.0), (0.0, 0.0, 35.0, 45.0), 1.2),
    # the second foot is on a force plate
    'squat': ((20.0, 35.0, 20.0, 35.0), (18.0, 30.0, 18.0, 30.0), 1.6),
    'rock': ((0.0, 8.0, 5.0, 15.0), (12.0, 6.0, 12.0, 6.0), 0.9),
}


def exercise(pair: TiedPair, name: str, t: FloatArray) -> PairMotion:
    """
    Return the motion of exoskeleton and wearer during a named exercise on one foot.

    Parameters
    ----------
    pair : TiedPair
        The pair on one foot.
    name : str
        One of ``EXERCISES``.
    t : ndarray, shape (N,)
        Time [s].

    """
    *angles, period = EXERCISES[name]
    if name.endswith('step'):
        return stepping(pair, t, period)
    (middle, reach), w = np.radians(angles), 2.0 * np.pi / period

    def moving(joints: tuple[str, ...], time: FloatArray) -> Motion:
        """Return a sinusoidal motion of hips and knees with flat foot and upright trunk."""
        cosine, sine = (np.outer(f(w * time), reach) for f in (np.cos, np.sin))
        parts = [
            np.column_stack([knee - hip, knee, hip, far_hip, far_knee, np.zeros_like(time)])
            for hip, knee, far_hip, far_knee in (
                (middle - cosine).T,
                (w * sine).T,
                (w**2 * cosine).T,
            )
        ]
        return Motion(joints, time, *parts)

    return following(pair, t, moving)
