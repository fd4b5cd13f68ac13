# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters estimated from data: their names, values and covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
import math
import re
from statistics import NormalDist
from typing import Any

from armid_ros.errors import meant, ModelError
from armid_ros.motion import FloatArray, read_only
import numpy as np

#: Names of rigid-body parameters: a symbol, such as 'payload_m' of a payload or 'mx_difference'.
_OF_BODY = re.compile(r'(?:payload_)?(m[xyz]?|I[xyz]{2})(_difference)?')
_RIGID = re.compile(r'(m[xyz]?|I[xyz]{2})\d+( |$)')


@dataclass(frozen=True)
class ParameterName:
    """
    Name, joint, unit and effect of a scalar parameter.

    Attributes
    ----------
    name : str
        Name of the parameter; a grouping of rigid parameters is an expression, 'Izz1 + Iyy2'.
    joint : str
        Joint of the parameter; empty for a parameter of the whole arm.
    unit : str
        SI unit, such as 'kg m^2' or 'N m s/rad'.
    effect : str
        Effect of the parameter; empty for the rigid body.

    """

    name: str
    joint: str
    unit: str
    effect: str = field(default='', compare=False)

    @property
    def words(self) -> str:
        """Return the name in words, such as 'viscous coefficient', without the joint."""
        found = _OF_BODY.fullmatch(self.name)
        if found is None:
            return name_in_words(self.name)
        quantity = symbol_in_words(found[1])
        return f'difference of {quantity}' if found[2] else quantity

    @property
    def rigid(self) -> bool:
        """Whether the parameter is inertial, or a sum whose first term is inertial."""
        return _RIGID.match(self.name) is not None


def name_in_words(name: str) -> str:
    """Return an effect or parameter name as words: 'Coulomb friction' for 'coulomb_friction'."""
    words = name.replace('_', ' ')
    return words.replace('coulomb', 'Coulomb').replace('stribeck', 'Stribeck')


def symbol_in_words(symbol: str) -> str:
    """Return an inertial parameter as words: 'product of inertia xy' for 'Ixy'."""
    if symbol == 'm':
        return 'mass'
    if symbol[0] == 'm':
        return f'first moment along {symbol[1]}'
    axes = symbol[1:]
    same = axes[0] == axes[1]
    return f'moment of inertia about {axes[0]}' if same else f'product of inertia {axes}'


@dataclass(frozen=True)
class Estimate:
    """
    Estimated parameters with their covariance.

    Attributes
    ----------
    parameters : tuple of ParameterName
        Names of the P parameters.
    values : ndarray, shape (P,)
        Values, in the units of the parameters.
    covariance : ndarray, shape (P, P)
        Covariance of the values, in products of the units.

    Examples
    --------
    >>> import armid_ros as ar
    >>> estimate = ar.identify('my_arm.urdf', 'monday').estimate
    >>> bool(0.29 < estimate['viscous_friction', 'elbow'] < 0.31)
    True
    >>> k = estimate.index('viscous_coefficient', 'elbow')
    >>> low, high = estimate.interval()[k]  # 95 %
    >>> bool(0.29 < low < high < 0.31)
    True

    """

    parameters: tuple[ParameterName, ...]
    values: FloatArray
    covariance: FloatArray

    def __post_init__(self) -> None:
        """Make the arrays read-only; raise ModelError unless of shapes (P,) and (P, P)."""
        count = len(self.parameters)
        object.__setattr__(self, 'values', read_only(self.values))
        object.__setattr__(self, 'covariance', read_only(self.covariance))
        if self.values.shape != (count,) or self.covariance.shape != (count, count):
            raise ModelError(
                f'{count} parameters need {count} values with covariances, but the values have '
                f'shape {self.values.shape}, and the covariance has {self.covariance.shape}'
            )

    def __repr__(self) -> str:
        """Return a text of at most ten lines: the first parameters with standard deviations."""
        rows = [
            f'  {(p.joint + " ") if p.joint else ""}{p.name} {value:.4g} ± {std:.2g} {p.unit}'
            for p, value, std in zip(self.parameters, self.values, self.std, strict=True)
        ]
        more = [f'  ... and {len(rows) - 8} more'] if len(rows) > 9 else []
        shown = rows[:8] if more else rows
        return '\n'.join([f'Estimate of {len(rows)} parameters', *shown, *more])

    @property
    def std(self) -> FloatArray:
        """Standard deviation of each parameter, shape (P,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def interval(self, confidence: float = 0.95) -> FloatArray:
        """Return the confidence interval of each parameter, lower and upper end, shape (P, 2)."""
        half_width = NormalDist().inv_cdf(0.5 + confidence / 2.0) * self.std
        return np.column_stack([self.values - half_width, self.values + half_width])

    def __getitem__(self, key: str | tuple[str, str]) -> float:
        """Return a value by name, or by (name, joint), of a parameter or one-parameter effect."""
        name, joint = (key, '') if isinstance(key, str) else key
        own = [
            k
            for k, one in enumerate(self.parameters)
            if (one.effect, one.joint) == (name, joint) and one.name.isidentifier()
        ]
        return float(self.values[own[0] if len(own) == 1 else self.index(name, joint)])

    def index(self, name: str, joint: str = '') -> int:
        """Return the index of the parameter with a name and joint; raise ModelError if missing."""
        pairs = [(one.name, one.joint) for one in self.parameters]
        if (name, joint) in pairs:
            return pairs.index((name, joint))
        own = [f'{one} {place}'.rstrip() for one, place in pairs if joint in ('', place)]
        known = own or list(dict.fromkeys(place for _, place in pairs if place))  # the joints
        guess = meant(name if own else joint, known)
        place, kind = f" of joint '{joint}'" if joint else '', 'parameters' if own else 'joints'
        raise ModelError(f"no parameter '{name}'{place}; known {kind}: {', '.join(known)}{guess}")


def parameter_table(
    names: Sequence[ParameterName], values: FloatArray, std: Sequence[float | None]
) -> list[dict[str, Any]]:
    """Return a dictionary (name, joint, value, std, unit) per parameter, for YAML or JSON."""
    return [
        {
            'name': name.name,
            'joint': name.joint,
            'value': float(value),
            'std': None if s is None else float(s),
            'unit': name.unit,
        }
        for name, value, s in zip(names, values, std, strict=True)
    ]


def measured(value: float, half_width: float) -> tuple[str, str]:
    """Return a value and the half-width of its interval as texts, with equally many decimals."""
    if not (math.isfinite(half_width) and half_width > 0.0):
        return f'{value:.4g}', '0'
    decimals = max(0, 1 - math.floor(math.log10(half_width)))
    if decimals > 7 or max(abs(value), half_width) >= 1e7:
        return f'{value:.3g}', f'{half_width:.2g}'
    return f'{value:z.{decimals}f}', f'{half_width:.{decimals}f}'
