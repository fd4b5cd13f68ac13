# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Checks whether the named effects explain the residual, up to noise and misfit.

The limit of the residual is larger in held-out motions, as the misfit varies between motions. At
rest and in a reversal, dry friction can have any torque up to its limit, so these rows are checked
separately: a residual beyond friction comes from a stop, a brake, or a contact.

The cause may be no effect of the catalogue, but a new torque of one joint as a function of its
velocity or position, equal in all diagnosed recordings. Such an unlisted law is a model
discrepancy of several times the usual size. It is found if the log odds of the larger size reach
the alarm odds; named causes, rigid body and usual discrepancy are fitted as well.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.discrepancy import hat_functions
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import REST_TIME
from armid_ros.diagnosis.search.candidates import cause_of
from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.explanation import ESTIMATED, Explanation
from armid_ros.diagnosis.search.joint_fit import JointFit
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.settings import DiagnosisSettings, Thresholds, UNLISTED
from armid_ros.diagnosis.verdict.where import Excess, Where
from armid_ros.effects import Effect, Quantity
from armid_ros.effects.base import Arm
from armid_ros.motion import FloatArray, Motion
import numpy as np
from scipy.ndimage import uniform_filter1d

#: Largest residual at rest, divided by dry friction in motion: two of breakaway friction, and one
#: of the model's friction, whose direction is arbitrary at rest.
_MAX_REST_OVER_FRICTION = 3.0
#: Signature of a blocked joint.
_WHERE = 'torque beyond friction at rest or in a reversal: a stop, a brake or a contact'
#: Prior standard deviations of an unlisted law over the misfit of the joint. Of 40 arms with a
#: right name or without a change, one has log odds above 3 (6.4, of a smaller torque).
_LAW_SIZES = 3.0, 10.0
#: Knots of velocities in each direction, as shares of the top speed.
_SPEED_KNOTS = np.array([0.03, 0.1, 0.25, 0.5, 0.75, 1.0])


@dataclass(frozen=True)
class RemainingMisfit:
    """
    Data for the check whether the named effects explain the whole residual.

    Attributes
    ----------
    explanation : Explanation
        The named causes.
    data : tuple of Evidence
        The fitted recordings, then held-out recordings if there are any.
    before : Baseline or None
        Recordings from a time at which the model was right.
    given : ArmModel
        The given model.
    settings : DiagnosisSettings
        Thresholds.

    """

    explanation: Explanation
    data: tuple[Evidence, ...]
    before: Baseline | None
    given: ArmModel
    settings: DiagnosisSettings

    def residual_over_limit(self) -> list[Excess]:
        """
        Return the patched model's squared residual divided by its limit, for each data set.

        If the misfit is known, fitted changes of body, friction and discrepancy are subtracted:
        in other motions the arm visits other states, where the misfit differs.

        """
        explanation, problem = self.explanation, self.explanation.problem
        residuals = [part.residuals(explanation.fitted.arm) for part in self._parts]
        if problem is not None and not explanation.measured:
            own = problem.unexplained_residual(explanation.fitted)
            first = len(explanation.evidence.data)
            residuals = [own[:first], *(own[first:] or one for one in residuals[1:])]
        return list(self._over_limits(residuals))

    def given_body_over_limit(self) -> Excess | None:
        """Return the ratio of residual to limit with the given rigid body; None if no refit."""
        if not self.explanation.refitted:
            return None
        given, fitted = self.given.theta, self.explanation.fitted.arm
        arm = fitted.with_theta(np.concatenate([given, fitted.theta[len(given) :]]))
        return next(self._over_limits([self._parts[0].residuals(arm)]))

    def worse_joints(self) -> tuple[str, ...]:
        """
        Return the joints in which the patched model predicts worse than the given model.

        A joint is worse if its residual, in fitted or held-out data, grows by more than blocks of
        the data differ, and is a gap.

        """
        worse = np.zeros(self.given.robot.n_joints, dtype=bool)
        thresholds = self.settings.thresholds
        for part in self._parts if self.explanation.steps else ():
            residuals = [part.residuals(arm) for arm in (self.given, self.explanation.fitted.arm)]
            had, has = (part.block_squares(rows) for rows in residuals)
            more = has - had
            spread = more.std(axis=0, ddof=1) * np.sqrt(len(more))
            total = more.sum(axis=0)
            floor = np.maximum(had.sum(axis=0), part.count)
            limit = part.misfit_limit(self.settings) + part.material_loss(self.settings)
            significant = (total > thresholds.surely * spread) & (total > 0.05 * floor)
            large = total > (thresholds.same_fit - 1.0) * floor
            worse |= (significant | large) & (part.chi2_per_row(residuals[1]) > limit)
        return tuple(j for j, bad in zip(self.given.robot.joints, worse, strict=True) if bad)

    @property
    def _parts(self) -> list[Evidence]:
        """Return fitted and held-out data, weighted by noise if the misfit is only estimated."""
        if self.explanation.floor != ESTIMATED:
            return list(self.data)
        return [replace(part, sigma=part.noise) for part in self.data]

    def _over_limits(self, residuals: Sequence[Sequence[FloatArray]]) -> Iterator[Excess]:
        """Yield squared residual divided by its limit: for fitted data, then for held-out data."""
        usual = 1.0 if self.explanation.measured else self.settings.thresholds.predicted
        more = usual, self.settings.thresholds.predicted
        where = 'in the recordings', 'in held-out recordings'
        for part, own, factor, words in zip(self._parts, residuals, more, where, strict=False):
            limits = factor * part.limits(own, self.settings)
            yield Excess(part.chi2_per_row(own) / limits, words)

    def at_rest(self) -> list[Excess]:
        """Return squared ratios of residual to friction at rest, for each data set."""
        if self.settings.partner is not None:
            return []
        thresholds, before = self.settings.thresholds, self.before
        arm, usual = self.explanation.fitted.arm, np.ones(self.given.robot.n_joints)
        if before is not None:  # a torque at rest in the baseline, such as that of a brake
            rows = Evidence.over_noise(before.data, (before.misfit,) * len(before.data))
            earlier = blocking_excess(self.given, rows, before.residual, thresholds.surely)
            usual = np.maximum(thresholds.same_fit * earlier, usual)
        surely = thresholds.surely
        ratios = (blocking_excess(arm, x, x.residuals(arm), surely) for x in self.data)
        where = 'at rest or in a reversal, as with a stop, a brake or a contact,'
        return [Excess(ratio / usual, where) for ratio in ratios]


def locate_blocked_joints(arm: ArmModel, excesses: Sequence[Excess]) -> tuple[Where, ...]:
    """Return the joints whose residual at rest exceeds friction, the largest excess first."""
    excess = np.max([np.zeros(arm.robot.n_joints), *(one.ratio for one in excesses)], axis=0)
    beyond = np.where(excess > 1.0, excess, 0.0)
    order = np.argsort(-beyond)[: np.count_nonzero(beyond)]
    whole = float(beyond.sum())
    return tuple(
        Where(arm.robot.joints[j], float(beyond[j]) / whole, _WHERE, (), arm.robot.torque_units[j])
        for j in order.tolist()
    )


def blocking_excess(
    arm: ArmModel, evidence: Evidence, residual: Sequence[FloatArray], surely: float
) -> FloatArray:
    """
    Return each joint's squared ratio of residual to friction at rest and in reversals, (n,).

    `surely` standard deviations of noise and misfit are added to friction, scaled by the predicted
    torque over its rms: the error of a model grows with its torque, which is large in a reversal.
    The residual is averaged over the response time of the position filter, so that its response to
    a jerk cancels. The time is at least `REST_TIME`, as shorter peaks may be random. The ratio is
    zero if the residual is below friction, or if dry friction is unknown.

    """
    friction = arm.action().dry_friction
    joints = arm.robot.n_joints
    if friction is None:
        return np.zeros(joints)
    squares, time = np.zeros((2, joints))
    usual = np.maximum(evidence.torque_rms, 1e-300)
    for part, own, sigma in zip(evidence.data, residual, evidence.sigma, strict=True):
        limit = _MAX_REST_OVER_FRICTION * friction.largest(arm.load(part.at_rows))
        torque_ratio = np.maximum(np.abs(part.torque - own) / usual, 1.0)
        period = float(part.t[1] - part.t[0])
        window = max(REST_TIME, 1.0 / part.used.cutoff_hz)
        mean = uniform_filter1d(own, max(round(window / period), 1), axis=0)
        ratio = (mean / (limit + surely * sigma * torque_ratio)) ** 2
        blocked = ~part.informative & (limit > 0.0) & (ratio > 1.0)
        time += period * blocked.sum(axis=0)
        squares += period * np.sum(ratio, axis=0, where=blocked)
    return np.where(time > REST_TIME, squares / np.maximum(time, 1e-300), 0.0)


@dataclass(frozen=True)
class UnlistedLaw(Effect):
    """Joint torque that is a free function of velocity or position, not in the catalogue."""

    of: str = 'velocity'
    knots: tuple[float, ...] = ()

    name = 'unlisted_law'
    summary = 'law of one joint that the catalogue lacks'
    quantities = (Quantity('knot_torque', 'N m'),)

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return hat functions of velocity or position as regressor columns, (N, n, knots)."""
        link, (joint,) = arm.link_motion(motion), self.indices(motion.joints)
        x = (link.dq if self.of == 'velocity' else link.q)[:, joint]
        columns = np.zeros((len(x), motion.n_joints, len(self.knots)))
        columns[:, joint] = np.column_stack(hat_functions(x, np.array(self.knots)))
        return columns


def unlisted_laws(explanation: Explanation, settings: DiagnosisSettings) -> list[Excess]:
    """
    Test for free functions of velocity and position; return squared torque over its limit.

    The limit is the squared floor of the gap plus that of the largest immaterial torque. The ratio
    is zero in joints whose log odds of an unlisted law are below the alarm odds. If several causes
    were found in a joint, it is at least the ratio of `_one_law_instead`.

    """
    problem, named, evidence = explanation.problem, explanation.fitted, explanation.evidence
    assert problem is not None
    linear = problem.linear(named.named)
    rows, joints = linear.rows, linear.arm.robot.joints
    misfit = rows.amplitude[-1]
    limit = np.mean(np.square(evidence.sigma), axis=0) * (1.0 + evidence.material_loss(settings))
    ratio = {of: np.zeros(len(joints)) for of in ('velocity', 'position')}
    alarm = settings.thresholds.alarm + np.log(len(ratio) * len(joints))
    found = Counter(one.effect.joints for one in (*explanation.steps, *explanation.minor))
    motions = [linear.arm.link_motion(part.at_rows) for part in rows.data]
    q, dq = (np.concatenate([getattr(one, x) for one in motions]) for x in ('q', 'dq'))
    top = np.abs(dq).max(axis=0)
    knots = {
        'velocity': np.outer(top, [*-_SPEED_KNOTS[::-1], *_SPEED_KNOTS]),
        'position': np.linspace(q.min(axis=0), q.max(axis=0), 12, axis=1),
    }
    for joint, of in product(range(len(joints)), ratio):
        law = UnlistedLaw((joints[joint],), of=of, knots=tuple(knots[of][joint]))
        columns = [law.columns(part.at_rows, linear.arm) for part in rows.data]
        unit = np.full(len(law.knots), misfit[joint])
        cause, fits = cause_of(linear, law, (), columns, unit), []
        for size in (1.0, *_LAW_SIZES):
            with_law = linear.and_cause(cause, size)
            posterior = with_law.posterior(problem.hyperparameters, problem.recordings)
            fits.append(posterior.evidence)
        if found[law.joints] > 1:
            ratio[of][joint] = _one_law_instead(problem, linear, cause, settings.thresholds)
        odds = np.logaddexp.reduce(fits[1:]) - np.log(len(_LAW_SIZES)) - fits[0]
        if odds > alarm:
            values = with_law.means(posterior)[with_law.value_slices[-1]]
            torque = np.concatenate([columns[k][:, joint] @ values for k in rows.diagnosed_parts])
            power = np.mean(torque**2) / limit[joint]
            ratio[of][joint] = max(ratio[of][joint], power)
    return [Excess(own, f'that varies with its {of}') for of, own in ratio.items()]


def _one_law_instead(problem: JointFit, linear: Nuisance, law: Cause, levels: Thresholds) -> float:
    """
    Fit a free function instead of a joint's causes; return improvement over its limit.

    The law is fitted in place of these causes. At the limit, it is as likely as the causes, apart
    from the relative error of the laws of the catalogue.

    """
    named = linear.posterior(problem.hyperparameters, problem.recordings)
    pairs = zip(linear.accepted, linear.value_slices, strict=True)
    own = [(one, span) for one, span in pairs if one.joints == law.joints]
    if not own:
        return 0.0
    others = [one for one in linear.accepted if one.joints != law.joints]
    bare = replace(linear, accepted=tuple(others))
    means = linear.means(named)
    made = [np.concatenate(one.columns, axis=1)[0] @ means[span] for one, span in own]
    size = 1.0 + float(np.sqrt(np.mean(np.sum(made, axis=0) ** 2)))
    fits = [
        bare.and_cause(law, new * size).posterior(problem.hyperparameters, problem.recordings)
        for new in _LAW_SIZES
    ]
    best = max(fits, key=lambda fit: fit.evidence)
    explained = bare.posterior(problem.hyperparameters, problem.recordings).loss - named.loss
    gained = named.loss - best.loss
    odds = (
        best.evidence - float(np.log(len(_LAW_SIZES))) - named.evidence + float(np.log(UNLISTED))
    )
    return gained / (max(gained - odds, 0.0) + levels.inexact * max(explained, 1.0))
