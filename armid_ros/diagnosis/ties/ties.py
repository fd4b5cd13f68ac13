# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What an arm lacks that is tied to another moving machine: the ties first, then other causes.

The places of possible ties are known, so all ties are fitted at once, jointly with the nuisance
parameters: one by one they imitate each other and half of the catalogue. Significant ties stay,
and only the residual that they leave is searched for other causes.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.days import Rows
from armid_ros.diagnosis.data.evidence import Evidence, noise_floor
from armid_ros.diagnosis.prepare import Prepared
from armid_ros.diagnosis.search.candidates import cause_of, value_unit
from armid_ros.diagnosis.search.cause import SelectedEffect
from armid_ros.diagnosis.search.choice import Explainer, Progress
from armid_ros.diagnosis.search.comparison import settings_alone
from armid_ros.diagnosis.search.explain import explain, Name, survey_of
from armid_ros.diagnosis.search.explanation import Chosen, Explanation, NOISE
from armid_ros.diagnosis.search.odds import CauseInformation
from armid_ros.diagnosis.search.posterior import Fitted, JointFit
from armid_ros.diagnosis.search.trial import Step, Survey
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.ties.regression import rightly_described, TieRegression, without_bias
from armid_ros.effects.tied import Partner, Tied, TiedInteraction, TiedSlack
from armid_ros.identification.ties.stiffness import LEAST_Z
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
from scipy import optimize

#: Reduction of squares over noise that slack has to bring: z > 5.
_LEAST_GAIN = 25.0
#: Evaluations of a common slack around the best one of its grid.
_EVALUATIONS = 10
#: Ratio of losses up to which an explanation with masses as described is as good as with fitted
#: ones.
_ALIKE = 1.05


@dataclass(frozen=True)
class Ties:
    """
    Ties of an arm to another moving machine, fitted to data.

    Attributes
    ----------
    arm : ArmModel
        The arm without ties.
    partner : Partner
        Where there may be ties.
    evidence : Evidence
        The data, and their noise.
    rng : numpy.random.Generator
        Draws the states from which base parameters are found.
    settings : DiagnosisSettings
        Thresholds.
    sure : callable
        Returns the joints whose ties are significant with a slack [m], whatever least squares
        say.

    """

    arm: ArmModel
    partner: Partner
    evidence: Evidence
    rng: np.random.Generator
    settings: DiagnosisSettings
    sure: Callable[[float], frozenset[str]]

    @cached_property
    def problem(self) -> JointFit:
        """Return what values are fitted in: body, friction and ties, beside noise alone."""
        return JointFit.over_noise(self.arm, self.evidence, self.rng)

    def find(self) -> tuple[Ties, Fitted]:
        """
        Fit all ties, and keep the significant ones, with slack and damping if significant.

        Returns
        -------
        ties : Ties
            With the noise in the residual of the tied arm, which includes the effect of noisy
            angles on springs.
        fitted : Fitted
            The arm with these ties; nothing is named if there are none.

        """
        joints = self._joints()
        first = self._surely(joints)
        sigma = tuple(noise_floor(part, first.arm).sigma for part in self.evidence.data)
        ties = replace(self, evidence=Evidence.over_noise(self.evidence.data, sigma))
        return ties, ties._damped(ties._surely(joints))

    def _joints(self) -> list[str]:
        """Return the joints with a possible tie that the arm does not have already."""
        names = TiedInteraction.name, TiedSlack.name
        tied = [joint for own in self.arm.effects if own.name in names for joint in own.joints]
        return [tie.joint for tie in self.partner.ties if tie.joint not in tied]

    def _surely(self, joints: Sequence[str]) -> Fitted:
        """Return the arm with its significant ties, with slack where that is significant."""
        if not joints:
            return self.fitted(())
        taut = self.surely([self._plain(joint) for joint in joints])
        kept = list(joints)
        slack, values, z = self._common_slack(kept)
        sure = self.sure(slack)
        while True:
            weak = [(z[k], k) for k, joint in enumerate(kept) if z[k] < LEAST_Z]
            weak = [(value, k) for value, k in weak if kept[k] not in sure]
            if not weak:
                break
            kept.pop(min(weak)[1])
            if not kept:
                return taut
            slack, values, z = self._common_slack(kept)
        loose = [self._loose(joint, slack) for joint in kept]
        found = self.fitted(loose, self._start(loose, values))
        certain = _certainty(found, last=True)
        named = [
            own if z >= LEAST_Z or joint in sure else self._plain(joint)
            for own, z, joint in zip(found.named, certain, kept, strict=True)
        ]
        if named != list(found.named):
            found = self.fitted(named)
        noise = max(1.0, float(np.max(self.chi2_per_row(found))))
        gain = self._squares(taut) - self._squares(found)
        return found if gain > _LEAST_GAIN * noise else taut

    def fitted(self, named: Sequence[SelectedEffect], start: Sequence[FloatArray] = ()) -> Fitted:
        """Fit the arm with named effects, from start values; zero by default."""
        zeros = [np.zeros(len(one.effect.parameters(self.arm.robot))) for one in named]
        return self.problem.fit(named, start or zeros)

    def chi2_per_row(self, fitted: Fitted) -> FloatArray:
        """Return the loss of each joint, shape (n,)."""
        return self.evidence.chi2_per_row(self.evidence.residuals(fitted.arm))

    def surely(self, named: Sequence[SelectedEffect]) -> Fitted:
        """Fit, and remove ties, the weakest first, until all are significant."""
        kept, sure = list(named), self.sure(0.0)
        while True:
            fitted = self.fitted(kept)
            weak = [
                (z, k)
                for k, (own, z) in enumerate(zip(fitted.named, _certainty(fitted), strict=True))
                if isinstance(own.effect, Tied)
                and not z >= LEAST_Z
                and own.effect.joints[0] not in sure
            ]
            if not weak:
                return fitted
            gone = min(weak)[1]
            kept = [own for k, own in enumerate(fitted.named) if k != gone]

    def _plain(self, joint: str, kept: tuple[int, ...] = (0,)) -> SelectedEffect:
        return SelectedEffect(self.partner.interaction.on(self.arm.robot, (joint,)), kept)

    def _loose(self, joint: str, slack: float) -> SelectedEffect:
        strap = self.partner.slack.on(self.arm.robot, (joint,))
        return SelectedEffect(strap.with_shape([slack]), (0,))

    def _start(self, named: Sequence[SelectedEffect], stiffness: FloatArray) -> list[FloatArray]:
        sizes = [len(own.effect.parameters(self.arm.robot)) for own in named]
        rows = zip(stiffness, sizes, strict=True)
        return [np.array([max(k, 0.0), *np.zeros(size - 1)]) for k, size in rows]

    def _common_slack(self, joints: Sequence[str]) -> tuple[float, FloatArray, FloatArray]:
        """Return the common slack of all straps that explains most; stiffnesses, and their z."""
        nuisance = self.problem.nuisance
        under = nuisance.marginal(self.problem.setting)

        def solved(slack: float) -> tuple[float, FloatArray, FloatArray]:
            straps = self.partner.slack.on(self.arm.robot, tuple(joints)).with_shape([slack])
            columns = [part.columns(nuisance.arm, straps) for part in nuisance.rows.data]
            own = SelectedEffect(straps, tuple(range(columns[0].shape[2])))
            unit = value_unit(nuisance, own, columns)
            cause = cause_of(nuisance, own, columns, unit)
            known = CauseInformation.of(cause, nuisance, under, by_day=True)
            inverse = np.linalg.pinv(known.matrix, hermitian=True)
            values = inverse @ known.vector
            z = values / np.sqrt(np.maximum(np.diag(inverse), 1e-300))
            return float(values @ known.vector), values * unit, z

        tried = [0.0, *TiedSlack.shapes[0].grid]
        best = int(np.argmax([solved(slack)[0] for slack in tried]))
        low, high = tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)]
        slack = float(
            optimize.minimize_scalar(
                lambda slack: -solved(slack)[0],
                bounds=(low, high),
                method='bounded',
                options={'maxiter': _EVALUATIONS},
            ).x
        )
        return slack, *solved(slack)[1:]

    def _damped(self, fitted: Fitted) -> Fitted:
        """Return springs, with dampers where a gap is left and they are significant."""
        residual = self.evidence.residuals(fitted.arm)
        limits = self.evidence.limits(residual, self.settings)
        if np.all(self.evidence.chi2_per_row(residual) < limits):
            return fitted
        springs = [isinstance(own.effect, TiedInteraction) for own in fitted.named]
        both = [
            replace(own, kept=(0, 1)) if spring else own
            for own, spring in zip(fitted.named, springs, strict=True)
        ]
        sure = [z >= LEAST_Z for z in _certainty(self.fitted(both), last=True)]
        named = [
            more if spring and there else own
            for own, more, spring, there in zip(fitted.named, both, springs, sure, strict=True)
        ]
        return self.fitted(named) if named != list(fitted.named) else fitted

    def _squares(self, fitted: Fitted) -> float:
        return float(self.chi2_per_row(fitted) @ self.evidence.count)


def _certainty(fitted: Fitted, *, last: bool = False) -> list[float]:
    """Return the z of the first or the last value of each name; zero where it is not known."""
    if not fitted.named:
        return []
    ends = [shapes.stop - 1 if last else values.start for values, shapes in fitted.places]
    values, std = fitted.estimate.values, fitted.estimate.std
    return [float(values[k] / std[k]) if 0.0 < std[k] < np.inf else 0.0 for k in ends]


def diagnose_ties(
    arm: ArmModel,
    recordings: Sequence[Recording],
    prepared: Prepared,
    settings: DiagnosisSettings,
    rng: np.random.Generator,
    tell: Progress,
) -> Chosen | None:
    """
    Explain a gap by ties to another machine, and by causes of the residual that they leave.

    Returns
    -------
    Chosen or None
        With the ties as its first names, or the given arm if it leaves no more than noise; None if
        there is no tie, and still a gap.

    """
    assert settings.partner is not None
    nothing = np.zeros(arm.robot.n_joints)
    regression = TieRegression(arm, tuple(recordings), prepared.used, settings)
    sure = cache(regression.sure)
    evidence = Evidence.over_noise(prepared.data, prepared.sigma)
    start = Ties(arm, settings.partner, evidence, rng, settings, sure)
    ties, fitted = start.find()
    if not fitted.named:
        return _within_its_noise(start, prepared)
    reference = ties.fitted(())
    explainer = Explainer(arm, prepared, None, rng, tell, settings)
    step, survey = _as_one_cause(ties, explainer, fitted)
    steps = (step,) * len(fitted.named)
    found = Explanation(
        ties.arm,
        fitted,
        reference,
        steps,
        survey,
        ties.evidence,
        problem=ties.problem,
        refitted=True,
    )
    if _open(found, settings):
        rest = replace(explainer, arm=memoized_arm(fitted.arm))
        free = [one for one in settings_alone() if one.free]
        result = rest.comparison(Rows.over_noise(found.evidence), free).found()
        rows = zip(fitted.named, fitted.values, strict=True)
        known = [Name(named, step, values) for named, values in rows]
        more = explain(ties.problem, found.evidence, result, settings, known=known)
        fitted = ties.surely(more.fitted.named)
        if not any(isinstance(own.effect, Tied) for own in fitted.named):
            return None
        found = _with_names_of(replace(more, survey=found.survey), fitted)
    springs = regression.springs(found, 'free')
    if rightly_described(regression.springs(found, 'known'), springs):
        found = _as_described(found, settings)
        if not found.refitted:
            springs = regression.springs(found, 'known')
    return Chosen(without_bias(found, springs), nothing, NOISE)


def _within_its_noise(ties: Ties, prepared: Prepared) -> Chosen | None:
    """
    Return the arm as described, if it leaves no more than the noise of its own residual.

    A fit reduces inertias to get rid of the noise of accelerations; compared with the smaller
    noise in the residual of the fitted arm, the described one would seem to be wrong.

    """
    arm = replace(ties, evidence=prepared.described).problem.as_described()
    described = arm.fit()
    found = Explanation(ties.arm, described, described, (), None, prepared.described, problem=arm)
    if _open(found, ties.settings):
        return None
    return Chosen(found, np.zeros(ties.arm.robot.n_joints), NOISE)


def _open(found: Explanation, settings: DiagnosisSettings) -> bool:
    limits = found.evidence.limits(found.residual, replace(settings, material=0.0))
    return bool(np.any(found.chi2_per_row > np.maximum(limits, settings.thresholds.same_fit)))


def _as_described(found: Explanation, settings: DiagnosisSettings) -> Explanation:
    """Return the same names in the arm as described, where that explains as much."""
    assert found.problem is not None
    problem, own = found.problem.as_described(), found.fitted
    described = replace(
        found,
        fitted=problem.fit(own.named, own.values),
        reference=problem.fit(),
        problem=problem,
        refitted=False,
    )
    limits = found.evidence.limits(described.residual, settings)
    if np.any(described.chi2_per_row > np.maximum(limits, _ALIKE * found.chi2_per_row)):
        return found
    return described


def _as_one_cause(ties: Ties, explainer: Explainer, fitted: Fitted) -> tuple[Step, Survey]:
    """Compare all ties as one cause with the library; return how they are named, and the rest."""
    settings, robot = ties.settings, ties.arm.robot
    free = [one for one in settings_alone() if one.free]
    comparison = explainer.comparison(Rows.over_noise(ties.evidence), free)
    result = comparison.first()
    loose = any(own.effect.shapes for own in fitted.named)
    kind = ties.partner.slack if loose else ties.partner.interaction
    whole = kind.on(robot, [own.effect.joints[0] for own in fitted.named])
    if loose:
        whole = whole.with_shape([own.effect.shape for own in fitted.named])
    each = len(whole.quantities)
    kept = tuple(range(0, each * len(whole.joints), each))
    arm, nuisance = memoized_arm(ties.arm), comparison.nuisance
    columns = [part.columns(arm, whole)[:, :, list(kept)] for part in nuisance.rows.data]
    cause = comparison.catalogue.made(whole, kept, columns)
    assert cause is not None
    one = comparison.ranked(cause, nuisance)
    look, material = result.first, settings.material
    rivals = [look.worth(other, material) for other in look.ranking if other.data >= one.data]
    survey = survey_of(result, (), settings)
    trial = replace(look.worth(one, material), probability=1.0 / (1.0 + len(rivals)))
    survey = replace(survey, ranking=(trial, *survey.ranking))
    return Step(trial, tuple(rivals)), survey


def _with_names_of(found: Explanation, fitted: Fitted) -> Explanation:
    """Return an explanation with only the names that a last fit kept."""
    kept = {(own.effect.name, own.effect.joints) for own in fitted.named}
    pairs = zip(found.fitted.named, found.steps, strict=True)
    steps = tuple(s for own, s in pairs if (own.effect.name, own.effect.joints) in kept)
    return replace(found, fitted=fitted, steps=steps)
