# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a hypothesis of a fault of data is; `hypotheses` has them all."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from typing import ClassVar, Literal

from armid_ros.identification.assess.grade_limits import GradeLimits
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np

Quantity = Literal['position', 'torque', 'position and torque']


class Hypothesis(ABC):
    """
    One thing that may be wrong with a recording.

    Attributes
    ----------
    values : int
        Numbers that are chosen to fit the data.
    of_masses : bool
        Whether masses that are all off by one factor do the same: `material` says from where on
        they cannot be.

    """

    values: ClassVar[int] = 1
    of_masses: ClassVar[bool] = False

    @property
    def disputable(self) -> bool:
        """Whether other masses would explain as much, so that a person has to say which it is."""
        return False

    @property
    def kind(self) -> tuple[object, ...]:
        """Return what is wrong and where, without by how much."""
        parts = (getattr(self, part.name) for part in fields(self) if part.compare)  # type: ignore
        return (type(self).__name__, *(v for v in parts if not isinstance(v, float | tuple)))

    def possible(self, motions: Sequence[Motion]) -> bool:
        """Return whether recorded motions allow it at all."""
        return True

    def motion(self, motion: Motion) -> Motion:
        """Return a motion and its torque as they would be without the mistake."""
        return motion

    def stretches(self, stretches: Sequence[Motion]) -> list[Motion]:
        """Return all of a recording as it would be without the mistake."""
        return [self.motion(motion) for motion in stretches]

    def torque(self, robot: Robot, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """
        Return what the described body takes along the changed motion.

        Returns
        -------
        fixed : ndarray, shape (N, n)
            Torque that is known [N m].
        columns : ndarray, shape (N, n, k)
            What free values are multiplied by.

        """
        return inverse_dynamics(robot, motion), np.empty((*motion.q.shape, 0))

    def settled(self, values: FloatArray) -> Hypothesis:
        """Return the hypothesis with the free values that fit."""
        return self

    def detailed(self, robot: Robot, motions: Sequence[Motion]) -> Hypothesis:
        """Return the hypothesis with what is of interest once it is believed."""
        return self

    def nearby(self) -> Iterator[Hypothesis]:
        """Yield finer steps of the same kind."""
        return iter(())

    def material(self, robot: Robot, limits: GradeLimits) -> bool:
        """Whether the description cannot be what is wrong instead."""
        return True

    @abstractmethod
    def sentence(self, robot: Robot) -> str:
        """Say what seems to be wrong and what to do, without a full stop."""


def scaled(motion: Motion, joint: int | slice, quantity: Quantity, factor: float) -> Motion:
    """Return a motion in which a quantity of one joint, or of some, is multiplied."""
    scale = np.ones(motion.n_joints)
    scale[joint] = factor
    return changed(motion, quantity, lambda values: values * scale)


def changed(
    motion: Motion, quantity: Quantity, change: Callable[[FloatArray], FloatArray]
) -> Motion:
    """Return a motion with a change of a quantity."""
    if quantity != 'torque':
        motion = replace(motion, q=change(motion.q), dq=change(motion.dq), ddq=change(motion.ddq))
    if quantity != 'position':
        assert motion.tau is not None
        motion = motion.with_torque(change(motion.tau))
    return motion
