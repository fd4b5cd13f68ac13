# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Approximation of a residual by a formula of few terms: sparse regression on a library of terms.

Orthogonal matching pursuit adds the term that correlates most with the remaining residual.
Cross-validation selects the fewest terms whose error is within one standard deviation of the least
error. The formula suggests a user-defined effect. Source: Brunton, Proctor and Kutz 2016;
Pati, Rezaiifar and Krishnaprasad 1993.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple
import warnings

from armid_ros.motion import FloatArray
from armid_ros.residual.rows import BLOCKS, JointRows
import numpy as np


class Term(NamedTuple):
    """Term of a formula for residual torque, such as 'dq^3', with its factor and unit."""

    text: str
    coefficient: float
    unit: str


@dataclass(frozen=True)
class Law:
    """
    Formula of a few terms that approximates the residual torque of a joint.

    Attributes
    ----------
    terms : tuple of Term
        Terms of the formula, the largest first.
    share : float
        Share of the squared residual of held-out blocks that the formula predicts.

    """

    terms: tuple[Term, ...]
    share: float

    @property
    def text(self) -> str:
        """Return the formula as text, such as '0.31 dq^3 - 0.02 q'."""
        text = ''
        for number, term in enumerate(self.terms):
            sign = '-' if term.coefficient < 0.0 else ('' if number == 0 else '+')
            factor = f'{abs(term.coefficient):.3g}'
            body = factor if term.text == '1' else f'{factor} {term.text}'
            text += f' {sign} {body}' if number else f'{sign}{body}'
        return text

    def document(self) -> dict[str, Any]:
        """Return the formula as a JSON document."""
        terms = [
            {'term': one.text, 'coefficient': one.coefficient, 'unit': one.unit}
            for one in self.terms
        ]
        return {'text': self.text, 'terms': terms, 'held_out_share': self.share}


def _library(
    inputs: FloatArray, low: float, high: float, prismatic: bool
) -> list[tuple[str, str, FloatArray]]:
    """Return candidate terms of the formula: text, unit of the factor, and values (N,)."""
    q, dq, w = inputs.T
    sign = np.sign(dq)
    force, x = ('N', 'm') if prismatic else ('N m', 'rad')
    terms = [
        ('1', force, np.ones_like(q)),
        ('q', f'{force}/{x}', q),
        ('q^2', f'{force}/{x}^2', q**2),
        ('q^3', f'{force}/{x}^3', q**3),
        ('dq', f'{force} s/{x}', dq),
        ('dq |dq|', f'{force} s^2/{x}^2', dq * np.abs(dq)),
        ('dq^3', f'{force} s^3/{x}^3', dq**3),
        ('q dq', f'{force} s/{x}^2', q * dq),
        ('q^2 dq', f'{force} s/{x}^3', q**2 * dq),
        ('sign(dq)', force, sign),
        ('q sign(dq)', f'{force}/{x}', q * sign),
        ('q^2 sign(dq)', f'{force}/{x}^2', q**2 * sign),
        ('w', '', w),
        ('w^2', f'1/({force})', w**2),
        ('|w| sign(dq)', '', np.abs(w) * sign),
        ('w dq', f's/{x}', w * dq),
    ]
    if not prismatic:
        for k in (1, 2, 3):
            angle = 'q' if k == 1 else f'{k} q'
            for name, function in (('sin', np.sin), ('cos', np.cos)):
                terms.append((f'{name}({angle})', force, function(k * q)))
                terms.append((f'{name}({angle}) sign(dq)', force, function(k * q) * sign))
    # candidate positions, as shares of the range, at which a one-sided force begins
    for place in low + np.array((0.2, 0.35, 0.5, 0.65, 0.8)) * (high - low):
        terms.append((f'max(q - {place:.3g}, 0)', f'{force}/{x}', np.maximum(q - place, 0.0)))
        terms.append((f'max({place:.3g} - q, 0)', f'{force}/{x}', np.maximum(place - q, 0.0)))
    return terms


def suggest_law(rows: JointRows, prismatic: bool) -> Law | None:
    """
    Fit a formula of up to three terms to a joint's residual torque; None if the fit is poor.

    Parameters
    ----------
    rows : JointRows
        Residuals of a joint.
    prismatic : bool
        Whether the joint slides.

    """
    ends = float(rows.inputs[:, 0].min()), float(rows.inputs[:, 0].max())
    columns = _library(rows.inputs, *ends, prismatic)
    x = np.column_stack([values for _, _, values in columns])
    most = 3  # terms of a formula
    # squared residuals of each held-out block, by the number of terms of the formula
    losses = np.zeros((most, BLOCKS))
    for block, others in enumerate(rows.folds()):
        for more in range(most):
            factors = _fit(x[others], rows.residual[others], more + 1)
            losses[more, block] = np.sum((rows.residual[~others] - x[~others] @ factors) ** 2)
    best = int(np.argmin(losses.sum(axis=1)))
    # the fewest terms whose held-out error is within one standard deviation of the least error
    worse = losses[: best + 1] - losses[best]
    allowed = np.std(worse, axis=1, ddof=1) * np.sqrt(BLOCKS)
    count = int(np.argmax(worse.sum(axis=1) <= allowed)) + 1
    factors = _fit(x, rows.residual, count)
    chosen = np.flatnonzero(factors)
    share = 1.0 - float(losses[count - 1].sum()) / max(float(np.sum(rows.residual**2)), 1e-300)
    if share < 0.5:  # a useful formula predicts at least half of the squared residual
        return None
    size = np.abs(factors) * np.sqrt(np.mean(x**2, axis=0))
    order = sorted(chosen, key=lambda k: -size[k])
    terms = tuple(Term(columns[k][0], float(factors[k]), columns[k][1]) for k in order)
    return Law(terms, share)


def share_of(residual: FloatArray, torque: FloatArray) -> float:
    """Return the share of the squared residual that the predicted `torque` explains, at most 1."""
    return 1.0 - float(np.sum((residual - torque) ** 2)) / max(float(np.sum(residual**2)), 1e-300)


def _fit(x: FloatArray, residual: FloatArray, count: int) -> FloatArray:
    """Fit a residual by at most `count` of the L columns of x; return L factors, 0 if unused."""
    from sklearn.linear_model import orthogonal_mp

    size = np.sqrt(np.mean(x**2, axis=0))
    scale = np.where(size > 0.0, size, 1.0)
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # the first of several linearly dependent terms is used
        found = orthogonal_mp(x / scale, residual, n_nonzero_coefs=count)
    chosen = np.flatnonzero(found)
    factors = np.zeros(x.shape[1])
    factors[chosen] = np.linalg.lstsq(x[:, chosen], residual, rcond=None)[0]
    return factors
