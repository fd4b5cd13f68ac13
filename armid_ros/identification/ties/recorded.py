# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Regression of the stiffness of springs between two machines, from recordings of both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import comb

from armid_ros.arm import ArmModel
from armid_ros.effects.tied import Tied, TiedSlack
from armid_ros.errors import IdentificationError
from armid_ros.identification.rows.signals import (
    Conditioning,
    conditioning,
    mean_spectrum,
    segments,
    SignalSettings,
)
from armid_ros.identification.ties.problem import (
    Inertias,
    interaction_problem,
    InteractionProblem,
    STACKED,
)
from armid_ros.model.spring_ties import TiedMachines
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import recorded_together, Recording
from armid_ros.robots import Robot
import numpy as np


def recorded_interaction_problem(
    machines: TiedMachines,
    recording: Recording,
    other_recording: Recording,
    *,
    inertias: Inertias = 'known',
    separate: bool = False,
    slack: float | FloatArray = 0.0,
) -> InteractionProblem:
    """
    Return the regression for spring stiffness, from two recordings, one of each machine.

    The angles of the other machine are interpolated at the stamps of the first machine. Both are
    filtered, and torques and columns are decimated, as in any identification. White noise of the
    angles is computed from differences of high order; a known share passes the filters.

    Parameters
    ----------
    machines : TiedMachines
        Both machines, with the positions of the springs.
    recording, other_recording : Recording
        Recordings of both machines, with overlapping stamps.
    inertias, separate, slack
        See `interaction_problem`.

    Raises
    ------
    IdentificationError
        If there are no torques, or no or too little common time.

    """
    if recording.tau is None:
        raise IdentificationError(
            f'{recording.source}: {recording.topic} has no effort; record the efforts of the arm'
        )
    together = recorded_together(recording, other_recording, machines.other, machines.ties)
    settings = SignalSettings()
    both = _one_machine(together)
    used = band_of_motion([both], conditioning([both], settings), settings)
    return together_interaction_problem(
        machines.robot, together, used, inertias=inertias, separate=separate, slack=slack
    )


def together_interaction_problem(
    robot: Robot,
    recording: Recording,
    used: Conditioning,
    *,
    inertias: Inertias = 'known',
    separate: bool,
    slack: float | FloatArray = 0.0,
    rest: Callable[[Motion], FloatArray] | None = None,
) -> InteractionProblem:
    """
    Return the regression for spring stiffness, from one recording of both machines.

    Parameters
    ----------
    robot : Robot
        The machine whose torques were measured.
    recording : Recording
        Recording of the arm with torques, the motion of the other machine and the ties.
    used : Conditioning
        Filters.
    inertias, separate, slack
        See `interaction_problem`.
    rest : callable, optional
        Function of a motion that returns the torque of other effects, such as friction, shape
        (N, n) [N m].

    Raises
    ------
    IdentificationError
        If no stretch of the recording is long enough.

    """
    partner, n = recording.partner, len(recording.joints)
    assert partner is not None
    both = _one_machine(recording)
    assert both.tau is not None
    machines = TiedMachines(robot, partner.robot, partner.ties)
    problems = []
    for stretch, own in zip(segments(both, used), segments(recording, used), strict=True):
        assert own.tau is not None
        tau = own.tau if rest is None else own.tau - rest(own)
        far = (np.array(x[:, n:]) for x in (stretch.q, stretch.dq, stretch.ddq))
        problems.append(
            interaction_problem(
                machines,
                own.with_torque(tau),
                Motion(both.joints[n:], stretch.t, *far),
                noise=(_white(both.q), _white(both.tau[:, :n])),
                used=used,
                inertias=inertias,
                separate=separate,
                slack=slack,
            )
        )
    if not problems:
        raise IdentificationError(
            f'{recording.source}: no section without a gap is long enough for a filter of '
            f'{used.cutoff_hz:.3g} Hz; record longer'
        )
    return stacked(problems)


def stacked(problems: Sequence[InteractionProblem]) -> InteractionProblem:
    """
    Join the regressions of several sections or recordings into one.

    Raises
    ------
    IdentificationError
        If their free inertias differ.

    """
    if any(part.rigid != problems[0].rigid for part in problems):
        raise IdentificationError('sections determine different inertias; record more in each')
    joined = {name: np.concatenate([getattr(part, name) for part in problems]) for name in STACKED}
    return replace(problems[0], **joined)  # type: ignore[arg-type]


def _one_machine(recording: Recording) -> Recording:
    """Return a recording with the joints of both machines; torques of the second are zero."""
    assert recording.partner is not None and recording.tau is not None
    far = recording.partner.q
    return replace(
        recording,
        joints=(*recording.joints, *recording.partner.robot.joints),
        q=np.hstack([recording.q, far]),
        dq=None,
        tau=np.hstack([recording.tau, np.zeros_like(far)]),
        partner=None,
    )


def band_of_motion(
    recordings: Sequence[Recording],
    used: Conditioning,
    settings: SignalSettings,
    margin: float = 2.0,
) -> Conditioning:
    """
    Return filters with the pass band reduced to the band of the motion, unless set by the user.

    Parameters
    ----------
    recordings : sequence of Recording
        Recordings to be filtered.
    used : Conditioning
        Filters with the largest band.
    settings : SignalSettings
        Cut-off and decimation given by the user.
    margin : float
        Cut-off over the band of the motion. The noise of accelerations grows with the power of
        2.5 of the cut-off.

    """
    if settings.cutoff_hz is None:
        ends = []  # frequencies at which the motion of an angle falls below its noise [Hz]
        for recording in recordings:
            # spectra of pieces of 4 s are averaged
            frequency, power = mean_spectrum([recording.q], used.rate_hz, 'linear', 4.0)
            # ratio of a spectrum to the noise that ends the band of the motion
            above = power > 3.0 * 2.0 * _white(recording.q) ** 2 / used.rate_hz
            above[-1] = False
            ends += [float(frequency[2:][np.argmin(column)]) for column in above[2:].T]
        used = replace(used, cutoff_hz=min(used.cutoff_hz, margin * max(ends)))
    if settings.decimation is None:
        factor = int(used.rate_hz / (2.0 * used.cutoff_hz))
        used = replace(used, decimation=max(used.decimation, factor))
    return used


def _white(signals: FloatArray) -> FloatArray:
    """Return the standard deviation of the white noise in signals of shape (N, n)."""
    # order of the differences from which noise is computed
    order = 6
    # Differences of high order remove a densely sampled motion.
    differences = np.diff(signals, order, axis=0)
    return np.asarray(np.sqrt(np.mean(differences**2, axis=0) / comb(2 * order, order)))


@dataclass(frozen=True)
class SensorNoise:
    """
    Torque noise of an arm that is connected to another machine by springs.

    With springs, the noise of angles dominates. It is known far better from the angles themselves
    than from the difference of two periods of some seconds.

    Attributes
    ----------
    robot : Robot
        The arm as described.
    recording : Recording
        Recording of the arm with the other machine.
    used : Conditioning
        Filters.

    """

    robot: Robot
    recording: Recording
    used: Conditioning

    def floor(self, arm: ArmModel) -> FloatArray:
        """Return the standard deviation (n,) of the noise of filtered torques [N m]."""
        problem = self._taut
        stiffness = dict.fromkeys(problem.spring_joints, 0.0)
        slack = dict.fromkeys(problem.spring_joints, 0.0)
        for effect, values in zip(arm.effects, arm.values, strict=True):
            if isinstance(effect, Tied):
                each = len(values) // len(effect.joints)
                stiffness.update(zip(effect.joints, values[::each].tolist(), strict=True))
            if isinstance(effect, TiedSlack):
                slack.update(zip(effect.joints, effect.slacks.tolist(), strict=True))
        if any(slack.values()):
            problem = together_interaction_problem(
                *(self.robot, self.recording, self.used),
                separate=True,
                slack=np.array(list(slack.values())),
            )
        return problem.deviation(np.array(list(stiffness.values())))

    @cached_property
    def _taut(self) -> InteractionProblem:
        """Linear regression of torques on springs without slack."""
        return together_interaction_problem(self.robot, self.recording, self.used, separate=True)
