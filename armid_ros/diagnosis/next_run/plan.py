# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The next run: the motion that best separates named effects from rivals.

T-optimality (Atkinson and Fedorov 1975): the value of a motion is the squared torque of the named
effect, over the unit of the gap, that the rival, fitted jointly with the nuisance parameters,
cannot explain.

The motions are slow and fast motion of all joints, motion of single joints, reversals so small
that dry friction does not break away, and shaking. Each motion is also tried with a known
payload; only a payload separates a gain of the drives from the masses.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from armid_ros.diagnosis.next_run.separation import Doubt, Load, NOTHING, Separation
from armid_ros.diagnosis.verdict.finding import Diagnosis
from armid_ros.effects.tied import Tied
from armid_ros.errors import TrajectoryError
from armid_ros.estimate import name_in_words
from armid_ros.excitation import (
    ClearanceModel,
    DesignProblem,
    DesignSettings,
    Excitation,
    FourierTrajectory,
)
from armid_ros.excitation.design import placed
from armid_ros.excitation.feasibility import CLEARANCE, Template, templates
from armid_ros.robots import collision_model, CollisionModel
import numpy as np

#: File name of a planned run.
EXPERIMENT_FILE = 'experiment.yaml'
#: Sufficient separation in standard deviations; a motion that reaches it needs no payload.
_SURE = 5.0
#: Largest reported number of standard deviations; the noise is not known well enough for more.
_CERTAIN = 30.0
#: Largest number of pairs of names in a sentence.
_SAID = 3


@dataclass(frozen=True)
class NextRun:
    """
    A motion to run next.

    Attributes
    ----------
    excitation : Excitation
        Motion of two equal periods from rest to rest, within all limits and without collisions.
    template : str
        Kind of the motion, in words.
    load : Load or None
        Load to fix to the last link in a second run of the same motion; None if one run suffices.
    separations : tuple of Separation
        Separation of each pair of names.

    """

    excitation: Excitation
    template: str
    load: Load | None
    separations: tuple[Separation, ...]

    @property
    def expected_z(self) -> float:
        """Return the z-score of the least separated pair."""
        return min(pair.z for pair in self.separations)

    @property
    def sentence(self) -> str:
        """Describe the run and the pairs that it separates, the least separated pair first."""
        separated = sorted((s for s in self.separations if s.distinct), key=lambda one: one.z)
        parts = [
            f'{one.name} from {one.rival} by {_many(one.z)} standard deviations'
            for one in separated[:_SAID]
        ]
        if len(separated) > _SAID:
            parts.append(f'{len(separated) - _SAID} more pairs of names by more')
        again = ''
        if self.load is not None:
            again = f', then again with {self.load.mass:g} kg fixed to {self.load.frame}'
        return (
            f'Run {EXPERIMENT_FILE} ({self.template}, {self.excitation.duration:.0f} s){again}, '
            'and diagnose all recordings together: it should separate '
            f'{name_in_words(", ".join(parts))}.'
        )

    def document(self) -> dict[str, Any]:
        """Return the entry of the run in diagnosis.json."""
        return {
            'file': EXPERIMENT_FILE,
            'motion': self.template,
            'duration': self.excitation.duration,
            'payload': 0.0 if self.load is None else self.load.mass,
            'separates': [
                {'name': one.name, 'rival': one.rival, 'expected_z': one.z}
                for one in self.separations
            ],
            'expected_z': self.expected_z,
        }


def _many(deviations: float) -> str:
    """Format a z-score; above `_CERTAIN` it becomes "more than `_CERTAIN`"."""
    return f'{deviations:.0f}' if deviations < _CERTAIN else f'more than {_CERTAIN:.0f}'


def next_run(
    diagnosis: Diagnosis,
    rng: np.random.Generator,
    *,
    collision: CollisionModel | None = None,
) -> NextRun | None:
    """
    Choose a motion that separates named effects from their rivals.

    Parameters
    ----------
    diagnosis : Diagnosis
        Diagnosis with named effects and their rivals.
    rng : numpy.random.Generator
        Draws the motions.
    collision : CollisionModel, optional
        Bodies to keep apart; those of the description by default.

    Returns
    -------
    NextRun or None
        None if no name is in doubt, or the arm is tied to a machine whose motion is not planned.

    Raises
    ------
    TrajectoryError
        If the arm cannot make any of the motions, or none separates any names; gives the reason.

    """
    doubts = _doubts(diagnosis)
    arm = diagnosis.arm
    if not doubts or any(isinstance(effect, Tied) for effect in arm.effects):
        return None
    clearance = ClearanceModel.of(collision or collision_model(arm.robot), CLEARANCE)
    joints = dict.fromkeys(joint for doubt in doubts for joint in doubt.joints)
    whole_arm = any(not doubt.joints for doubt in doubts)
    runs: list[_Run] = []
    refused: list[str] = []
    for template in templates(() if whole_arm else tuple(joints)):
        try:
            trajectory = template.draw(arm, clearance, rng)
        except TrajectoryError as error:
            refused.append(str(error))
            continue
        load = Load.along(arm, trajectory) if template.loaded else None
        pairs = tuple(Separation.of(diagnosis, doubt, trajectory, load) for doubt in doubts)
        runs.append(_Run(template, trajectory, load, pairs))
    telling = [run for run in runs if any(one.distinct for one in run.separations)]
    if runs and not telling:
        names = ', '.join(f'{one.name} from {one.rival}' for one in runs[0].separations)
        raise TrajectoryError(f'none of the planned motions separates {name_in_words(names)}')
    for run in _in_order(telling):
        kind = run.template
        settings = DesignSettings(
            period=kind.period,
            harmonics=kind.harmonics,
            speed=kind.speed,
            clearance=CLEARANCE,
        )
        problem = DesignProblem.of(arm, settings, rng)
        try:
            excitation = placed(problem, run.trajectory)
        except TrajectoryError as error:
            refused.append(str(error))
            continue
        return NextRun(excitation, kind.name, run.load, run.separations)
    raise TrajectoryError(f'no motion for the next run: {refused[-1]}')


@dataclass(frozen=True)
class _Run:
    """A motion and its predicted separation of each pair of names."""

    template: Template
    trajectory: FourierTrajectory
    load: Load | None
    separations: tuple[Separation, ...]

    @property
    def worth(self) -> float:
        """Sum of log(1 + D_T) over pairs; inseparable pairs add nothing."""
        return float(sum(np.log1p(pair.power) for pair in self.separations))


def _in_order(runs: Sequence[_Run]) -> list[_Run]:
    """Sort runs, best first; runs with a payload come last if some motion needs none."""
    most = np.max([[pair.z for pair in run.separations] for run in runs], axis=0, initial=0.0)
    wanted = np.where(most < NOTHING, 0.0, np.minimum(most, _SURE))
    plain = [run for run in runs if not run.template.loaded]
    enough = any(all(p.z >= z for p, z in zip(r.separations, wanted, strict=True)) for r in plain)
    return sorted(runs, key=lambda run: (enough and run.template.loaded, -run.worth))


def _doubts(diagnosis: Diagnosis) -> tuple[Doubt, ...]:
    """Return the pairs of a named effect and a rival."""
    explanation = diagnosis.explanation
    if explanation is None:
        return ()
    pairs = zip(explanation.fitted.named, explanation.steps, strict=True)
    found = {own.effect.name for own in explanation.fitted.named}
    doubts: dict[tuple[str, str], Doubt] = {}
    for named, trial in pairs:
        for other in (rival.effect for rival in trial.rivals):
            if other.name not in found:
                doubts.setdefault((named.effect.name, other.name), Doubt(named, other))
    return tuple(doubts.values())
