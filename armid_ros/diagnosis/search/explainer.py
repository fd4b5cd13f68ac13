# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The search for causes of a residual, with a baseline, a stored misfit, or only the model.

The selection of causes is the same in the three cases. They differ in the prior of model
discrepancy and noise.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

from armid_ros.arm import ArmModel, Misfit
from armid_ros.arm.memoized_arm import memoized_arm, plain_arm
from armid_ros.arm.misfit import growth
from armid_ros.arm.model_file import add_effect
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence, noise_floor, torque_rms
from armid_ros.diagnosis.data.rows import Rows
from armid_ros.diagnosis.data.trajectory import count_recordings, Trajectory
from armid_ros.diagnosis.prepare import Prepared, with_friction
from armid_ros.diagnosis.search.candidates import Causes
from armid_ros.diagnosis.search.comparison import (
    CauseComparison,
    grid_without_baseline,
    hyperparameters_of_baseline,
    Selection,
)
from armid_ros.diagnosis.search.explanation import (
    ESTIMATED,
    explain,
    Explanation,
    has_no_gap,
    OWN_MISFIT,
    WRITTEN_MISFIT,
)
from armid_ros.diagnosis.search.hyperparameters import CORRELATED_ROWS, Hyperparameters
from armid_ros.diagnosis.search.joint_fit import JointFit
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.identification.rows.temperature import mean_temperatures
from armid_ros.motion import FloatArray
import numpy as np

#: Callback with the completed share of the work and the name of the present step.
Progress = Callable[[float, str], None]
#: Smallest share of a misfit that is not noise. Of 20 effects that appeared in a running arm, 20
#: were named, and only 15 with a share of 1.
_MIN_MISFIT_SHARE = 0.3
#: Relative difference of gravity below which the regressor of the rigid body is not recomputed.
_SAME_GRAVITY = 0.003
#: Advice if the recordings do not separate a change from the misfit of another motion.
_NO_BASELINE = (
    'Without a baseline, an error of the model in this motion is not excluded: give recordings '
    'from before (--baseline).'
)
_ONE_EACH = (
    'With one baseline recording and one diagnosed recording, an error of the model in this '
    'motion is not excluded: record a second motion.'
)


@dataclass(frozen=True)
class Explainer:
    """
    Search for the causes of a residual among the effects of the catalogue.

    Attributes
    ----------
    arm : ArmModel
        The given model.
    prepared : Prepared
        The diagnosed recordings, with their noise.
    baseline : Baseline or None
        Recordings from a time at which the model was right.
    rng : numpy.random.Generator
        Draws the random states from which base parameters are found.
    tell : callable
        Called with the share of the work that is done, and the name of the present step.
    settings : DiagnosisSettings
        Catalogue and thresholds.
    misfit : Misfit or None
        Misfit of the model when it was identified.
    held_out : sequence of Trajectory
        Held-out recordings.

    """

    arm: ArmModel
    prepared: Prepared
    baseline: Baseline | None
    rng: np.random.Generator
    tell: Progress
    settings: DiagnosisSettings
    misfit: Misfit | None = None
    held_out: Sequence[Trajectory] = ()

    def explanation(self) -> Explanation:
        """Search for the causes of the residual, with the method that the inputs allow."""
        if self.baseline is not None:
            return self._explain_since_baseline(self.baseline)
        return (
            self._explain_model_alone()
            if self.misfit is None
            else self._explain_since_identification(self.misfit)
        )

    def _explain_model_alone(self) -> Explanation:
        """Find the missing effects of a model if there are no recordings for comparison."""
        prepared, settings = self.prepared, self.settings
        self.tell(0.2, 'search for missing effects')
        evidence = Evidence.over_noise(prepared.data, prepared.sigma)
        rows = Rows.over_noise(evidence)
        unknown = with_friction(self.arm, settings.library)[1]
        comparison = self.comparison(rows, grid_without_baseline())
        gravity = self.arm.robot.gravity
        first = result = comparison.select()
        # Torque is bilinear in gravity and masses. With 2 fits in place of 5, the same number of
        # 20 mountings is within 1 degree and 2 %.
        for _ in range(5):
            before, tilted = gravity, plain_arm(self.arm)
            means = result.nuisance.means(result.posterior)
            for one, span in zip(
                result.nuisance.accepted, result.nuisance.value_slices, strict=True
            ):
                if not one.effect.joints:
                    named = one.at(means[span], tilted.robot)
                    tilted = add_effect(tilted, named.effect, named.values)
            gravity = tilted.body.gravity
            if np.linalg.norm(gravity - before) <= _SAME_GRAVITY * np.linalg.norm(before):
                break
            grid = [
                x
                for x in grid_without_baseline()
                if x.body == result.posterior.hyperparameters.body
            ]
            comparison = self.comparison(rows, grid, gravity=gravity)
            result = comparison.refit_whole_arm_causes(result)
        if result is not first:
            result = comparison.select(result)
        hyperparameters, constant = result.posterior.hyperparameters, list[int]()
        if hyperparameters.body:
            accepted = [one.effect for one in result.nuisance.accepted]
            changed = [p for effect in accepted for p in effect.parameters(self.arm.robot)]
            constant = [k for k, p in enumerate(self.arm.parameters) if p in changed]
        nuisance = Nuisance.of(
            rows, memoized_arm(self.arm), self.rng, constant=constant, gravity=gravity
        )
        every = tuple(range(len(rows.diagnosed)))
        problem = JointFit(nuisance.arm, nuisance, hyperparameters, every, patches_body=True)
        found = explain(problem, evidence, result, settings, unknown)
        if has_no_gap(found, settings):
            return found
        misfit = np.sqrt(evidence.power(found.residual))
        sigma = tuple(np.maximum(one, misfit) for one in evidence.sigma)
        evidence = replace(evidence, sigma=sigma)
        return replace(found, evidence=evidence, floor=ESTIMATED, misfit=misfit)

    def _explain_since_identification(self, written: Misfit) -> Explanation:
        """
        Find changes since the identification from the misfit alone, without the baseline.

        Without its recordings, any cause may explain a part of this misfit; see `fit_causes`.

        """
        prepared, known = self.prepared, written.information
        misfit = written.of(self.arm.robot, torque_rms(prepared.data))
        noise = _noise_within(misfit, prepared, misfit)
        evidence = Evidence(prepared.data, tuple(np.maximum(s, misfit) for s in noise), noise)
        # a misfit contains noise, which no cause can explain
        rest = misfit**2 - np.mean(np.square(noise), axis=0)
        part = np.maximum(rest, (_MIN_MISFIT_SHARE * misfit) ** 2)
        amplitude = (np.sqrt(part),) * count_recordings(prepared.data)
        rows = Rows(prepared.data, evidence.sigma, 0, amplitude, misfit_only=True)
        body = float(known is not None)
        grid = [
            Hyperparameters(body, share, share, amplitude, CORRELATED_ROWS)
            for share, amplitude in product((0.2, 0.4, 0.8), (0.5, 1.1))
        ]
        result = self.comparison(rows, grid, known).select()
        found = self._fit_changes(result, evidence, 0.0)
        return replace(found, floor=WRITTEN_MISFIT, misfit=misfit, untested=_NO_BASELINE)

    def _explain_since_baseline(self, baseline: Baseline) -> Explanation:
        prepared = self.prepared
        now, then = torque_rms(prepared.data), torque_rms(baseline.data)
        misfit = baseline.misfit * growth(now, then)
        rough = [noise_floor(part, self.arm).rough for part in baseline.data]
        noise = _noise_within(misfit, prepared, np.sqrt(np.mean(np.square(rough), axis=0)))
        sigma = tuple(np.maximum(one, misfit) for one in noise)
        evidence = Evidence(prepared.data, sigma, noise, baseline.varies)
        self.tell(0.2, 'search for changes')
        # the misfit of other motions grows with the torque or the speed, whichever increased more
        today, more = prepared.data, self.held_out
        faster = growth(_speed([*today, *more]), _speed(baseline.data))
        first, second, third = map(count_recordings, (baseline.data, today, more))
        mean = np.sqrt(np.mean(np.square(sigma), axis=0))
        largest = np.maximum(misfit, faster * baseline.misfit)
        rows = Rows(
            (
                *baseline.data,
                *(replace(part, fold=part.fold + first) for part in today),
                *(replace(part, fold=part.fold + first + second) for part in more),
            ),
            (*(baseline.misfit,) * len(baseline.data), *sigma, *(mean,) * len(more)),
            first,
            (*(baseline.misfit,) * first, *(largest,) * (second + third)),
        )
        result = self.comparison(rows.above_rounding(), None).select()
        found = self._fit_changes(result, evidence, result.first.typical_spread)
        untested = _ONE_EACH if found.steps and first == second + third == 1 else ''
        return replace(found, floor=OWN_MISFIT, misfit=misfit, untested=untested)

    def _fit_changes(self, result: Selection, evidence: Evidence, spread: float) -> Explanation:
        """Fit the values of the accepted causes, as changes of the given model."""
        nuisance = replace(result.nuisance, accepted=())
        fitted = tuple(range(nuisance.rows.n_baseline + count_recordings(self.prepared.data)))
        hyperparameters = result.posterior.hyperparameters
        problem = JointFit(
            self.arm, nuisance, hyperparameters, fitted, patches_body=False, spread=spread
        )
        return explain(problem, evidence, result, self.settings)

    def comparison(
        self,
        rows: Rows,
        grid: Sequence[Hyperparameters] | None,
        known: FloatArray | None = None,
        gravity: FloatArray | None = None,
    ) -> CauseComparison:
        """
        Set up the selection of causes: nuisance parameters, candidates and hyperparameters.

        Parameters
        ----------
        rows : Rows
            The recordings.
        grid : sequence of Hyperparameters or None
            Hyperparameters to average over; None to fit them to the baseline.
        known : ndarray, shape (P, P), optional
            Fisher information on the parameters of the arm from its identification.
        gravity : ndarray, shape (3,), optional
            Gravity for the columns of the rigid body; see `Nuisance.of`.

        """
        arm, settings = self.arm, self.settings
        fuller, unknown = with_friction(arm, settings.library)
        nuisance = Nuisance.of(rows, memoized_arm(fuller), self.rng, known, gravity=gravity)
        changed = self.baseline is not None or self.misfit is not None
        reference = self._reference()
        measured = {kind.name for kind in settings.kinds if kind.lasting and reference is not None}
        kinds = [
            kind
            for kind in settings.kinds
            if kind.name in measured or not (kind.lasting or kind.traits.measured_as in measured)
        ]
        if changed:
            kinds = [kind.as_change() for kind in kinds]
        fitted = () if changed else ((effect.name, effect.joints) for effect in unknown)
        named = frozenset(fitted)
        catalogue = Causes(tuple(kinds), nuisance, changed, named, settings.prior, reference or {})
        used = hyperparameters_of_baseline(nuisance) if grid is None else tuple(grid)
        return CauseComparison(nuisance, catalogue, settings, used)

    def _reference(self) -> dict[str, float] | None:
        """Return the reference temperature of each joint [degC]; None if none was measured."""
        today = [part.motion for part in (*self.prepared.data, *self.held_out)]
        before = [part.motion for part in self.baseline.data] if self.baseline else today
        if mean_temperatures([*before, *today]) is None:
            return None
        given = (one.reference_temperatures for one in self.arm.effects if one.lasting)
        return next(given, None) or mean_temperatures(before)


def _speed(data: Sequence[Trajectory]) -> FloatArray:
    """Return the root mean square velocity of each joint, (n,) [rad/s or m/s]."""
    squares = np.concatenate([part.at_rows.dq**2 for part in data])
    return np.asarray(np.sqrt(squares.mean(axis=0)))


def _noise_within(
    misfit: FloatArray, prepared: Prepared, contained: FloatArray
) -> tuple[FloatArray, ...]:
    """
    Return the torque noise (n,) of each trajectory, at most the known residual [N m].

    An event in one of two periods increases their difference, but it belongs to the gap. The
    squared noise is at most the squared misfit plus the increase of row-to-row noise.

    """
    more = [np.maximum(floor.rough**2 - contained**2, 0.0) for floor in prepared.floors]
    return tuple(
        np.minimum(sigma, np.sqrt(misfit**2 + excess))
        for sigma, excess in zip(prepared.sigma, more, strict=True)
    )
