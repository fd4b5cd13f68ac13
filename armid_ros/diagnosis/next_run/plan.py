# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Planning of the next run: the motion that best separates named effects from their rivals.

The criterion is T-optimality (Atkinson and Fedorov 1975): the sum of squared torques of the named
effect, over the floor of the gap, that the rival cannot reproduce. The rival and the nuisance
parameters are fitted to this torque.

The motions are slow and fast motion of all joints, motion of single joints, reversals so small
that dry friction does not break away, and shaking. Each motion is also tried with a known
payload; only a payload separates a gain of the drives from the masses.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from armid_ros.diagnosis.next_run.separation import Load, Separation, separation
from armid_ros.diagnosis.verdict.finding import Diagnosis
from armid_ros.effects import Effect
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
from armid_ros.excitation.design import with_run_in
from armid_ros.excitation.feasibility import CLEARANCE, Template, templates
from armid_ros.robots import collision_model, CollisionModel
import numpy as np

#: File name of a planned run.
EXPERIMENT_FILE = 'experiment.yaml'
#: Sufficient separation in standard deviations; a motion that reaches it needs no payload.
_SUFFICIENT_Z = 5.0


@dataclass(frozen=True)
class NextRun:
    """
    Planned motion that separates the named effects from their rivals.

    Attributes
    ----------
    excitation : Excitation
        Motion of two equal periods from rest to rest, within all limits and without collisions.
    template : str
        Kind of the motion, in words.
    load : Load or None
        Load to fix to the last link in a second run of the same motion; None if one run suffices.
    separations : tuple of Separation
        Predicted separation of each pair of effects.

    """

    excitation: Excitation
    template: str
    load: Load | None
    separations: tuple[Separation, ...]

    @property
    def sentence(self) -> str:
        """Return a sentence on the motion and the pairs of effects that it separates."""
        separated = sorted((s for s in self.separations if s.distinct), key=lambda one: one.z)
        most = 3  # pairs in a sentence
        parts = []
        for one in separated[:most]:  # the noise is not known well enough for more than 30
            times = f'{one.z:.0f}' if one.z < 30.0 else 'more than 30'
            parts.append(f'{one.name} from {one.rival} by {times} standard deviations')
        if len(separated) > most:
            parts.append(f'{len(separated) - most} more pairs of effects by more')
        again = ''
        if self.load is not None:
            again = f', then again with {self.load.mass:g} kg fixed to {self.load.frame}'
        return (
            f'Run {EXPERIMENT_FILE} ({self.template}, {self.excitation.duration:.0f} s){again}, '
            'and diagnose all recordings together: it should separate '
            f'{name_in_words(", ".join(parts))}.'
        )

    def document(self) -> dict[str, Any]:
        """Return the planned run as an entry of diagnosis.json."""
        return {
            'file': EXPERIMENT_FILE,
            'motion': self.template,
            'duration': self.excitation.duration,
            'payload': 0.0 if self.load is None else self.load.mass,
            'separates': [
                {'name': one.name, 'rival': one.rival, 'expected_z': one.z}
                for one in self.separations
            ],
            'expected_z': min(pair.z for pair in self.separations),
        }


class _Candidate(NamedTuple):
    """Candidate motion, the load of its second run, and its separation of effect pairs."""

    template: Template
    trajectory: FourierTrajectory
    load: Load | None
    separations: tuple[Separation, ...]


def next_run(
    diagnosis: Diagnosis,
    rng: np.random.Generator,
    *,
    collision: CollisionModel | None = None,
) -> NextRun | None:
    """
    Plan a motion that separates named effects from their rivals.

    Parameters
    ----------
    diagnosis : Diagnosis
        Diagnosis with named effects and their rivals.
    rng : numpy.random.Generator
        Draws the motions.
    collision : CollisionModel, optional
        Bodies that must not collide; those of the description by default.

    Returns
    -------
    NextRun or None
        None if no effect has a rival, or the arm is tied to another machine.

    Raises
    ------
    TrajectoryError
        If the arm cannot make any of the motions, or none separates any pair of effects.

    """
    pairs = _pairs(diagnosis)
    arm = diagnosis.arm
    if not pairs or any(isinstance(effect, Tied) for effect in arm.effects):
        return None
    clearance = ClearanceModel.of(collision or collision_model(arm.robot), CLEARANCE)
    effects = [effect for pair in pairs for effect in pair]
    joints = dict.fromkeys(joint for effect in effects for joint in effect.joints)
    whole_arm = any(not effect.joints for effect in effects)
    candidates: list[_Candidate] = []
    refused: list[str] = []
    for template in templates(() if whole_arm else tuple(joints)):
        try:
            trajectory = template.draw(arm, clearance, rng)
        except TrajectoryError as error:
            refused.append(str(error))
            continue
        load = Load.along(arm, trajectory) if template.loaded else None
        separated = (separation(diagnosis, *pair, trajectory, load) for pair in pairs)
        candidates.append(_Candidate(template, trajectory, load, tuple(separated)))
    useful = [one for one in candidates if any(pair.distinct for pair in one.separations)]
    if candidates and not useful:
        names = ', '.join(f'{one.name} from {one.rival}' for one in candidates[0].separations)
        raise TrajectoryError(f'none of the planned motions separates {name_in_words(names)}')
    for kind, trajectory, load, separations in _in_order(useful) if useful else ():
        settings = DesignSettings(
            period=kind.period,
            harmonics=kind.harmonics,
            speed=kind.speed,
            clearance=CLEARANCE,
        )
        problem = DesignProblem.of(arm, settings, rng)
        try:
            excitation = with_run_in(problem, trajectory)
        except TrajectoryError as error:
            refused.append(str(error))
            continue
        return NextRun(excitation, kind.name, load, separations)
    reason = refused[-1]
    raise TrajectoryError(f'no motion for the next run was found: {reason}')


def _in_order(candidates: Sequence[_Candidate]) -> list[_Candidate]:
    """
    Sort candidate motions by how well they separate all pairs of effects, best first.

    Motions with a payload come last if a motion without payload separates all pairs sufficiently.

    """
    z = np.array([[pair.z for pair in one.separations] for one in candidates])
    loaded = np.array([one.template.loaded for one in candidates])
    most = z.max(axis=0)
    wanted = np.where(most < 1.0, 0.0, np.minimum(most, _SUFFICIENT_Z))
    enough = bool(np.any(np.all(z[~loaded] >= wanted, axis=1)))
    order = np.lexsort((-np.log1p(z**2).sum(axis=1), loaded & enough))
    return [candidates[k] for k in order]


def _pairs(diagnosis: Diagnosis) -> list[tuple[Effect, Effect]]:
    """Return pairs of a named effect and a rival, each pair of effect names once."""
    explanation = diagnosis.explanation
    if explanation is None:
        return []
    fitted = [own.effect for own in explanation.fitted.named]
    found = {effect.name for effect in fitted}
    pairs: dict[tuple[str, str], tuple[Effect, Effect]] = {}
    for named, trial in zip(fitted, explanation.steps, strict=True):
        for rival in (one.effect for one in trial.rivals):
            if rival.name not in found:
                pairs.setdefault((named.name, rival.name), (named, rival))
    return list(pairs.values())
