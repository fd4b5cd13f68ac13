# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Torque that is learned from recordings, without a physical model.

Each joint has a map from position, velocity and load to torque: the mean of a Gaussian process on
inducing points. Far from all points the mean is zero, and the standard deviation is that of the
prior. The map shows where a model is wrong and by how much. It is not a physical law.

"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

from armid_ros.effects.base import Arm, Effect
from armid_ros.effects.joint_law import joint_columns
from armid_ros.effects.quantities import Quantity
from armid_ros.errors import ModelError
from armid_ros.files import finite
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.robots import Robot
import numpy as np
from scipy.linalg import cho_factor, cho_solve

#: Inputs of a map, in the order of its columns.
INPUTS = ('position', 'velocity', 'load')
#: Significant digits of the points in files; a map is accurate to three.
_DIGITS = '.9g'


@dataclass(frozen=True, eq=False)
class TorqueMap:
    """
    Learned torque of a joint: Gaussian-process posterior over position, velocity and load.

    k(x, x') = s^2 exp(-sum of ((u_i - u_i') / l_i)^2 / 2); the mean is the sum of a_m k(x, x_m) /
    s^2. The velocity is scaled as u = v asinh(dq / v): proportional below the knee v and
    logarithmic above, because friction changes most at low velocity.
    Source: Rasmussen and Williams 2006, eqs. 2.25 and 2.26.

    Attributes
    ----------
    points : ndarray, shape (M, 3)
        Inducing points x_m: position [rad or m], velocity, load [N m or N].
    weights : ndarray, shape (M,)
        Weights a_m [N m or N].
    noise : ndarray, shape (M,)
        Standard deviation of the torque at each point [N m or N].
    lengths : ndarray, shape (3,)
        Length scales l; infinite for an input without influence.
    amplitude : float
        Standard deviation s of the prior [N m or N].
    knee : float
        Velocity v above which the scale is logarithmic [rad/s or m/s].

    """

    points: FloatArray
    weights: FloatArray
    noise: FloatArray
    lengths: FloatArray
    amplitude: float
    knee: float

    def __post_init__(self) -> None:
        """Freeze the arrays, and check their shapes and signs."""
        for name in ('points', 'weights', 'noise', 'lengths'):
            object.__setattr__(self, name, read_only(getattr(self, name)))
        count = len(self.weights)
        shapes = self.points.shape, self.noise.shape, self.lengths.shape
        if shapes != ((count, len(INPUTS)), (count,), (len(INPUTS),)):
            raise ModelError(
                f'torque map: points, noise and lengths have shapes {shapes}; with {count} '
                f'weights they need {(count, len(INPUTS))}, {(count,)} and {(len(INPUTS),)}'
            )
        sizes = (*self.lengths, *self.noise, self.amplitude, self.knee)
        if not min(sizes) > 0.0:
            raise ModelError(
                'torque map: length scales, noise, amplitude and knee have to be positive'
            )

    def __eq__(self, other: object) -> bool:
        """Return whether two torque maps have equal values."""
        return isinstance(other, TorqueMap) and self._numbers == other._numbers

    def __hash__(self) -> int:
        """Return a hash of all numbers in the torque map."""
        return hash(self._numbers)

    @property
    def _numbers(self) -> tuple[bytes, ...]:
        arrays = (self.points, self.weights, self.noise, self.lengths)
        return tuple(np.asarray(a).tobytes() for a in (*arrays, self.amplitude, self.knee))

    @property
    def takes_load(self) -> bool:
        """Whether the learned torque depends on the load."""
        return bool(np.isfinite(self.lengths[2]))

    def fitted_to(self, torque: FloatArray) -> TorqueMap:
        """Return a copy of the map that is fitted to torques [N m] at the M inducing points."""
        return replace(self, weights=cho_solve(self._factor, torque))

    def torque(self, inputs: FloatArray) -> FloatArray:
        """Return the learned torque [N m or N] for inputs (..., 3): position, velocity, load."""
        return np.asarray(self._kernel(inputs) @ self.weights)

    def std(self, inputs: FloatArray) -> FloatArray:
        """Return the standard deviation of `torque` [N m or N] for the same inputs (..., 3)."""
        near = self._kernel(inputs)
        solved = cho_solve(self._factor, near.reshape(-1, len(self.weights)).T).T
        explained = np.sum(near * solved.reshape(near.shape), axis=-1)
        return np.asarray(self.amplitude * np.sqrt(np.clip(1.0 - explained, 0.0, 1.0)))

    @cached_property
    def _factor(self) -> Any:
        share = (self.noise / self.amplitude) ** 2
        return cho_factor(self._kernel(self.points) + np.diag(share))

    def _kernel(self, inputs: FloatArray) -> FloatArray:
        """Return the normalized kernel of inputs and the M inducing points, shape (..., M)."""
        own, others = (scaled_inputs(x, self.knee) for x in (inputs, self.points))
        difference = (own[..., np.newaxis, :] - others) / self.lengths
        return np.asarray(np.exp(-0.5 * np.sum(difference**2, axis=-1)))

    def document(self) -> dict[str, Any]:
        """Return the torque map as an entry for model.yaml, with one line per inducing point."""
        rows = np.column_stack([self.points, self.weights, self.noise])
        return {
            'amplitude': float(self.amplitude),
            'knee': float(self.knee),
            'length_scales': [float(x) if np.isfinite(x) else None for x in self.lengths],
            'points': [' '.join(format(x, _DIGITS) for x in row) for row in rows],
        }

    @classmethod
    def of_document(cls, entry: Mapping[str, Any], joint: str) -> TorqueMap:
        """
        Create the torque map of a joint from an entry of model.yaml that `document` wrote.

        Raises
        ------
        ModelError
            If the entry is invalid; the message names the joint and the fault.

        """
        torque_map = f"torque map of joint '{joint}'"
        try:
            rows = [[float(x) for x in str(line).split()] for line in entry['points']]
            lengths = [np.inf if x is None else float(x) for x in entry['length_scales']]
            table = np.array(rows, dtype=float).reshape(len(rows), len(INPUTS) + 2)
        except (TypeError, ValueError) as error:
            raise ModelError(f'{torque_map}: {error}') from None
        if not np.all(np.isfinite(table)) or np.any(np.isnan(lengths)):
            raise ModelError(f'{torque_map} has a number that is not finite; learn the map again')
        size, knee = (
            finite(entry[key], f'{key} of the {torque_map}') for key in ('amplitude', 'knee')
        )
        return cls(table[:, :3], table[:, 3], table[:, 4], np.array(lengths), size, knee)


@dataclass(frozen=True)
class LearnedTorque(Effect):
    """
    Learned torque of joints as a function of position, velocity and load.

    The load is the torque that holds the arm at its position. Far from the motions of the training
    data, the learned torque is zero. The effect is confounded with every other effect, and is
    therefore never named by a diagnosis.
    Source: Nguyen-Tuong and Peters 2010 (semiparametric models); Quinonero-Candela and Rasmussen
    2005 (inducing points).

    Attributes
    ----------
    maps : tuple of TorqueMap
        One map for each joint; empty: no torque.

    """

    maps: tuple[TorqueMap, ...] = ()

    name = 'learned_torque'
    summary = 'learned torque without a physical cause, over position, velocity and load'
    quantities = (Quantity('learned_share', '', typical=(0.5, 1.0)),)
    learned = True

    def __post_init__(self) -> None:
        """Check that there is one torque map per joint, or none at all."""
        super().__post_init__()
        if self.maps and len(self.maps) != len(self.joints):
            raise ModelError(
                f'{self.name}: {len(self.maps)} torque maps are given for {len(self.joints)} '
                f'joints, {", ".join(self.joints)}; give one for each joint'
            )

    def particulars(self) -> dict[str, Any]:
        """Return the torque maps as entries for model.yaml."""
        rows = zip(self.joints, self.maps, strict=bool(self.maps))
        return {'maps': [{'joint': joint, **own.document()} for joint, own in rows]}

    def with_particulars(self, entry: Mapping[str, Any]) -> Self:
        """Return a copy of the effect with the torque maps from an entry of model.yaml."""
        found = {str(row['joint']): row for row in entry.get('maps', ())}
        if not found:
            return self
        lost = [joint for joint in self.joints if joint not in found]
        if lost:
            raise ModelError(f"{self.name}: model.yaml has no torque map of joint '{lost[0]}'")
        maps = tuple(TorqueMap.of_document(found[joint], joint) for joint in self.joints)
        return replace(self, maps=maps)

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the learned torque of each joint as a regressor column, (N, n, P) [N m]."""
        link, tau = arm.link_motion(motion), np.zeros_like(motion.q)
        if self.maps:
            inputs = np.stack([link.q, link.dq, holding_torque(arm.body, link.q)], axis=-1)
            for joint, own in zip(self.indices(motion.joints), self.maps, strict=True):
                tau[:, joint] = own.torque(inputs[:, joint])
        return joint_columns(self, motion, tau)


def scaled_inputs(inputs: FloatArray, knee: float) -> FloatArray:
    """Return inputs (..., 3) with velocities scaled: linear below the knee, then logarithmic."""
    velocity = knee * np.arcsinh(inputs[..., 1] / knee)
    return np.stack([inputs[..., 0], velocity, inputs[..., 2]], axis=-1)


def holding_torque(robot: Robot, q: FloatArray) -> FloatArray:
    """Return the torques that hold the rigid body at rest at positions q, (..., n) [N m]."""
    poses = np.reshape(q, (-1, robot.n_joints))
    still = Motion.of_states(robot.joints, poses, 0.0, 0.0)
    return inverse_dynamics(robot, still).reshape(np.shape(q))
