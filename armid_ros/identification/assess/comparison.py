# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Two identifications side by side: what changed, and what is in one of them alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

from armid_ros.estimate import ParameterName
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.assess.load_change import LoadChange, ResidualChange
from armid_ros.identification.parameters_file import ParameterFile
from armid_ros.identification.rows.checks import NEAR
import numpy as np

SCHEMA = 'armid/comparison/1'


@dataclass(frozen=True)
class ParameterChange:
    """
    One parameter in both.

    Attributes
    ----------
    parameter : ParameterName
        Which.
    before, after : float
        Values.
    before_std, after_std : float
        Standard deviations.
    changed : bool
        Whether it differs by more than chance.

    """

    parameter: ParameterName
    before: float
    after: float
    before_std: float
    after_std: float
    changed: bool = False

    @property
    def difference(self) -> float:
        """Return what it grew by."""
        return self.after - self.before

    @property
    def std(self) -> float:
        """Return the standard deviation of the difference."""
        return float(np.hypot(self.before_std, self.after_std))

    @property
    def deviations(self) -> float:
        """Difference in its standard deviations; of exact values none, or infinitely many."""
        if self.std > 0.0:
            return self.difference / self.std
        return float(np.copysign(np.inf if self.changed else 0.0, self.difference))


@dataclass(frozen=True)
class GroupChange:
    """
    Parameters that are looked at as a whole.

    Attributes
    ----------
    joint : str
        Whose effects; empty for the rigid body.
    parameters : tuple of ParameterName
        What is in it, two or more.
    p_value : float
        Probability that chance alone makes them differ as much.
    changed : bool
        Whether they differ by more than chance.

    """

    joint: str
    parameters: tuple[ParameterName, ...]
    p_value: float
    changed: bool


#: 'deviation': a file has no standard deviation of it, or of what it groups. 'motion': the other
#: motion does not show it. 'effect': the other model has no such effect there. 'grouping': the
#: other data group the parameters of links differently.
Why = Literal['deviation', 'motion', 'effect', 'grouping']


@dataclass(frozen=True)
class NotCompared:
    """
    A parameter that is not compared.

    Attributes
    ----------
    parameter : ParameterName
        Which.
    why : {'deviation', 'motion', 'effect', 'grouping'}
        What stands against it.

    """

    parameter: ParameterName
    why: Why

    def document(self) -> dict[str, str]:
        """Return it for programs to read."""
        return {'name': self.parameter.name, 'joint': self.parameter.joint, 'why': self.why}


#: Deviations from zero of a value that a ratio is taken of, how many there have to be, and the
#: share of them that has to agree.
_CLEAR, _FEWEST, _MOST = 5.0, 4, 0.8


@dataclass(frozen=True)
class Comparison:
    """
    Two identifications.

    Attributes
    ----------
    before, after : ParameterFile
        What was compared.
    changes : tuple of ParameterChange
        Every parameter that both have, in the order of the first.
    only_before, only_after : tuple of NotCompared
        What the other does not have.
    groups : tuple of GroupChange
        Effects of every joint and the rigid body as a whole; empty without covariances.
    load : LoadChange or None
        The load on one link that explains all changes of the rigid body.

    """

    before: ParameterFile
    after: ParameterFile
    changes: tuple[ParameterChange, ...]
    only_before: tuple[NotCompared, ...]
    only_after: tuple[NotCompared, ...]
    groups: tuple[GroupChange, ...] = ()
    load: LoadChange | None = None
    residuals: tuple[ResidualChange, ...] = ()
    left_out: tuple[NotCompared, ...] = ()

    @property
    def anything(self) -> bool:
        """Whether something changed: a parameter, several as a whole, or what is left."""
        return bool(self.changed or self.changed_residuals) or any(g.changed for g in self.groups)

    @property
    def unusable(self) -> tuple[ParameterFile, ...]:
        """Return which of the two does not describe its recordings."""
        both = self.before, self.after
        return tuple(one for one in both if one.fit is not None and one.fit.unusable)

    @property
    def factors(self) -> dict[str, float]:
        """Return by what one factor the torques of each joint changed; see ``unit_factors``."""
        return unit_factors(self.changes)

    @property
    def not_compared(self) -> tuple[NotCompared, ...]:
        """Return every parameter that either has and that was not compared."""
        return (*self.left_out, *self.only_before, *self.only_after)

    @property
    def changed_residuals(self) -> tuple[ResidualChange, ...]:
        """Return the joints of which a model leaves much more than the other one."""
        return tuple(one for one in self.residuals if one.changed)

    @property
    def changed_together(self) -> tuple[GroupChange, ...]:
        """Return the groups that changed though none of their parameters did beyond doubt."""
        sure = {change.parameter for change in self.changed}
        return tuple(g for g in self.groups if g.changed and not sure.intersection(g.parameters))

    @property
    def changed(self) -> tuple[ParameterChange, ...]:
        """Return what changed, the surest first."""
        found = [change for change in self.changes if change.changed]
        return tuple(sorted(found, key=lambda change: -abs(change.deviations)))

    def document(self) -> dict[str, Any]:
        """Return the comparison for programs to read (schema armid/comparison/1)."""
        return {
            'schema': SCHEMA,
            'before': self.before.source,
            'after': self.after.source,
            'parameters': [
                {
                    **asdict(c.parameter),
                    'before': c.before,
                    'before_std': c.before_std,
                    'after': c.after,
                    'after_std': c.after_std,
                    'changed': c.changed,
                }
                for c in self.changes
            ],
            'groups': [
                {
                    'joint': g.joint,
                    'parameters': [p.name for p in g.parameters],
                    'p_value': g.p_value,
                    'changed': g.changed,
                }
                for g in self.groups
            ],
            'load': None if self.load is None else self.load.document(),
            'factors': self.factors,
            'residuals': [one.document() for one in self.residuals],
            'unusable': [
                {'source': one.source, 'reason': one.fit.reason}
                for one in self.unusable
                if one.fit is not None
            ],
            'not_compared': len(self.not_compared),
            'left_out': [one.document() for one in self.left_out],
            'only_before': [one.document() for one in self.only_before],
            'only_after': [one.document() for one in self.only_after],
        }


def unit_factors(changes: Sequence[ParameterChange]) -> dict[str, float]:
    """
    Return by what one factor the values of each joint changed, where that is all that did.

    No load and no wear makes masses and friction of all joints several times what they were:
    torques of one of the two are in another unit, or are currents. Empty where none are.

    """
    clear = [
        (c.parameter.joint, c.after / c.before)
        for c in changes
        if abs(c.before) > _CLEAR * c.before_std and abs(c.after) > _CLEAR * c.after_std
    ]
    ratios = np.array([ratio for _, ratio in clear])
    if len(ratios) < _FEWEST or np.mean(ratios > 0.0) < _MOST:
        return {}
    common = float(np.median(ratios))
    near = np.abs(np.log(np.maximum(ratios / common, 1e-9))) < np.log(NEAR)
    if 1.0 / LIMITS.torque_factor < common < LIMITS.torque_factor or np.mean(near) < _MOST:
        return {}
    joints = dict.fromkeys(joint for joint, _ in clear if joint)
    return {
        joint: float(np.median([ratio for of, ratio in clear if of == joint])) for joint in joints
    }
