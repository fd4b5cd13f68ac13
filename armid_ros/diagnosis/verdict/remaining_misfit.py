# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The posterior predictive check: residual with the named effects over its largest usual value.

The usual value is larger in other motions, as the misfit varies between motions. At rest and in a
reversal, dry friction can have any torque up to its limit, so these rows are checked separately: a
residual beyond friction comes from a stop, a brake, or a contact.

The catalogue may lack a law: a new torque of one joint over its velocity or position, equal in all
recordings of the day. It is a discrepancy of several times the usual size. The log odds of the
larger size are compared with the alarm odds, while the named causes, the body and the usual
discrepancy are fitted as well. If several causes were found in one joint, a law in place of them
is a simpler explanation, and is compared with the named ones.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.discrepancy import hats
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import REST_TIME
from armid_ros.diagnosis.search.candidates import cause_of
from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.explanation import ESTIMATED, Explanation
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.posterior import JointFit
from armid_ros.diagnosis.settings import DiagnosisSettings, Thresholds, UNLISTED
from armid_ros.diagnosis.verdict.where import Excess, Where
from armid_ros.effects import Effect, Quantity
from armid_ros.effects.base import Arm
from armid_ros.motion import FloatArray, Motion
import numpy as np
from scipy.ndimage import uniform_filter1d

#: Largest residual at rest, divided by dry friction in motion. Breakaway friction adds two, and
#: the model's friction, whose direction is arbitrary at rest, adds one.
_MAX_REST_OVER_FRICTION = 3.0
#: Signature of a blocked joint.
_WHERE = 'at rest or turning round, and more than friction: a stop, a brake or a contact'
#: Sizes of a new law, as multiples of the joint's misfit, which is the size of the usual
#: discrepancy. Of 40 arms with a right name or without a change, one has log odds above 3 (6.4, of
#: a smaller torque).
_LAW_SIZES = 3.0, 10.0
#: Knots of velocities in each direction, as shares of the top speed.
_SPEED_KNOTS = np.array([0.03, 0.1, 0.25, 0.5, 0.75, 1.0])


@dataclass(frozen=True)
class RemainingMisfit:
    """
    The remaining misfit of an explanation: excess of the residual over its largest usual value.

    Attributes
    ----------
    explanation : Explanation
        The named causes.
    data : tuple of Evidence
        The fitted recordings, and the held-out ones if there are any.
    before : Baseline or None
        Recordings from when nothing was wrong.
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

    def of_residual(self) -> list[Excess]:
        """
        Return the excess of the residual with the named causes, for each set of data.

        If the model is kept as given, body, friction and discrepancy fitted to both days are
        subtracted: in other motions the arm visits other states, where the misfit differs.

        """
        explanation, problem = self.explanation, self.explanation.problem
        residuals = [part.residuals(explanation.fitted.arm) for part in self._parts]
        if problem is not None and not explanation.measured:
            own = problem.residual_of_day(explanation.fitted)
            first = len(explanation.evidence.data)
            residuals = [own[:first], *(own[first:] or one for one in residuals[1:])]
        return list(self._over_limits(residuals))

    def of_laws(self) -> list[Excess]:
        """Return the excess of laws that the catalogue lacks, if the misfit is known."""
        measured = self.explanation.measured
        return [] if measured else unlisted_laws(self.explanation, self.settings)

    def of_given_body(self) -> Excess | None:
        """Return the excess with the given body; None if the body is not refitted."""
        if not self.explanation.refitted:
            return None
        given, fitted = self.given.theta, self.explanation.fitted.arm
        arm = fitted.with_theta(np.concatenate([given, fitted.theta[len(given) :]]))
        return next(self._over_limits([self._parts[0].residuals(arm)]))

    def worse_joints(self) -> tuple[str, ...]:
        """
        Return the joints in which the patched model is worse than the given one.

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
        """Return fitted and held-out data, in units of noise if the misfit is only estimated."""
        if self.explanation.floor != ESTIMATED:
            return list(self.data)
        return [replace(part, sigma=part.noise) for part in self.data]

    def _over_limits(self, residuals: Sequence[Sequence[FloatArray]]) -> Iterator[Excess]:
        """Yield the excess of residuals of the fitted data, and of the held-out data."""
        usual = 1.0 if self.explanation.measured else self.settings.thresholds.predicted
        more = usual, self.settings.thresholds.predicted
        where = 'in the recordings', 'in recordings that were not used'
        for part, own, factor, words in zip(self._parts, residuals, more, where, strict=False):
            limits = factor * part.limits(own, self.settings)
            yield Excess(part.chi2_per_row(own) / limits, words)

    def at_rest(self) -> list[Excess]:
        """Return the excess of torque over friction in joints at rest, for each set of data."""
        if self.settings.partner is not None:
            return []
        thresholds, before = self.settings.thresholds, self.before
        arm, usual = self.explanation.fitted.arm, np.ones(self.given.robot.n_joints)
        if before is not None:  # an earlier blocking torque, such as that of a brake
            rows = Evidence.over_noise(before.data, (before.misfit,) * len(before.data))
            earlier = blocking_excess(self.given, rows, before.residual, thresholds.surely)
            usual = np.maximum(thresholds.same_fit * earlier, usual)
        surely = thresholds.surely
        ratios = (blocking_excess(arm, x, x.residuals(arm), surely) for x in self.data)
        where = 'where it stands still or turns round'
        more = ' in addition to friction: a stop, a brake or a contact does that'
        return [Excess(ratio / usual, where, more) for ratio in ratios]


def locate_blocked_joints(arm: ArmModel, excesses: Sequence[Excess]) -> tuple[Where, ...]:
    """Return joints with a torque beyond friction at rest, the largest excess first."""
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
    Return the squared ratio of the residual at rest and in reversals to friction, (n,).

    `surely` units of noise and misfit are added to friction, scaled by the predicted torque over
    its rms: the error of a model grows with its torque, which is large in a reversal. The
    residual is averaged over the response time of the position filter, so that its response to a
    jerk cancels. The time is at least `REST_TIME`, as shorter peaks may be random. The ratio is
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
    """Torque of one joint as a function of its velocity or position, linear between knots."""

    of: str = 'velocity'
    knots: tuple[float, ...] = ()

    name = 'unlisted_law'
    summary = 'law of one joint that the catalogue lacks'
    quantities = (Quantity('knot_torque', 'N m'),)

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque per unit knot value, (N, n, number of knots)."""
        link, (joint,) = arm.link_motion(motion), self.indices(motion.joints)
        x = (link.dq if self.of == 'velocity' else link.q)[:, joint]
        columns = np.zeros((len(x), motion.n_joints, len(self.knots)))
        columns[:, joint] = np.column_stack(hats(x, np.array(self.knots)))
        return columns


def unlisted_laws(explanation: Explanation, settings: DiagnosisSettings) -> list[Excess]:
    """
    Return the squared torque of new laws over its limit, for velocity and for position.

    The limit is the squared unit of the gap plus a torque that is not material. The ratio is zero
    in joints whose log odds of a new law are below the alarm odds. If several causes were found
    in a joint, it is at least the ratio of `_instead`.

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
    for law in _laws([linear.arm.link_motion(part.at_rows) for part in rows.data], joints):
        joint = joints.index(law.joints[0])
        columns = [law.columns(part.at_rows, linear.arm) for part in rows.data]
        unit = np.full(len(law.knots), misfit[joint])
        cause, fits = cause_of(linear, law, (), columns, unit), []
        for size in (1.0, *_LAW_SIZES):
            with_law = linear.and_cause(cause, size)
            under = with_law.marginal(problem.setting, problem.recordings)
            fits.append(under.evidence)
        if found[law.joints] > 1:
            ratio[law.of][joint] = _instead(problem, linear, cause, settings.thresholds)
        odds = np.logaddexp.reduce(fits[1:]) - np.log(len(_LAW_SIZES)) - fits[0]
        if odds > alarm:
            values = with_law.means(under)[with_law.spans[-1]]
            torque = np.concatenate([columns[k][:, joint] @ values for k in rows.today_parts])
            power = np.mean(torque**2) / limit[joint]
            ratio[law.of][joint] = max(ratio[law.of][joint], power)
    return [Excess(own, f'that varies with its {of}') for of, own in ratio.items()]


def _instead(problem: JointFit, linear: Nuisance, law: Cause, levels: Thresholds) -> float:
    """
    Return what a law explains in addition to the named causes of its joint, over its limit.

    The law is fitted in place of these causes. At the limit it is as likely as they are, apart
    from the relative error of the laws of the catalogue.

    """
    named = linear.marginal(problem.setting, problem.recordings)
    pairs = zip(linear.accepted, linear.spans, strict=True)
    own = [(one, span) for one, span in pairs if one.joints == law.joints]
    if not own:
        return 0.0
    others = [one for one in linear.accepted if one.joints != law.joints]
    bare = replace(linear, accepted=tuple(others))
    means = linear.means(named)
    made = [np.concatenate(one.columns, axis=1)[0] @ means[span] for one, span in own]
    size = 1.0 + float(np.sqrt(np.mean(np.sum(made, axis=0) ** 2)))
    fits = [
        bare.and_cause(law, new * size).marginal(problem.setting, problem.recordings)
        for new in _LAW_SIZES
    ]
    best = max(fits, key=lambda fit: fit.evidence)
    explained = bare.marginal(problem.setting, problem.recordings).loss - named.loss
    gained = named.loss - best.loss
    odds = (
        best.evidence - float(np.log(len(_LAW_SIZES))) - named.evidence + float(np.log(UNLISTED))
    )
    return gained / (max(gained - odds, 0.0) + levels.inexact * max(explained, 1.0))


def _laws(motions: list[Motion], joints: tuple[str, ...]) -> Iterator[UnlistedLaw]:
    """Yield the laws of velocity and of position of every joint."""
    q, dq = (np.concatenate([getattr(one, x) for one in motions]) for x in ('q', 'dq'))
    for k, joint in enumerate(joints):
        speeds = float(np.abs(dq[:, k]).max()) * _SPEED_KNOTS
        yield UnlistedLaw((joint,), of='velocity', knots=(*-speeds[::-1], *speeds))
        knots = np.linspace(q[:, k].min(), q[:, k].max(), 12)
        yield UnlistedLaw((joint,), of='position', knots=tuple(knots))
