# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The explanation of a gap, given a baseline, a stored misfit, or only the model.

The comparison of causes is the same in the three cases. They differ in the prior knowledge of
discrepancy and noise.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel, Misfit
from armid_ros.arm.memoized_arm import memoized_arm, plain_arm
from armid_ros.arm.misfit import growth
from armid_ros.arm.model_file import add_effect
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.days import Rows
from armid_ros.diagnosis.data.evidence import Evidence, noise_floor, torque_rms
from armid_ros.diagnosis.data.trajectory import count_recordings, Trajectory
from armid_ros.diagnosis.prepare import Prepared, with_friction
from armid_ros.diagnosis.search.candidates import Causes
from armid_ros.diagnosis.search.comparison import (
    CauseComparison,
    Result,
    settings_alone,
    settings_of_baseline,
    settings_of_misfit,
)
from armid_ros.diagnosis.search.explanation import (
    at_floor,
    ESTIMATED,
    explain,
    Explanation,
    OWN_MISFIT,
    WRITTEN_MISFIT,
)
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.posterior import JointFit
from armid_ros.diagnosis.search.setting import Setting
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.identification.rows.temperature import mean_temperatures
from armid_ros.motion import FloatArray
import numpy as np

Progress = Callable[[float, str], None]
#: Smallest share of a misfit that is not noise; the estimate of noise varies by 5 %. Of 20
#: effects that appeared in a running arm, 20 were named, and only 15 with a share of 1.
_MIN_MISFIT_SHARE = 0.3
#: Relative difference of two gravities for which columns of the body are alike.
_SAME_GRAVITY = 0.003
#: Note on a model without covariance of its identification.
_AS_EXACT = (
    'the values of the model are taken as exact because its identification.json is missing: '
    'intervals do not include their errors'
)
#: Advice on recordings that separate a change from a misfit, if there is at most one a day.
_NO_BASELINE = (
    'Without a baseline, an error of the model in this motion is not excluded: give recordings '
    'from before (--baseline).'
)
_ONE_EACH = (
    'With one motion a day, an error of the model in this motion is not excluded: record a second '
    'motion.'
)


@dataclass(frozen=True)
class Explainer:
    """
    Search for the explanation of a gap among the effects of the catalogue.

    Attributes
    ----------
    arm : ArmModel
        The arm.
    prepared : Prepared
        The data.
    baseline : Baseline or None
        Recordings from when nothing was wrong.
    rng : numpy.random.Generator
        Draws the random states from which base parameters are found.
    tell : callable
        Called with the share of the work that is done, and the name of the present step.
    settings : DiagnosisSettings
        Catalogue and thresholds.
    misfit : Misfit or None
        Misfit of the model when it was identified.
    unseen : sequence of Trajectory
        Held-out data of the diagnosed day.

    """

    arm: ArmModel
    prepared: Prepared
    baseline: Baseline | None
    rng: np.random.Generator
    tell: Progress
    settings: DiagnosisSettings
    misfit: Misfit | None = None
    unseen: Sequence[Trajectory] = ()

    def explanation(self) -> Explanation:
        """Explain the gap, by the way that model and baseline permit."""
        if self.baseline is not None:
            return self._since(self.baseline)
        return self._alone() if self.misfit is None else self._explain_change(self.misfit)

    def _alone(self) -> Explanation:
        """Explain the gap of a model that has neither a baseline nor a known misfit."""
        prepared, settings = self.prepared, self.settings
        self.tell(0.2, 'what the model lacks')
        evidence = Evidence.over_noise(prepared.data, prepared.sigma)
        rows = Rows.over_noise(evidence)
        unknown = with_friction(self.arm, settings.library)[1]
        comparison, gravity = self.comparison(rows, settings_alone()), self.arm.robot.gravity
        first = result = comparison.found()
        # Torque is bilinear in gravity and masses. With 2 fits in place of 5, the same number of
        # 20 mountings is within 1 degree and 2 %.
        for _ in range(5):
            before, gravity = gravity, self._gravity(result)
            if np.linalg.norm(gravity - before) <= _SAME_GRAVITY * np.linalg.norm(before):
                break
            grid = [x for x in settings_alone() if x.body == result.under.setting.body]
            comparison = self.comparison(rows, grid, gravity=gravity)
            result = comparison.begun(result)
        if result is not first:
            result = comparison.found(result)
        setting, constant = result.under.setting, list[int]()
        if setting.body:
            accepted = [one.effect for one in result.nuisance.accepted]
            changed = [p for effect in accepted for p in effect.parameters(self.arm.robot)]
            constant = [k for k, p in enumerate(self.arm.parameters) if p in changed]
        nuisance = Nuisance.of(
            rows, memoized_arm(self.arm), self.rng, constant=constant, gravity=gravity
        )
        every = tuple(range(len(rows.today)))
        problem = JointFit(nuisance.arm, nuisance, setting, every, stated=True)
        found = explain(problem, evidence, result, settings, unknown)
        if at_floor(found, settings):
            return found
        misfit = np.sqrt(evidence.power(found.residual))
        sigma = tuple(np.maximum(one, misfit) for one in evidence.sigma)
        evidence = replace(evidence, sigma=sigma)
        return replace(found, evidence=evidence, floor=ESTIMATED, misfit=misfit)

    def _gravity(self, result: Result) -> FloatArray:
        """Return gravity with the accepted causes, in the frame of the base, (3,) [m/s^2]."""
        nuisance, arm = result.nuisance, plain_arm(self.arm)
        means = nuisance.means(result.under)
        for one, span in zip(nuisance.accepted, nuisance.spans, strict=True):
            if not one.effect.joints:
                named = one.at(means[span], arm.robot)
                arm = add_effect(arm, named.effect, named.values)
        return arm.body.gravity

    def _explain_change(self, written: Misfit) -> Explanation:
        """
        Explain the change since an identification if only the size of its misfit is known.

        Without the recordings, its form is unknown: any cause may be a part of it. See `odds`.

        """
        prepared, known = self.prepared, written.information
        misfit = written.of(self.arm.robot, torque_rms(prepared.data))
        noise = _noise_within(misfit, prepared, misfit)
        evidence = Evidence(prepared.data, tuple(np.maximum(s, misfit) for s in noise), noise)
        # a misfit contains noise, which no cause can explain
        rest = misfit**2 - np.mean(np.square(noise), axis=0)
        part = np.maximum(rest, (_MIN_MISFIT_SHARE * misfit) ** 2)
        amplitude = (np.sqrt(part),) * count_recordings(prepared.data)
        rows = Rows(prepared.data, evidence.sigma, 0, amplitude, unseen=True)
        grid = settings_of_misfit(float(known is not None))
        result = self.comparison(rows, grid, known).found()
        found = self._changes(result, evidence, 0.0)
        notes = (_AS_EXACT,) if found.steps and known is None else ()
        return replace(
            found, floor=WRITTEN_MISFIT, misfit=misfit, notes=notes, untested=_NO_BASELINE
        )

    def _since(self, baseline: Baseline) -> Explanation:
        """Explain what changed since the baseline."""
        prepared = self.prepared
        now, then = torque_rms(prepared.data), torque_rms(baseline.data)
        misfit = baseline.misfit * growth(now, then)
        rough = [noise_floor(part, self.arm).rough for part in baseline.data]
        noise = _noise_within(misfit, prepared, np.sqrt(np.mean(np.square(rough), axis=0)))
        sigma = tuple(np.maximum(one, misfit) for one in noise)
        evidence = Evidence(prepared.data, sigma, noise, baseline.varies)
        self.tell(0.2, 'what has changed')
        result = self.comparison(self._of_both_days(baseline, misfit, sigma), None).found()
        found = self._changes(result, evidence, result.first.usual)
        first = count_recordings(baseline.data)
        second = count_recordings(prepared.data) + count_recordings(self.unseen)
        untested = _ONE_EACH if found.steps and first == second == 1 else ''
        notes = (untested,) if untested else ()
        return replace(found, floor=OWN_MISFIT, misfit=misfit, notes=notes, untested=untested)

    def _changes(self, result: Result, evidence: Evidence, spread: float) -> Explanation:
        """Explain a change of the arm, given the model without the change."""
        nuisance = replace(result.nuisance, accepted=())
        fitted = tuple(range(nuisance.rows.before + count_recordings(self.prepared.data)))
        setting = result.under.setting
        problem = JointFit(self.arm, nuisance, setting, fitted, stated=False, spread=spread)
        return explain(problem, evidence, result, self.settings)

    def _of_both_days(
        self, baseline: Baseline, misfit: FloatArray, sigma: Sequence[FloatArray]
    ) -> Rows:
        """
        Return the rows of both days, held-out recordings included.

        The misfit of the model is scaled with the torque or the speed, whichever increased more.

        """
        today, more = self.prepared.data, self.unseen
        faster = growth(_speed([*today, *more]), _speed(baseline.data))
        first, second = count_recordings(baseline.data), count_recordings(today)
        mean = np.sqrt(np.mean(np.square(sigma), axis=0))
        rows = Rows(
            (
                *baseline.data,
                *(replace(part, fold=part.fold + first) for part in today),
                *(replace(part, fold=part.fold + first + second) for part in more),
            ),
            (*(baseline.misfit,) * len(baseline.data), *sigma, *(mean,) * len(more)),
            first,
            (
                *(baseline.misfit,) * first,
                *(np.maximum(misfit, faster * baseline.misfit),)
                * (second + count_recordings(more)),
            ),
        )
        return rows.not_below_rounding()

    def comparison(
        self,
        rows: Rows,
        grid: Sequence[Setting] | None,
        known: FloatArray | None = None,
        gravity: FloatArray | None = None,
    ) -> CauseComparison:
        """
        Return the comparison of all causes.

        Parameters
        ----------
        rows : Rows
            The data.
        grid : sequence of Setting or None
            Amplitudes of discrepancy and noise to compare; None with a baseline.
        known : ndarray, shape (P, P), optional
            Information on the parameters of the arm, added to that of its description.
        gravity : ndarray, shape (3,), optional
            Gravity that acts on errors of the body; see `Nuisance.of`.

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
        used = settings_of_baseline(nuisance) if grid is None else tuple(grid)
        return CauseComparison(nuisance, catalogue, settings, used)

    def _reference(self) -> dict[str, float] | None:
        """Return the reference temperatures; None if temperatures were not measured throughout."""
        today = [part.motion for part in (*self.prepared.data, *self.unseen)]
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
    Return the torque noise of each trajectory, limited by the misfit of each joint, (n,).

    An event in one of two periods increases their difference, but it belongs to the gap. The
    noise is limited to the misfit plus the excess of row-to-row differences over those in it.

    """
    more = [np.maximum(floor.rough**2 - contained**2, 0.0) for floor in prepared.floors]
    return tuple(
        np.minimum(sigma, np.sqrt(misfit**2 + excess))
        for sigma, excess in zip(prepared.sigma, more, strict=True)
    )
