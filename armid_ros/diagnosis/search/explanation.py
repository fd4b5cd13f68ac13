# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Explanation of a residual: the accepted causes that are material, and the arm with them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import plain_arm
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search.cause import NamedEffect
from armid_ros.diagnosis.search.comparison import Selection
from armid_ros.diagnosis.search.joint_fit import Fitted, JointFit
from armid_ros.diagnosis.search.ranking import CauseResult, Key, Ranking
from armid_ros.diagnosis.settings import DiagnosisSettings, HOW_OFTEN, SIZES
from armid_ros.effects import Effect
from armid_ros.motion import FloatArray
import numpy as np

#: Floors of a gap in words: noise, or the misfit: estimated, of a baseline, or of model.yaml.
NOISE, ESTIMATED = 'noise', 'an estimate of the error of such a model'
OWN_MISFIT = 'the error in the recordings from before'
WRITTEN_MISFIT = 'the error of the model when it was identified'


@dataclass(frozen=True)
class Explanation:
    """
    Named causes of a residual, with their fitted values and the noise level.

    Attributes
    ----------
    given : ArmModel
        The arm as given.
    fitted, reference : Fitted
        The arm with all named effects, and without them.
    steps : tuple of CauseResult
        The named causes, in the order of ``fitted``.
    evidence : Evidence
        The recordings, weighted by the floor of the gap.
    problem : JointFit or None
        Least-squares problem of the values; None in a finished diagnosis.
    minor : tuple of CauseResult
        Causes that are significant and not material.
    candidates : tuple of CauseResult
        All visible causes, before any was accepted; the named causes come first.
    invisible : tuple of (str, tuple of str)
        Names and joints of the causes that the nuisance columns can reproduce.
    ranking : Ranking or None
        Ranking of all causes before any was accepted; None in a finished diagnosis.
    floor : str
        Floor of the gap, in words.
    misfit : ndarray, shape (n,), or float
        Misfit that the floor contains; zero if the floor is noise alone [N m].
    untested : str
        Sentence on the recordings that would separate a change from the misfit of another motion.
        If it is not empty, and there is a baseline, named causes have to explain most of the gap.

    """

    given: ArmModel
    fitted: Fitted
    reference: Fitted
    steps: tuple[CauseResult, ...]
    evidence: Evidence
    problem: JointFit | None
    minor: tuple[CauseResult, ...] = ()
    candidates: tuple[CauseResult, ...] = ()
    invisible: tuple[tuple[str, tuple[str, ...]], ...] = ()
    ranking: Ranking | None = None
    floor: str = NOISE
    misfit: FloatArray | float = 0.0
    untested: str = ''

    @property
    def measured(self) -> bool:
        """Whether residuals are compared with noise or an estimate, not with a known residual."""
        return self.floor in (NOISE, ESTIMATED)

    @property
    def refitted(self) -> bool:
        """Whether the rigid body was refitted before the search for causes."""
        problem = self.problem
        return problem is not None and problem.patches_body and problem.hyperparameters.body > 0.0

    def without(self, *names: int) -> Explanation:
        """Move causes, given by index, to the minor causes, and refit all other causes."""
        fewer = self.only([k for k in range(len(self.steps)) if k not in names])
        return replace(fewer, minor=(*self.minor, *(self.steps[k] for k in names)))

    def only(self, keep: Sequence[int]) -> Explanation:
        """Return the explanation with only the given causes, refitted in the given order."""
        assert self.problem is not None
        fitted = self.problem.fit([self.fitted.named[k] for k in keep])
        return replace(self, fitted=fitted, steps=tuple(self.steps[k] for k in keep))

    def without_data(self) -> Explanation:
        """Return the explanation without regression problem, ranking and caches."""
        return replace(
            self,
            given=plain_arm(self.given),
            fitted=replace(self.fitted, arm=plain_arm(self.fitted.arm)),
            reference=replace(self.reference, arm=plain_arm(self.reference.arm)),
            problem=None,
            ranking=None,
        )

    @cached_property
    def residual(self) -> list[FloatArray]:
        """Residual torque of the arm with the named effects, (M, n) per trajectory [N m]."""
        return self.evidence.residuals(self.fitted.arm)

    @property
    def chi2_per_row(self) -> FloatArray:
        """Mean squared weighted residual of each joint with the named effects, shape (n,)."""
        return self.evidence.chi2_per_row(self.residual)


def has_no_gap(explanation: Explanation, settings: DiagnosisSettings) -> bool:
    """Return whether the residual with the named effects is within its limit in each joint."""
    limits = explanation.evidence.limits(explanation.residual, settings)
    return bool(np.all(explanation.chi2_per_row <= limits))


def explain(
    problem: JointFit,
    evidence: Evidence,
    result: Selection,
    settings: DiagnosisSettings,
    unknown: Sequence[Effect] = (),
    known: tuple[Fitted, Sequence[CauseResult]] | None = None,
) -> Explanation:
    """
    Fit the values of the accepted causes, and keep the causes that are material.

    Parameters
    ----------
    problem : JointFit
        Least-squares problem of the values.
    evidence : Evidence
        The recordings, weighted by the floor of the gap.
    result : Selection
        The accepted causes.
    settings : DiagnosisSettings
        Thresholds, and the share of a torque that is material.
    unknown : sequence of Effect
        Friction and offsets without given values, which are named if significant.
    known : (Fitted, sequence of CauseResult), optional
        Causes that were named before, with their values.

    """
    robot, material, alarm = problem.arm.robot, settings.material, settings.thresholds.alarm
    fitted, steps = known or (None, ())
    named = list(fitted.named) if fitted else []
    steps, small = list(steps), list[CauseResult]()
    rows, means = result.nuisance.rows, result.nuisance.means(result.posterior)
    causes = zip(
        result.accepted, result.nuisance.accepted, result.nuisance.value_slices, strict=True
    )
    for trial, cause, span in causes:
        columns = [part.columns(result.nuisance.arm, cause.effect) for part in rows.data]
        made = [x[:, :, list(cause.kept)] @ means[span, np.newaxis] for x in columns]
        if not np.any(rows.rms_of_diagnosed(made)[:, 0] >= material * rows.torque):
            small.append(trial)
            continue
        named.append(cause.at(means[span], robot))
        steps.append(trial)
    unset = list(_unset(result, unknown, settings)) if unknown else []
    likely = [trial for trial in unset if trial.odds > alarm]
    large = {t.effect.name for t in likely if np.any(np.abs(t.values) >= t.least)}
    for trial in likely:  # fit it in all joints, or its torque biases other values
        if trial.effect.name in large:
            named.append(NamedEffect(trial.effect, trial.kept, trial.values))
            steps.append(trial)
        else:
            small.append(trial)
    reference = problem.fit()
    return Explanation(
        problem.arm,
        problem.fit(named) if named else reference,
        reference,
        tuple(steps),
        evidence,
        problem,
        tuple(small),
        *survey(result, settings, unset, [trial.key for trial in steps]),
        result.first,
    )


def _unset(
    result: Selection, unknown: Sequence[Effect], settings: DiagnosisSettings
) -> Iterator[CauseResult]:
    """
    Yield the results of friction and offsets whose values the given model lacks.

    A value has the prior of other effects: a mixture of normal distributions with deviations
    `SIZES`, times the value whose torque is that of the joint; by default, it is 'often' present.
    Its variance is the larger one of posterior and jackknife over recordings.

    """
    nuisance = result.nuisance
    means, covariance = nuisance.moments(result.posterior)
    diagnosed, joints = np.flatnonzero(nuisance.rows.diagnosed).tolist(), nuisance.arm.robot.joints
    residual = nuisance.squares_of_diagnosed(result.posterior)
    names = [(one.name, one.joint) for one in nuisance.base.parameters]
    scatter = np.zeros(len(means))
    if len(diagnosed) > 1:
        hyperparameters = result.posterior.hyperparameters
        others = [[j for j in diagnosed if j != left_out] for left_out in diagnosed]
        fits = [nuisance.means(nuisance.posterior(hyperparameters, used)) for used in others]
        scatter = (len(fits) - 1) * np.var(fits, axis=0)
    for effect in unknown:
        parameter = effect.parameters(nuisance.arm.robot)[0]
        if (parameter.name, parameter.joint) not in names:
            continue
        k = names.index((parameter.name, parameter.joint))
        columns = [nuisance.columns[j][:, :, k] for j in diagnosed]
        square = float(sum(np.sum(x**2) for x in columns))
        count = max(sum(np.count_nonzero(x) for x in columns), 1)
        joint = joints.index(parameter.joint)
        rms = float(nuisance.rows.sigma[-1][joint]) * np.sqrt(square / count)
        variance = max(float(covariance[k, k]), float(scatter[k]))
        unit = nuisance.rows.torque[joint] / max(rms, 1e-12 * nuisance.rows.torque[joint])
        prior = SIZES * unit
        wide = 1.0 + prior**2 / variance
        explained = 0.5 * means[k] ** 2 / variance * (1.0 - 1.0 / wide)
        odds = float(np.logaddexp.reduce(explained - 0.5 * np.log(wide)) - np.log(len(SIZES)))
        odds += HOW_OFTEN[settings.prior.get(effect.name, 'often')]
        resolution = float(np.clip(1.0 - variance * nuisance.prior_precision[k, k], 0.0, 1.0))
        yield CauseResult(
            effect,
            (0,),
            means[k : k + 1],
            np.sqrt([variance]),
            np.array([resolution]),
            np.array([settings.material * unit]),
            np.sqrt(resolution),
            2.0 * odds,
            odds,
            min(means[k] ** 2 * square / max(residual, 1e-300), 1.0),
            len(diagnosed),
        )


def survey(
    result: Selection,
    settings: DiagnosisSettings,
    unset: Sequence[CauseResult] = (),
    named: Collection[Key] = (),
) -> tuple[tuple[CauseResult, ...], tuple[tuple[str, tuple[str, ...]], ...]]:
    """Return test results of all causes that the data can reveal, and names of other causes."""
    ranking, material = result.first, settings.material
    # The likeliest hyperparameters without the accepted causes may hide other causes.
    posterior = ranking.nuisance.posterior(result.posterior.hyperparameters)
    ranking = replace(ranking, posterior=posterior)
    ranked = sorted(ranking.ranked, key=lambda one: one.cause.key not in named)
    every = [
        *(ranking.tested(replace(one, posterior=posterior), material) for one in ranked),
        *(ranking.tested(one, material) for one in ranking.others),
        *unset,
    ]
    seen = tuple(one for one in every if one.visible >= settings.thresholds.least_visible)
    keys = {one.key[:2] for one in seen}
    places = dict.fromkeys((effect.name, effect.joints) for effect in result.effects)
    return seen, tuple(place for place in places if place not in keys)
