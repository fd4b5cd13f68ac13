# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A complete run: a transfer to the excitation, the excitation, and a transfer back."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation.limits import Limits
from armid_ros.excitation.schedule import Excitation
from armid_ros.excitation.supervision import Path
from armid_ros.excitation.transfer import Transfer, TransferPlanner
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots.reference import Reference
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Run:
    """
    Excitation with an approach from the start pose and a return to the start pose.

    Attributes
    ----------
    approach : Transfer
        Ends where the excitation begins.
    excitation : Excitation
        The excitation.
    back : Transfer or None
        Begins where the excitation ends; None: the arm stays there.
    rate : float
        Samples per second [Hz]; a period is a whole number of samples.

    """

    approach: Transfer
    excitation: Excitation
    back: Transfer | None
    rate: float

    def __post_init__(self) -> None:
        """Check that both transfers meet the excitation; round durations up to whole samples."""
        ends = self.excitation.at([0.0, self.excitation.duration]).q
        for transfer, own, end in ((self.approach, -1, 0), (self.back, 0, 1)):
            # tolerance for rounding [rad or m]
            if transfer is not None and np.abs(transfer.q[own] - ends[end]).max() > 1e-9:
                raise TrajectoryError(
                    'run: the approach has to end in the first pose of the excitation, and the '
                    'return has to start in its last pose; plan the run again'
                )
        for name in ('approach', 'back'):
            transfer = getattr(self, name)
            if transfer is not None:
                samples = max(math.ceil(transfer.duration * self.rate - 1e-6), 1)
                object.__setattr__(self, name, transfer.lasting(samples / self.rate))

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints of the run."""
        return self.excitation.joints

    @property
    def duration(self) -> float:
        """Duration of the whole run from rest to rest [s]."""
        back = 0.0 if self.back is None else self.back.duration
        return self.approach.duration + self._excitation_duration + back

    @property
    def _excitation_duration(self) -> float:
        """Duration of the excitation, rounded to whole samples [s]."""
        return self.excitation.sampled_duration(self.rate)

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return the motion at given times (N,) [s]; the arm rests before and after the run."""
        time = np.clip(np.asarray(t, dtype=float), 0.0, self.duration)
        begin, lasts = self.approach.duration, self._excitation_duration
        early = 0.5 * (lasts - self.excitation.duration)
        parts: list[tuple[Path, FloatArray]] = [
            (self.approach, time),
            (self.excitation, time - begin - early),
        ]
        choice = (time > begin).astype(int)
        if self.back is not None:
            parts.append((self.back, time - begin - lasts))
            choice += time > begin + lasts
        states = np.empty((3, len(time), len(self.joints)))
        for k, (path, elapsed) in enumerate(parts):
            some = choice == k
            if some.any():  # at a single time, the arm is in one part of the run
                motion = path.at(elapsed[some])
                states[:, some] = motion.q, motion.dq, motion.ddq
        return Motion(self.joints, time, *states)

    def motion(self) -> Motion:
        """Return samples of the whole run at its rate, from time 0 on."""
        t = np.arange(round(self.duration * self.rate) + 1) / self.rate
        return replace(self.at(t), t=t)

    def require_waypoints(self) -> None:
        """
        Raise a TrajectoryError if a controller's interpolation would leave the path.

        A controller interpolates between its waypoints with quintic polynomials. Limits and
        collisions are checked only on the path itself. A polynomial through samples of a sine
        exceeds its velocity and acceleration by less than 0.2 %, so only positions are compared.

        """
        motion = self.motion()
        # deviations are largest in the middle, but zero there for a harmonic at the sampling rate
        between = motion.t[:-1] + 0.4 / self.rate
        away = np.abs(Reference.of(motion).sample(between).q - self.at(between).q).max(axis=0)
        j = int(np.argmax(away))
        if away[j] > 0.001:  # largest distance from the path [rad or m]
            raise TrajectoryError(
                f"joint '{self.joints[j]}' would be {away[j]:.2g} rad or m off its path between "
                f'{self.rate:g} waypoints per second: raise the rate, or use fewer harmonics'
            )


def plan_run(
    excitation: Excitation,
    planner: TransferPlanner,
    start: FloatArray,
    rate: float,
    *,
    shortest: float = 0.0,
    back: bool = True,
    seed: int = 0,
) -> Run:
    """
    Plan a run: approach from the present pose, excitation, and return.

    Parameters
    ----------
    excitation : Excitation
        The excitation; its joints may be shifted by whole turns.
    planner : TransferPlanner
        Planner of the transfers.
    start : ndarray, shape (n,)
        Present pose of the arm [rad or m].
    rate : float
        Samples per second [Hz].
    shortest : float
        Shortest duration of a transfer [s].
    back : bool
        Whether the arm returns to its start pose.
    seed : int
        Seed of the search for a path.

    Raises
    ------
    TrajectoryError
        If no path was found, or the waypoints are too few for the path; the message names the
        obstruction or the joint.

    """
    excitation = _unwound(excitation, planner.arm, planner.limits, start)
    first, last = excitation.at([0.0, excitation.duration]).q
    there = planner(start, first, shortest, seed)
    home = planner(start, last, shortest, seed).reversed() if back else None
    run = Run(there, excitation, home, rate)
    run.require_waypoints()
    return run


def _unwound(
    excitation: Excitation, arm: ArmModel, limits: Limits, start: FloatArray
) -> Excitation:
    """Shift joints of an excitation by whole turns towards the start pose, within the limits."""
    # A joint with a range of two turns reaches most poses at two positions. The path to one of the
    # two is often blocked, as the shoulder would hit the floor.
    trajectory = excitation.trajectory
    samples = 400
    q = trajectory.one_period(samples).q
    low, high = q.min(axis=0), q.max(axis=0)
    turn = 2.0 * np.pi
    wanted = np.round((start - 0.5 * (low + high)) / turn)
    least = np.ceil((limits.lower - low) / turn)
    most = np.floor((limits.upper - high) / turn)
    turns = np.clip(wanted, np.minimum(least, 0.0), np.maximum(most, 0.0))
    turns = np.where(limits.prismatic, 0.0, turns)
    if not turns.any():
        return excitation
    moved = replace(trajectory, q0=trajectory.q0 + turn * turns)
    before, after = (arm.joint_torque(path.one_period(samples)) for path in (trajectory, moved))
    # springs make torques that differ after whole turns by more than rounding
    if np.abs(after - before).max() > 1e-6 * np.abs(before).max():
        return excitation
    return replace(excitation, trajectory=moved)
