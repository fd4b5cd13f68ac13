# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The regression of the springs between two machines, from recordings of both."""

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
    segments,
    SignalSettings,
)
from armid_ros.identification.rows.spectrum import mean_spectrum
from armid_ros.identification.ties.problem import (
    Inertias,
    interaction_problem,
    InteractionProblem,
    MachineNoise,
    STACKED,
)
from armid_ros.model.spring_ties import TiedMachines
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import recorded_together, Recording
from armid_ros.robots import Robot
import numpy as np

#: Order of the differences that noise is measured by.
_ORDER = 6
#: The filter's pass band is so much wider than the motion's that it leaves the motion as it is.
_MARGIN = 2.0
#: The motion ends where its spectrum is less than this many times the noise.
_ABOVE = 3.0


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
    Set up the regression on recordings, the noise of their angles being measured in them.

    The angles of the other machine are brought to the stamps of the first; both are filtered and
    torques and columns decimated as for any identification. White noise is what the angles have
    in the upper two fifths of their spectrum; the filters leave a known share of it.

    Parameters
    ----------
    machines : TiedMachines
        Both, and where the springs are.
    recording, other_recording : Recording
        Of both, with overlapping stamps.
    inertias : {'known', 'free'}
        Whether the machine's inertias are those of its description or are estimated as well.
    separate : bool
        Whether every spring has a stiffness of its own, or all have one.
    slack : float or ndarray, shape (S,)
        Way that the springs give before they pull [m].

    Raises
    ------
    IdentificationError
        If there are no torques, no common time, or too little of it.

    """
    if recording.tau is None:
        raise IdentificationError(f'{recording.source}: {recording.topic} has no effort')
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
    separate: bool = False,
    slack: float | FloatArray = 0.0,
    rest: Callable[[Motion], FloatArray] | None = None,
) -> InteractionProblem:
    """
    Set up the regression on a recording that has the motion of the other machine.

    Parameters
    ----------
    robot : Robot
        The machine whose torques were measured.
    recording : Recording
        Of the arm, with torques, and with the motion of the other machine and the ties.
    used : Conditioning
        Filters.
    inertias, separate, slack
        As of `recorded_interaction_problem`.
    rest : callable, optional
        Torque along a motion of what else acts on the machine, such as friction, shape (N, n)
        [N m].

    Raises
    ------
    IdentificationError
        If there is too little of it.

    """
    beside, n = recording.partner, len(recording.joints)
    assert beside is not None
    both = _one_machine(recording)
    assert both.tau is not None
    machines = TiedMachines(robot, beside.robot, beside.ties)
    noise = MachineNoise(_white(both.q), _white(both.tau[:, :n]))
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
                noise=noise,
                used=used,
                inertias=inertias,
                separate=separate,
                slack=slack,
            )
        )
    if not problems:
        raise IdentificationError(
            f'{recording.source}: no stretch is long enough for a filter of '
            f'{used.cutoff_hz:.3g} Hz'
        )
    return stacked(problems)


def stacked(problems: Sequence[InteractionProblem]) -> InteractionProblem:
    """
    Put stretches or recordings together.

    Raises
    ------
    IdentificationError
        If they do not free the same inertias.

    """
    if any(part.rigid != problems[0].rigid for part in problems):
        raise IdentificationError('a stretch between gaps moves too little to free the inertias')
    joined = {name: np.concatenate([getattr(part, name) for part in problems]) for name in STACKED}
    return replace(problems[0], **joined)  # type: ignore[arg-type]


def _one_machine(recording: Recording) -> Recording:
    """Return a recording and its partner as one machine, without torques of the partner."""
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
    margin: float = _MARGIN,
) -> Conditioning:
    """
    Return filters that leave the motion and nothing else, as far as settings leave them open.

    Parameters
    ----------
    recordings : sequence of Recording
        What is to be filtered.
    used : Conditioning
        Filters that are to be narrowed.
    settings : SignalSettings
        What was asked for.
    margin : float
        How much wider than the motion the pass band is. Accelerations have noise that grows with
        its power of 2.5.

    """
    if settings.cutoff_hz is None:
        crossing = max(_crossing(recording, used.rate_hz) for recording in recordings)
        used = replace(used, cutoff_hz=min(used.cutoff_hz, margin * crossing))
    if settings.decimation is None:
        factor = int(used.rate_hz / (2.0 * used.cutoff_hz))
        used = replace(used, decimation=max(used.decimation, factor))
    return used


def _crossing(recording: Recording, rate: float) -> float:
    """Return where the motion of the fastest angle sinks into its noise [Hz]."""
    # spectra of pieces of 4 s are averaged
    frequency, power = mean_spectrum([recording.q], rate, 'linear', 4.0)
    above = power > _ABOVE * 2.0 * _white(recording.q) ** 2 / rate
    above[-1] = False
    return max(float(frequency[2:][np.argmin(column)]) for column in above[2:].T)


def _white(signals: FloatArray) -> FloatArray:
    """Return the standard deviation of white noise in signals of shape (N, n)."""
    # Differences of high order leave nothing of a motion that is sampled densely.
    differences = np.diff(signals, _ORDER, axis=0)
    return np.asarray(np.sqrt(np.mean(differences**2, axis=0) / comb(2 * _ORDER, _ORDER)))


@dataclass(frozen=True)
class SensorNoise:
    """
    What white noise of the sensors does to the torques of an arm beside another machine.

    Beside springs the noise of angles is most of what there is, and it is known from their spectra
    far better than from what two periods of some seconds differ by.

    Attributes
    ----------
    robot : Robot
        The arm as described.
    recording : Recording
        Of it, with what was beside it.
    used : Conditioning
        Filters.

    """

    robot: Robot
    recording: Recording
    used: Conditioning

    def floor(self, arm: ArmModel) -> FloatArray:
        """Return the standard deviation of a row beside an arm with its ties, (n,) [N m]."""
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
            problem = self._problem(np.array(list(slack.values())))
        return problem.deviation(np.array(list(stiffness.values())))

    @cached_property
    def _taut(self) -> InteractionProblem:
        return self._problem(0.0)

    def _problem(self, slack: float | FloatArray) -> InteractionProblem:
        return together_interaction_problem(
            self.robot, self.recording, self.used, separate=True, slack=slack
        )
