# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
An explanation of a gap: the names, the fitted arm, and its residual.

A fit of base parameters gives standard parameters that no body may have. What the data determine
stays: of all physically consistent links that fit as well, those nearest to the description are
used, so that the arm can be simulated.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import plain_arm
from armid_ros.diagnosis.data.baseline import Baseline, Prior
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search.deviations import as_change, with_jackknife_std
from armid_ros.diagnosis.search.fit import fit, Fitted, Start, with_values_of
from armid_ros.diagnosis.search.question import Question
from armid_ros.diagnosis.search.trial import Step, Survey, Trial
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.errors import IdentificationError
from armid_ros.identification.physical.fit_among_bodies import physical_program, PhysicalSettings
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np
import scipy.linalg

NOISE, ESTIMATED = 'noise', 'an estimate of the misfit that such a model has'
#: Weights of the description that are tried; the largest that fits as well is used.
_WEIGHTS = (1e-3, 1e-5, 1e-7)
#: Physically consistent links fit as well if they leave at most this many times the squares.
_ALIKE = 1.05


@dataclass(frozen=True)
class Explanation:
    """
    The result of a search.

    Attributes
    ----------
    given : ArmModel
        The arm as given.
    base : BaseParameters or None
        Base parameters of it that were fitted; None where it stayed as given.
    fitted : Fitted
        The arm with all named effects.
    reference : Fitted
        The same without them.
    steps : tuple of Step
        The names, in the order of those in ``fitted``.
    survey : Survey or None
        The first look at all candidates.
    evidence : Evidence
        The data.
    minor : tuple of Trial
        Causes that are there and do not matter, for the small print.
    prior : Prior or None
        CauseInformation of the baseline about ``base``.
    by_chance : float
        Variance of values by what the names leave, over that for white noise.
    baseline : Baseline or None
        Recordings from before the named effects changed.
    beside : Question or None
        The same question with a model discrepancy, beside which stated values are fitted; None
        where there is none.

    """

    given: ArmModel
    base: BaseParameters | None
    fitted: Fitted
    reference: Fitted
    steps: tuple[Step, ...]
    survey: Survey | None
    evidence: Evidence
    minor: tuple[Trial, ...] = ()
    prior: Prior | None = None
    by_chance: float = 0.0
    baseline: Baseline | None = None
    beside: Question | None = None

    def without(self, name: int) -> Explanation:
        """Return the explanation without one of its names, the others fitted anew."""
        fewer = self.only([k for k in range(len(self.steps)) if k != name])
        return replace(fewer, minor=(*self.minor, self.steps[name].trial))

    def only(self, keep: Sequence[int]) -> Explanation:
        """Return the explanation with some of its names, in this order, fitted anew."""
        fitted = fit(
            self.given,
            [self.fitted.named[k] for k in keep],
            self.evidence,
            self.base,
            Start([self.fitted.values[k] for k in keep], self.fitted.change),
            self.prior,
        )
        fitted = with_jackknife_std(fitted, self.evidence, self.prior, self.by_chance)
        return replace(self, fitted=fitted, steps=tuple(self.steps[k] for k in keep))

    def in_arm(self, question: Question) -> Explanation:
        """Return what the names explain of another question, all fitted anew."""
        arm, base, prior = question.arm, question.base, question.prior
        reference = fit(arm, (), self.evidence, base, prior=prior)
        moved = replace(self, given=arm, base=base, prior=prior, reference=reference)
        if not self.steps:
            return replace(moved, fitted=reference)
        start = replace(self.fitted, change=np.zeros_like(reference.change))
        return replace(moved, fitted=start).only(range(len(self.steps)))

    def with_nothing_named(self) -> Explanation:
        """Return the explanation with all of its names in the small print."""
        small = tuple(step.trial for step in self.steps)
        return replace(self, fitted=self.reference, steps=(), minor=(*small, *self.minor))

    def forgetting(self) -> Explanation:
        """Return the explanation with arms that do not cache what they have computed."""
        return replace(
            self,
            given=plain_arm(self.given),
            fitted=replace(self.fitted, arm=plain_arm(self.fitted.arm)),
            reference=replace(self.reference, arm=plain_arm(self.reference.arm)),
            beside=None,
        )

    @cached_property
    def beside_discrepancy(self) -> Explanation:
        """Return the names fitted with the model discrepancy; itself where there is none."""
        return self if self.beside is None else self.in_arm(self.beside)

    @property
    def chi2_per_row(self) -> FloatArray:
        """Mean weighted square of the residual of the patched model, shape (n,)."""
        return self.evidence.chi2_per_row(self.fitted.residual)


@dataclass(frozen=True)
class Chosen:
    """
    The explanation that is given.

    Attributes
    ----------
    explanation : Explanation
        The explanation.
    misfit : ndarray, shape (n,)
        Misfit that the unit of the gap contains; zero where that is noise alone [N m].
    floor_in_words : str
        What the floor of the gap is.
    notes : tuple of str
        What a reader should know.
    rest : Explanation or None
        The same names fitted jointly with a body common to both days: its residual is what they
        leave.
    untested : str
        What would tell a change from another motion's misfit, a sentence; empty if the recordings
        do. Where they do not, names have to take most of the gap.

    """

    explanation: Explanation
    misfit: FloatArray
    floor_in_words: str
    notes: tuple[str, ...] = ()
    rest: Explanation | None = None
    untested: str = ''

    @property
    def tested(self) -> bool:
        """Whether names were tested for a change in all recordings, also those not used."""
        return self.rest is not None and not self.untested

    @property
    def measured(self) -> bool:
        """Whether the floor is noise or an estimated misfit, and no misfit that is known."""
        return self.floor_in_words in (NOISE, ESTIMATED)


def in_model_as_given(found: Explanation) -> Explanation:
    """
    Return what the names explain while the rigid body stays as it is.

    Their values are those of a joint fit with the body and the model discrepancy: what the model
    lacks in every motion is not taken for a part of what has changed.

    """
    arm, evidence = found.given, found.evidence
    found = found.beside_discrepancy
    fitted = found.fitted
    if found.prior is not None and found.baseline is not None:
        fitted = as_change(fitted, evidence, found.prior, found.baseline)
    alone, reference = with_values_of(fitted, arm, evidence), fit(arm, (), evidence, None)
    return replace(found, given=arm, base=None, prior=None, fitted=alone, reference=reference)


def at_floor(explanation: Explanation, settings: DiagnosisSettings) -> bool:
    """Return whether the residual of an explanation is no gap in any joint."""
    evidence = explanation.evidence
    limits = evidence.limits(explanation.fitted.residual, settings)
    return bool(np.all(explanation.chi2_per_row <= limits))


def as_bodies(explanation: Explanation, arm: ArmModel) -> tuple[Explanation, tuple[str, ...]]:
    """
    Return an explanation with physically consistent links, if any fit as well, and a note.

    Parameters
    ----------
    explanation : Explanation
        What was found.
    arm : ArmModel
        The arm as described.

    """
    base, fitted = explanation.base, explanation.fitted
    rigid = len(arm.robot.rigid_parameters)
    if base is None or not base.rank or base.independent.min() >= rigid:
        return explanation, ()
    evidence = explanation.evidence
    known = len(arm.parameters)
    values = base.values(fitted.arm.theta[:known])
    triangle, count = _triangle(explanation, values)
    program, _ = physical_program(arm, base, PhysicalSettings())
    for weight in _WEIGHTS:
        try:
            theta = program.solve(triangle, count, weight)
        except IdentificationError:
            continue
        changed = fitted.arm.with_theta(np.concatenate([theta, fitted.arm.theta[known:]]))
        residual = tuple(evidence.residuals(changed))
        bodily = replace(fitted, arm=changed, residual=residual)
        allowed = np.maximum(_ALIKE * explanation.chi2_per_row, 1.0)
        if np.all(evidence.chi2_per_row(residual) <= allowed):
            return replace(explanation, fitted=bodily), ()
    return explanation, (
        'no links that are bodies explain the data as well: what was named, or not found, is in '
        'the inertias; the patched model may not be simulable',
    )


def _triangle(explanation: Explanation, values: FloatArray) -> tuple[FloatArray, float]:
    """
    Return the triangular factor of the base columns and their target, and the number of rows.

    Rows of the baseline are part of the factor.

    """
    fitted, rank, evidence = explanation.fitted, len(values), explanation.evidence
    blocks = []
    for columns, own_residual in zip(fitted.columns, fitted.residual, strict=True):
        own = columns[:, :, :rank]
        target = own_residual + own @ values
        blocks.append(np.concatenate([own, target[:, :, np.newaxis]], axis=2))
    factors = [
        scipy.linalg.qr(rows.reshape(-1, rank + 1), mode='r')[0][: rank + 1]
        for rows in evidence.weighted(blocks)
    ]
    prior = explanation.prior
    if prior is not None:
        own, own_residual = prior.columns, prior.residual - prior.columns @ fitted.change
        factors.append(np.column_stack([own, own_residual + own @ values]))
    whole = scipy.linalg.qr(np.concatenate(factors), mode='r')[0][: rank + 1]
    parts = [*evidence.data, *(() if prior is None else prior.data)]
    return np.asarray(whole), float(sum(part.informative.sum() for part in parts))
