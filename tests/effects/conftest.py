# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The shipped arm, a smooth motion of it, and the arm with one effect."""

from collections.abc import Callable
from functools import partial

from armid_ros.arm import ArmModel, testing
from armid_ros.effects import make_effect
from armid_ros.motion import Motion
import numpy as np
import numpy.typing as npt
import pytest


@pytest.fixture(scope='session')
def sines(robot) -> Callable[..., Motion]:
    """Return a maker of motions in sines, different ones in every joint, without torque."""
    return partial(testing.sines, robot)


@pytest.fixture(scope='session')
def motion(sines) -> Motion:
    """Return a motion of half a second at 200 Hz."""
    return sines()


@pytest.fixture(scope='session')
def with_values(robot) -> Callable[..., ArmModel]:
    """Return a maker of the arm with one effect; a single value is used for all parameters."""

    def make(text: str, values: npt.ArrayLike, shape: npt.ArrayLike | None = None) -> ArmModel:
        effect = make_effect(text, robot)
        if shape is not None:
            effect = effect.with_shape(shape)
        count = len(effect.parameters(robot))
        return ArmModel(robot).with_effect(effect, np.resize(values, count))

    return make


@pytest.fixture(scope='session')
def added(with_values) -> Callable[..., npt.NDArray[np.float64]]:
    """Return a function that computes the torque of one effect along a motion."""

    def add(
        motion: Motion, text: str, values: npt.ArrayLike, shape: npt.ArrayLike | None = None
    ) -> npt.NDArray[np.float64]:
        arm = with_values(text, values, shape)
        return np.asarray(arm.torque(motion) - ArmModel(arm.robot).torque(motion))

    return add
