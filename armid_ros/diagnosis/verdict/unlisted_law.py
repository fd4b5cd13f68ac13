# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Laws that the catalogue lacks: a new torque of one joint over its velocity or position.

The discrepancy of a model differs between motions by its usual size. A new law on the diagnosed
day is a discrepancy of several times that size, equal in all recordings of the day. The
log odds of the larger size are compared with the alarm odds, while the named causes, the body and
the usual discrepancy are fitted as well. If several causes were found in one joint, a law in place
of them is a simpler explanation, and is compared with the named ones.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

from armid_ros.diagnosis.data.discrepancy import hats
from armid_ros.diagnosis.search.candidates import cause_of
from armid_ros.diagnosis.search.cause import Cause
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.posterior import JointFit
from armid_ros.diagnosis.settings import DiagnosisSettings, Thresholds, UNLISTED
from armid_ros.diagnosis.verdict.where import Excess
from armid_ros.effects import Effect, Quantity
from armid_ros.effects.base import Arm
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Sizes of a new law, as multiples of the joint's misfit, which is the size of the usual
#: discrepancy. Of 40 arms with a right name or without a change, one has log odds above 3 (6.4, of
#: a smaller torque).
_LAW_SIZES = 3.0, 10.0
#: Knots of velocities in each direction, as shares of the top speed.
_SPEED_KNOTS = np.array([0.03, 0.1, 0.25, 0.5, 0.75, 1.0])


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
    Return what a law explains beyond the named causes of its joint, over its limit.

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
