# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whether an arm is tied to a machine that moved beside it, asked before anything else.

Where the two may be tied is known, so all ties are fitted at once, beside everything that is free:
one by one they imitate each other and half of the catalogue. Those that are surely there stay, and
only what they leave is looked at further.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.floor import noise_floor
from armid_ros.diagnosis.data.rows import make_problem, project
from armid_ros.diagnosis.search.fit import fit, Fitted, Start
from armid_ros.diagnosis.search.patch import Named
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects.tied import Partner, Tied, TiedInteraction, TiedSlack
from armid_ros.identification.ties.search import LEAST_Z
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np
from scipy import optimize

#: Squares over noise that slack has to take: z > 5.
_LEAST_GAIN = 25.0
#: Evaluations of a common slack around the best of those that are tried.
_EVALUATIONS = 10


@dataclass(frozen=True)
class Ties:
    """
    Ties to a machine that moved beside an arm, as they are fitted to data.

    Attributes
    ----------
    arm : ArmModel
        The arm without them.
    partner : Partner
        Where there may be any.
    evidence : Evidence
        The data, and their noise.
    base : BaseParameters or None
        What of the arm is fitted with them; None takes it as described.
    settings : DiagnosisSettings
        Thresholds.
    sure : callable
        Tells joints whose ties are surely there with a slack [m], whatever least squares say.

    """

    arm: ArmModel
    partner: Partner
    evidence: Evidence
    base: BaseParameters | None
    settings: DiagnosisSettings
    sure: Callable[[float], frozenset[str]]

    def find(self) -> tuple[Ties, Fitted]:
        """
        Fit all ties, and keep those that are surely there, with slack and damping if they have.

        Returns
        -------
        ties : Ties
            With the noise beside the arm as it is tied: what noisy angles do to springs is in it.
        fitted : Fitted
            The arm with what was found; with nothing named where there is nothing.

        """
        joints = self._joints()
        first = self._surely(joints)
        sigma = tuple(noise_floor(part, first.arm).sigma for part in self.evidence.data)
        ties = replace(self, evidence=Evidence(self.evidence.data, sigma, sigma))
        return ties, ties._damped(ties._surely(joints))

    def _joints(self) -> list[str]:
        """Return the joints with a tie that the arm does not have already."""
        names = TiedInteraction.name, TiedSlack.name
        there = [joint for own in self.arm.effects if own.name in names for joint in own.joints]
        return [tie.joint for tie in self.partner.ties if tie.joint not in there]

    def _surely(self, joints: Sequence[str]) -> Fitted:
        """Return the ties that are surely there, with slack where that surely is."""
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

    def fitted(self, named: Sequence[Named], start: Sequence[FloatArray] = ()) -> Fitted:
        """Fit the arm with what is named, from values to start from."""
        data, sigma = self.evidence.data, self.evidence.sigma
        return fit(self.arm, named, data, sigma, self.base, Start(start))

    def chi2_per_row(self, fitted: Fitted) -> FloatArray:
        """Return the loss of each joint, shape (n,)."""
        return self.evidence.chi2_per_row(fitted.residual)

    def surely(self, named: Sequence[Named]) -> Fitted:
        """Fit, and take ties away, the weakest first, until all are surely there."""
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

    def _plain(self, joint: str, kept: tuple[int, ...] = (0,)) -> Named:
        return Named(self.partner.interaction.on(self.arm.robot, (joint,)), kept)

    def _loose(self, joint: str, slack: float) -> Named:
        strap = self.partner.slack.on(self.arm.robot, (joint,))
        return Named(strap.with_shape([slack]), (0,))

    def _start(self, named: Sequence[Named], stiffness: FloatArray) -> list[FloatArray]:
        sizes = [len(own.effect.parameters(self.arm.robot)) for own in named]
        rows = zip(stiffness, sizes, strict=True)
        return [np.array([max(k, 0.0), *np.zeros(size - 1)]) for k, size in rows]

    def _common_slack(self, joints: Sequence[str]) -> tuple[float, FloatArray, FloatArray]:
        """Return the slack of all straps that takes most; stiffnesses and how sure they are."""
        reference, arm = self.fitted(()), memoized_arm(self.arm)
        data, sigma = self.evidence.data, self.evidence.sigma
        problem = make_problem(data, sigma, reference.residual, list(reference.columns))
        projection = project(problem, range(problem.x.shape[2]))
        left = projection.rest(problem.y).ravel()

        def solved(slack: float) -> tuple[float, FloatArray, FloatArray]:
            straps = self.partner.slack.on(self.arm.robot, tuple(joints)).with_shape([slack])
            rows = np.concatenate([part.columns(arm, straps) for part in data])
            own = projection.rest(rows * problem.weight[:, :, np.newaxis]).reshape(len(left), -1)
            scale = np.maximum(np.linalg.norm(own, axis=0), 1e-300)
            inverse = np.linalg.pinv((own / scale).T @ (own / scale), hermitian=True)
            aim = (own / scale).T @ left
            values = inverse @ aim
            z = values / np.sqrt(np.maximum(np.diag(inverse), 1e-300))
            return float(values @ aim), values / scale, z

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
        """Return springs with dampers, where something is left that those surely take."""
        limits = self.evidence.limits(fitted.residual, self.settings)
        if np.all(self.chi2_per_row(fitted) < limits):
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
    """Return the first or the last value of each name over its standard deviation."""
    if not fitted.named:
        return []
    ends = [shapes.stop - 1 if last else values.start for values, shapes in fitted.places]
    values, std = fitted.estimate.values, fitted.estimate.std
    return [float(values[k] / std[k]) if 0.0 < std[k] < np.inf else 0.0 for k in ends]
