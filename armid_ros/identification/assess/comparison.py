# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Result of a comparison of two identifications: changes of parameters and residuals."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any, Literal

from armid_ros.estimate import ParameterName
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.parameters_file import ParameterFile
from armid_ros.identification.rows.checks import MAX_UNIT_RATIO
from armid_ros.motion import FloatArray
import numpy as np

SCHEMA = 'armid/comparison/1'


@dataclass(frozen=True)
class ParameterChange:
    """
    Values of one parameter in two identifications, and the significance of their difference.

    Attributes
    ----------
    parameter : ParameterName
    before, after, before_std, after_std : float
    changed : bool

    """

    parameter: ParameterName
    before: float
    after: float
    before_std: float
    after_std: float
    changed: bool = False

    @property
    def difference(self) -> float:
        """Return the value in the second identification minus the value in the first."""
        return self.after - self.before

    @property
    def std(self) -> float:
        """Return the standard deviation of the difference between both values."""
        return float(np.hypot(self.before_std, self.after_std))

    @property
    def deviations(self) -> float:
        """Return the z-score of the difference; 0 or ±inf if both standard deviations are 0."""
        if self.std > 0.0:
            return self.difference / self.std
        return float(np.copysign(np.inf if self.changed else 0.0, self.difference))


@dataclass(frozen=True)
class GroupChange:
    """
    Test result for a common change of the effects of a joint, or of the rigid body.

    Attributes
    ----------
    joint : str
        Joint of the effects; empty for the rigid body.
    parameters : tuple of ParameterName
    p_value : float
    changed : bool

    """

    joint: str
    parameters: tuple[ParameterName, ...]
    p_value: float
    changed: bool


@dataclass(frozen=True)
class LoadChange:
    """
    Payload on one link that explains the changes of the rigid-body parameters.

    Attributes
    ----------
    link : int
        Number of the link, 1 next to the base.
    mass, mass_std : float
        Mass that was added, negative if taken away, and its standard deviation [kg].
    center : ndarray, shape (3,), or None
        Centre of mass in the joint frame of the link [m]; None where it is not determined.
    p_value : float
        Probability of a larger unexplained change by chance.
    rivals : tuple of int
        Numbers of links on which a load would explain the changes as well.

    """

    link: int
    mass: float
    mass_std: float
    center: FloatArray | None
    p_value: float
    rivals: tuple[int, ...] = ()


@dataclass(frozen=True)
class ResidualChange:
    """
    Change of a joint's root mean square residual between two identified models.

    Attributes
    ----------
    joint : str
        Joint name.
    before, after : float
        Root mean square residual, as stated in the file [N m].
    before_error, after_error : float or None
        Residual over the torque of the joint [%].
    ratio : float
        Second residual over the first, divided by the ratio of the torques.
    p_value : float
        Probability of so large a difference by different motions alone.
    changed : bool
        Whether the residuals differ significantly.

    """

    joint: str
    before: float
    after: float
    before_error: float | None
    after_error: float | None
    ratio: float
    p_value: float
    changed: bool = False


@dataclass(frozen=True)
class NotCompared:
    """
    Parameter that only one of two results has, with the reason.

    Attributes
    ----------
    parameter : ParameterName
    why : {'motion', 'effect', 'grouping'}
        'motion': the other motion does not identify it; 'effect': the other model lacks the
        effect; 'grouping': the other data group the parameters of links differently.

    """

    parameter: ParameterName
    why: Literal['motion', 'effect', 'grouping']


@dataclass(frozen=True)
class Comparison:
    """
    Differences between two identifications of one robot.

    Attributes
    ----------
    before, after : ParameterFile
        The compared results.
    changes : tuple of ParameterChange
        Every parameter of both results, in the order of the first.
    only_before, only_after : tuple of NotCompared
        Parameters missing in the other result.
    groups : tuple of GroupChange
        Tests of the effects of every joint and of the rigid body.
    load : LoadChange or None
        The load on one link that explains all changes of the rigid body.
    residuals : tuple of ResidualChange
        Residuals of both models in each joint, if they are comparable.

    """

    before: ParameterFile
    after: ParameterFile
    changes: tuple[ParameterChange, ...]
    only_before: tuple[NotCompared, ...]
    only_after: tuple[NotCompared, ...]
    groups: tuple[GroupChange, ...] = ()
    load: LoadChange | None = None
    residuals: tuple[ResidualChange, ...] = ()

    @property
    def anything(self) -> bool:
        """Whether any parameter, group or residual changed significantly."""
        return bool(self.changed or self.changed_residuals) or any(g.changed for g in self.groups)

    @property
    def unusable(self) -> tuple[ParameterFile, ...]:
        """Return the identifications whose grade is unusable."""
        both = self.before, self.after
        return tuple(one for one in both if one.fit is not None and one.fit.unusable)

    @property
    def factors(self) -> dict[str, float]:
        """
        Return each joint's median ratio of new to old parameters; empty if the ratios differ.

        No load and no wear multiplies masses and friction of all joints by several times: the
        torques of one result are in another unit, or currents.

        """
        # smallest z-score of a value whose ratio is used, smallest number of ratios, and share of
        # the ratios that have to agree
        least, fewest, most = 5.0, 4, 0.8
        clear = [
            (c.parameter.joint, c.after / c.before)
            for c in self.changes
            if abs(c.before) > least * c.before_std and abs(c.after) > least * c.after_std
        ]
        ratios = np.array([ratio for _, ratio in clear])
        if len(ratios) < fewest or np.mean(ratios > 0.0) < most:
            return {}
        common = float(np.median(ratios))
        near = np.abs(np.log(np.maximum(ratios / common, 1e-9))) < np.log(MAX_UNIT_RATIO)
        if 1.0 / LIMITS.torque_factor < common < LIMITS.torque_factor or np.mean(near) < most:
            return {}
        joints = dict.fromkeys(joint for joint, _ in clear if joint)
        return {
            joint: float(np.median([ratio for of, ratio in clear if of == joint]))
            for joint in joints
        }

    @property
    def not_compared(self) -> tuple[NotCompared, ...]:
        """Return the parameters that only one of the two results has."""
        return (*self.only_before, *self.only_after)

    @property
    def changed_residuals(self) -> tuple[ResidualChange, ...]:
        """Return the joints whose residual differs significantly between the models."""
        return tuple(one for one in self.residuals if one.changed)

    @property
    def changed_together(self) -> tuple[GroupChange, ...]:
        """Return significantly changed groups without a significantly changed parameter."""
        sure = {change.parameter for change in self.changed}
        return tuple(g for g in self.groups if g.changed and not sure.intersection(g.parameters))

    @property
    def changed(self) -> tuple[ParameterChange, ...]:
        """Return the significantly changed parameters, the most significant first."""
        found = [change for change in self.changes if change.changed]
        return tuple(sorted(found, key=lambda change: -abs(change.deviations)))

    def document(self) -> dict[str, Any]:
        """Return the comparison as a dictionary for JSON (schema armid/comparison/1)."""
        parameters = []
        for change in self.changes:
            row = asdict(change)
            del row['parameter']['effect']
            parameters.append(row.pop('parameter') | row)
        load, center = self.load, None
        if load is not None:
            center = None if load.center is None else load.center.tolist()
        return {
            'schema': SCHEMA,
            'before': self.before.source,
            'after': self.after.source,
            'parameters': parameters,
            'groups': [
                asdict(group) | {'parameters': [one.name for one in group.parameters]}
                for group in self.groups
            ],
            'load': load and asdict(load) | {'center': center, 'rivals': list(load.rivals)},
            'factors': self.factors,
            'residuals': [
                asdict(one) | {'ratio': one.ratio if isfinite(one.ratio) else None}
                for one in self.residuals
            ],
            'unusable': [
                {'source': one.source, 'reason': one.fit.reason}
                for one in self.unusable
                if one.fit is not None
            ],
            'not_compared': len(self.not_compared),
            **{
                name: [
                    {'name': one.parameter.name, 'joint': one.parameter.joint, 'why': one.why}
                    for one in getattr(self, name)
                ]
                for name in ('only_before', 'only_after')
            },
        }
