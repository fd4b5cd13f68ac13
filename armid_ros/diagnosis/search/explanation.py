# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
An explanation of a gap: the named effects, and the arm with them.

A fit of base parameters may give links that are not physically consistent. They are replaced by
consistent links near the description with an equally good fit.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.arm.memoized_arm import plain_arm
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search.posterior import Fitted, JointFit
from armid_ros.diagnosis.search.trial import Look, Survey, Trial
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.errors import IdentificationError
from armid_ros.identification.physical.fit_among_bodies import physical_program, PhysicalSettings
from armid_ros.motion import FloatArray
import numpy as np

NOISE, ESTIMATED = 'noise', 'an estimate of the error of such a model'
#: Candidate weights of the description; the largest weight with an equally good fit is used.
_WEIGHTS = (1e-3, 1e-5, 1e-7)
#: Largest ratio of squared residuals at which physically consistent links fit as well.
_ALIKE = 1.05


@dataclass(frozen=True)
class Explanation:
    """
    The named causes with their values.

    Attributes
    ----------
    given : ArmModel
        The arm as given.
    fitted : Fitted
        The arm with all named effects.
    reference : Fitted
        The arm without named effects.
    steps : tuple of Trial
        The named causes, in the order of ``fitted``.
    survey : Survey or None
        The first comparison of all candidates.
    evidence : Evidence
        The data in the unit of the gap.
    minor : tuple of Trial
        Causes that are significant and not material.
    problem : JointFit or None
        Data and model in which the values are fitted; None in a finished diagnosis.
    refitted : bool
        Whether the rigid body was refitted.

    """

    given: ArmModel
    fitted: Fitted
    reference: Fitted
    steps: tuple[Trial, ...]
    survey: Survey | None
    evidence: Evidence
    minor: tuple[Trial, ...] = ()
    problem: JointFit | None = None
    refitted: bool = False

    def without(self, *names: int) -> Explanation:
        """Return the explanation without some of its causes; the other causes are refitted."""
        fewer = self.only([k for k in range(len(self.steps)) if k not in names])
        return replace(fewer, minor=(*self.minor, *(self.steps[k] for k in names)))

    def only(self, keep: Sequence[int]) -> Explanation:
        """Return the explanation with some of its causes, refitted, in the given order."""
        assert self.problem is not None
        fitted = self.problem.fit([self.fitted.named[k] for k in keep])
        return replace(self, fitted=fitted, steps=tuple(self.steps[k] for k in keep))

    def with_nothing_named(self) -> Explanation:
        """Return the explanation with all of its causes as minor ones."""
        minor = *self.steps, *self.minor
        return replace(self, fitted=self.reference, steps=(), minor=minor)

    def forgetting(self) -> Explanation:
        """Return the explanation without the data and caches from its computation."""
        return replace(
            self,
            given=plain_arm(self.given),
            fitted=replace(self.fitted, arm=plain_arm(self.fitted.arm)),
            reference=replace(self.reference, arm=plain_arm(self.reference.arm)),
            problem=None,
        )

    @cached_property
    def residual(self) -> list[FloatArray]:
        """Residual of the arm with the named effects, (M, n) of each trajectory [N m]."""
        return self.evidence.residuals(self.fitted.arm)

    @property
    def chi2_per_row(self) -> FloatArray:
        """Mean weighted square of the residual of the patched model, shape (n,)."""
        return self.evidence.chi2_per_row(self.residual)


@dataclass(frozen=True)
class Chosen:
    """
    The chosen explanation of a gap, with the unit of the gap.

    Attributes
    ----------
    explanation : Explanation
        The explanation.
    misfit : ndarray, shape (n,)
        Misfit that the unit of the gap contains; zero if the unit is noise alone [N m].
    floor_in_words : str
        Name of the floor of the gap, a noise or a misfit.
    notes : tuple of str
        Notes for the reader of the report.
    untested : str
        Sentence on the recordings that would separate a change from the misfit of another motion.
        If it is not empty, and there is a baseline, named causes have to explain most of the gap.
    look : Look or None
        The first comparison of all causes.

    """

    explanation: Explanation
    misfit: FloatArray
    floor_in_words: str
    notes: tuple[str, ...] = ()
    untested: str = ''
    look: Look | None = None

    @property
    def measured(self) -> bool:
        """Whether the floor is noise or an estimated misfit, and not a known misfit."""
        return self.floor_in_words in (NOISE, ESTIMATED)


def at_floor(explanation: Explanation, settings: DiagnosisSettings) -> bool:
    """Return whether an explanation leaves no gap in any joint."""
    limits = explanation.evidence.limits(explanation.residual, settings)
    return bool(np.all(explanation.chi2_per_row <= limits))


def as_bodies(explanation: Explanation) -> tuple[Explanation, tuple[str, ...]]:
    """Return the explanation with physically consistent links, or unchanged with a note."""
    problem, fitted = explanation.problem, explanation.fitted
    if problem is None or not problem.refits_body:
        return explanation, ()
    base, arm = problem.nuisance.base, problem.arm
    if not base.rank or base.independent.min() >= len(arm.robot.rigid_parameters):
        return explanation, ()
    known = len(arm.parameters)
    products, count = _products(problem, fitted)
    program, _ = physical_program(arm, base, PhysicalSettings())
    for weight in _WEIGHTS:
        try:
            theta = program.solve(products, count, weight)
        except IdentificationError:
            continue
        changed = fitted.arm.with_theta(np.concatenate([theta, fitted.arm.theta[known:]]))
        bodily = replace(explanation, fitted=replace(fitted, arm=changed))
        if np.all(bodily.chi2_per_row <= np.maximum(_ALIKE * explanation.chi2_per_row, 1.0)):
            return bodily, ()
    return explanation, (
        'no physically consistent links explain the data as well: the fitted inertias contain a '
        'part of the cause, and a simulation with the patched model may fail',
    )


def _products(problem: JointFit, fitted: Fitted) -> tuple[FloatArray, float]:
    """Return the products of the base columns and their target, and the number of rows."""
    nuisance = problem.nuisance
    rows, rank, base = nuisance.rows, nuisance.rank, nuisance.base
    back = np.linalg.inv(nuisance.turn)
    then, now = (base.values(x.theta[: len(base.standard)]) for x in (problem.arm, fitted.arm))
    rest = [part.residual(fitted.arm)[:, :, np.newaxis] for part in rows.data]
    left = rows.weighted(rest, range(len(rows.torque)))
    products, count = np.zeros((rank + 1, rank + 1)), 0
    for k, columns in enumerate(nuisance.columns):
        own = columns[:, :, :rank] @ back
        residual, values = (
            (left[k][:, :, 0], now) if rows.today[k] else (nuisance.residual[k], then)
        )
        both = np.concatenate([own, (residual + own @ values)[:, :, np.newaxis]], axis=2)
        flat = both.reshape(-1, rank + 1)
        products += flat.T @ flat
        count += nuisance.count[k]
    return products, float(count)
