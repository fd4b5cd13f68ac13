# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Diagnosis of an arm tied to another moving machine: first the ties (springs), then other causes.

The segments that may be tied are known. All ties are identified together, with a model of the
noise of angles, as by ``armid exo``. Least squares would underestimate their stiffness, and a
single tie resembles other ties and half of the catalogue. Other causes are searched in the
remaining residual.

"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.evidence import Evidence, noise_floor
from armid_ros.diagnosis.data.rows import Rows
from armid_ros.diagnosis.search.cause import NamedEffect
from armid_ros.diagnosis.search.comparison import CauseComparison, grid_without_baseline
from armid_ros.diagnosis.search.explainer import Explainer
from armid_ros.diagnosis.search.explanation import explain, Explanation, has_no_gap, survey
from armid_ros.diagnosis.search.joint_fit import Fitted, JointFit, parameter_ranges, patched_arm
from armid_ros.diagnosis.search.ranking import CauseResult
from armid_ros.effects.tied import Partner, Tied, TiedInteraction, TiedSlack
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate
from armid_ros.identification.ties.problem import Inertias, InteractionProblem
from armid_ros.identification.ties.recorded import stacked, together_interaction_problem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction, MIN_Z_SCORE
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
import numpy as np

#: Smallest reduction of chi-squared for a significant slack: z > 5.
_MIN_SLACK_GAIN = 25.0
#: Reduction of chi-squared per fitted inertia above which the description is rejected. The
#: expected reduction is one, or two if filters correlate neighbouring rows.
_MAX_GAIN_PER_INERTIA = 5.0


def diagnose_ties(
    explainer: Explainer, recordings: Sequence[Recording], partner: Partner
) -> Explanation | None:
    """
    Explain a residual by springs (ties) to another machine first, then by other causes.

    Returns
    -------
    Explanation or None
        The explanation with the ties as its first causes; without causes if the residual is noise;
        None if there is a gap and no tie.

    """
    arm, prepared, settings = explainer.arm, explainer.prepared, explainer.settings
    explainer = replace(explainer, baseline=None, misfit=None)
    ties = _Ties(explainer, tuple(recordings))
    evidence = Evidence.over_noise(prepared.data, prepared.sigma)
    named = ties.significant(partner)
    if not named:
        problem = JointFit.over_noise(arm, evidence, explainer.rng).as_described()
        described = problem.fit()
        found = Explanation(arm, described, described, (), evidence, problem)
        return found if has_no_gap(found, settings) else None
    for _ in range(2):  # the noise of spring angles is estimated only with fitted ties
        problem = JointFit.over_noise(arm, evidence, explainer.rng)
        fitted = problem.fit(named)
        sigma = [noise_floor(part, fitted.arm).sigma for part in prepared.data]
        evidence = Evidence.over_noise(prepared.data, sigma)
    rows, free = Rows.over_noise(evidence), [one for one in grid_without_baseline() if one.body]
    comparison = explainer.comparison(rows, free)
    candidates, invisible = _as_one_cause(comparison, partner, fitted)
    steps = candidates[:1] * len(named)
    found = Explanation(arm, fitted, problem.fit(), steps, evidence, problem)
    if not has_no_gap(found, replace(settings, material=0.0)):
        rest = replace(explainer, arm=memoized_arm(fitted.arm))
        result = rest.comparison(rows, free).select()
        found = explain(problem, evidence, result, settings, known=(fitted, steps))
    found = replace(found, candidates=candidates, invisible=invisible)
    return ties.without_bias(found)


@dataclass(frozen=True)
class _Ties:
    """
    Regression of residual torques on springs (ties) between an arm and another machine.

    Attributes
    ----------
    explainer : Explainer
        The arm without ties, and its data.
    recordings : tuple of Recording
        Recordings of the arm, with the motion of the other machine.

    """

    explainer: Explainer
    recordings: tuple[Recording, ...]

    def significant(self, partner: Partner) -> list[NamedEffect]:
        """Return significant ties with their stiffness; ties with slack are returned as straps."""
        arm = self.explainer.arm
        tried: list[tuple[float, InteractionProblem, Interaction]] = []
        for slack in (0.0, *TiedSlack.shapes[0].grid):
            try:
                problem = self._problem(arm, 'free', slack)
                tried.append((slack, problem, identify_interaction(problem)))
            except IdentificationError:
                continue
        if not tried:
            return []
        best = min(tried, key=lambda one: one[2].misfit)
        noise = max(1.0, best[2].misfit / best[1].tau.size)
        if tried[0][2].misfit - best[2].misfit < _MIN_SLACK_GAIN * noise:
            best = tried[0]
        slack, problem, found = best
        while len(found.segments) and not np.min(found.stiffness / found.std) >= MIN_Z_SCORE:
            weakest = int(np.argmin(found.stiffness / found.std))
            problem = problem.with_springs(np.delete(np.arange(len(found.segments)), weakest))
            if not problem.segments:
                return []
            found = identify_interaction(problem)
        named = list[NamedEffect]()
        for joint, stiffness in zip(problem.spring_joints, found.stiffness, strict=True):
            effect = partner.tied(arm.robot, (joint,), slack=bool(slack))
            effect = effect.with_shape([slack]) if slack else effect
            values = stiffness * np.eye(len(effect.parameters(arm.robot)))[0]
            named.append(NamedEffect(effect, (0,), values))
        return named

    def without_bias(self, found: Explanation) -> Explanation:
        """
        Return the explanation with tie stiffnesses corrected for the bias by angle noise.

        The described links are kept if they explain the torques as well as fitted links.

        """
        named = [own.effect for own in found.fitted.named]
        ties = [effect for effect in named if isinstance(effect, Tied)]
        if not all(isinstance(tie, TiedInteraction) for tie in ties):
            return found
        whole = found.fitted.arm
        stiffness = [(p.name, p.joint) for tie in ties for p in tie.parameters(whole.robot)[:1]]
        free = [(p.name, p.joint) not in stiffness for p in whole.parameters]
        bare = whole.with_theta(whole.theta * free)
        joints = {tie.joints[0] for tie in ties}
        inertias: list[Inertias] = ['known', 'free']
        fits = dict[Inertias, Interaction]()
        for which in inertias:
            with suppress(IdentificationError):
                problem = self._problem(bare, which)
                kept = [k for k, joint in enumerate(problem.spring_joints) if joint in joints]
                fits[which] = identify_interaction(problem.with_springs(np.array(kept)))
        if 'free' not in fits:
            return found
        known, springs = fits.get('known'), fits['free']
        count = len(springs.estimate.values) - len(springs.segments)
        limit = _MAX_GAIN_PER_INERTIA * count * max(1.0, springs.misfit / springs.residual.size)
        if known is not None and known.misfit - springs.misfit < limit:
            assert found.problem is not None
            springs, described = known, found.problem.as_described()
            again = described.fit(found.fitted.named)
            found = replace(found, fitted=again, reference=described.fit(), problem=described)
        return replace(found, fitted=_with_springs(found, springs))

    def _problem(
        self, bare: ArmModel, inertias: Inertias, slack: float = 0.0
    ) -> InteractionProblem:
        """Return the regression of torques on all ties, after other effects are subtracted."""

        def rest(motion: Motion) -> FloatArray:
            return np.asarray(bare.torque(motion) - inverse_dynamics(bare.robot, motion))

        problem = stacked(
            [
                together_interaction_problem(
                    self.explainer.arm.robot,
                    recording,
                    self.explainer.prepared.used,
                    inertias=inertias,
                    separate=True,
                    slack=slack,
                    rest=rest,
                )
                for recording in self.recordings
            ]
        )
        given = self.explainer.arm.effects
        there = {joint for own in given if isinstance(own, Tied) for joint in own.joints}
        own = [k for k, joint in enumerate(problem.spring_joints) if joint not in there]
        return problem.with_springs(np.array(own, dtype=np.intp))


def _with_springs(explanation: Explanation, found: Interaction) -> Fitted:
    """
    Replace the stiffness of the ties in a fitted arm, and refit its base parameters.

    If other effects were fitted jointly, the standard deviations of the stiffness are the larger
    ones of both fits.

    """
    fitted, problem = explanation.fitted, explanation.problem
    assert problem is not None
    listed = [(name.name, name.joint) for name in fitted.estimate.parameters]
    springs = found.estimate.parameters[: len(found.segments)]
    where = [listed.index((name.name, name.joint)) for name in springs]
    values, covariance = fitted.estimate.values.copy(), fitted.estimate.covariance
    values[where] = found.stiffness
    wider = np.ones(len(values))
    wider[where] = found.std / np.sqrt(np.diag(covariance)[where])
    if any(not isinstance(name.effect, Tied) for name in fitted.named):
        wider = np.maximum(wider, 1.0)
    named = list[NamedEffect]()
    for own, place in zip(fitted.named, parameter_ranges(fitted.named), strict=True):
        replaced = own.values.copy()
        replaced[list(own.kept)] = values[list(place[0])]
        named.append(replace(own, values=replaced))
    nuisance = problem.with_model(patched_arm(problem.arm, named))
    means = nuisance.means(nuisance.posterior(problem.hyperparameters, problem.recordings))
    return replace(
        fitted,
        arm=problem.arm_at(named, means),
        named=tuple(named),
        estimate=Estimate(fitted.estimate.parameters, values, covariance * np.outer(wider, wider)),
    )


def _as_one_cause(
    comparison: CauseComparison, partner: Partner, fitted: Fitted
) -> tuple[tuple[CauseResult, ...], tuple[tuple[str, tuple[str, ...]], ...]]:
    """Test all springs to another machine as a single cause; return results as `survey` does."""
    nuisance, settings, result = comparison.nuisance, comparison.settings, comparison.initial()
    ties = [own.effect for own in fitted.named]
    loose = any(tie.shapes for tie in ties)
    whole = partner.tied(nuisance.arm.robot, [tie.joints[0] for tie in ties], slack=loose)
    if loose:
        whole = whole.with_shape([tie.shape for tie in ties])
    each = len(whole.quantities)
    kept = tuple(range(0, each * len(whole.joints), each))
    columns = [part.columns(nuisance.arm, whole)[:, :, list(kept)] for part in nuisance.rows.data]
    cause = comparison.catalogue.candidate(whole, kept, columns)
    assert cause is not None
    one = comparison.rank(cause, nuisance)
    ranking, material = result.first, settings.material
    better = [x for x in ranking.ranked if x.log_bayes_factor >= one.log_bayes_factor]
    rivals = [ranking.tested(other, material) for other in better]
    candidates, invisible = survey(result, settings)
    trial = replace(ranking.tested(one, material), probability=1.0 / (1.0 + len(rivals)))
    return (replace(trial, rivals=tuple(rivals)), *candidates), invisible
