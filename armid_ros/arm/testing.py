# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Checks that an effect class keeps the contract of effects, for tests of own effects.

In a test of a package that provides an effect::

    from armid_ros.arm.testing import check_effect

    def test_hose_keeps_the_contract():
        check_effect(Hose)

Simulation, identification and diagnosis depend only on the checked properties. Each check is a
function of an ``EffectCase`` that raises AssertionError. ``CHECKS`` contains all checks.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
import pickle

from armid_ros.arm.arm_model import ArmModel
from armid_ros.effects.base import Effect, Unexplained
from armid_ros.effects.catalogue import check_kind
from armid_ros.motion import FloatArray, Motion, Temperatures
from armid_ros.robots import load_robot, Robot
import numpy as np
import numpy.typing as npt

#: Step of the finite differences.
_STEP = 1e-6


@dataclass(frozen=True)
class EffectCase:
    """
    Test case of an effect: robot, parameter values and motion.

    Attributes
    ----------
    effect : Effect
        The effect on all its default joints.
    robot : Robot
        The arm.
    motion : Motion
        N samples of sine motions, with a measured torque.
    values : ndarray, shape (P,)
        Typical values, of both signs if both are possible.

    """

    effect: Effect
    robot: Robot
    motion: Motion
    values: FloatArray

    @classmethod
    def of(
        cls,
        kind: type[Effect],
        robot: Robot | None = None,
        *,
        size: npt.ArrayLike | None = None,
        seed: int = 3,
    ) -> EffectCase:
        """
        Create a test case for an effect class, with random values and a smooth motion.

        Parameters
        ----------
        kind : type of Effect
            The class of the effect.
        robot : Robot, optional
            The arm; by default the shipped humanoid_arm.
        size : array_like, optional
            Size of each quantity; by default the geometric mean of the typical range.
        seed : int
            Seed of values and torque.

        """
        robot = robot or load_robot('humanoid_arm')
        effect, rng = kind.on(robot), np.random.default_rng(seed)
        motion = sines(robot)
        motion = motion.with_torque(rng.normal(scale=20.0, size=motion.q.shape))
        warm_up = np.tile(np.linspace(20.0, 60.0, len(motion)), (motion.n_joints, 1)).T
        motion = replace(motion, temperature=Temperatures(motion.t, warm_up))
        if size is None:
            # size of a quantity without a typical size
            size = [np.sqrt(np.prod(q.typical)) if q.typical else 0.1 for q in kind.quantities]
        count = len(effect.parameters(robot))
        lower = np.resize([q.lower for q in kind.quantities], count)
        sign = np.where(lower < 0.0, rng.choice([-1.0, 1.0], count), 1.0)
        values = sign * np.resize(size, count) * rng.uniform(0.7, 1.3, count)
        return cls(effect, robot, motion, np.clip(values, *effect.bounds()))

    def arm(self, values: npt.ArrayLike) -> ArmModel:
        """Return the arm model with the effect, at given parameter values."""
        return ArmModel(self.robot).with_effect(self.effect, values)

    def torque(self, values: FloatArray) -> FloatArray:
        """Return the torque of the arm with the effect, along the motion, shape (N, n)."""
        return np.asarray(self.arm(values).torque(self.motion))


def sines(robot: Robot, duration: float = 0.5, rate: float = 200.0) -> Motion:
    """Return a motion in which joints follow sines of different frequencies in their limits."""
    t = np.arange(0.0, duration, 1.0 / rate)
    frequency = 2.0 * np.pi * np.linspace(0.4, 2.1, robot.n_joints)
    phase = frequency * t[:, np.newaxis] + np.arange(robot.n_joints)
    bounded = np.isfinite(robot.upper - robot.lower)
    lower, upper = np.where(bounded, robot.lower, -1.0), np.where(bounded, robot.upper, 1.0)
    amplitude = 0.45 * (upper - lower)
    return Motion(
        robot.joints,
        t,
        (lower + upper) / 2 + amplitude * np.sin(phase),
        amplitude * frequency * np.cos(phase),
        -amplitude * frequency**2 * np.sin(phase),
    )


def check_effect(kind: type[Effect], robot: Robot | None = None) -> None:
    """
    Raise AssertionError if an effect class does not fulfil the contract of `Effect`.

    Parameters
    ----------
    kind : type of Effect
        The class of the effect; it need not be registered.
    robot : Robot, optional
        An arm for which the effect is made; a shipped arm by default.

    Raises
    ------
    AssertionError
        If a check fails; the message names all faults.
    ModelError
        If the class lacks a required attribute.

    Examples
    --------
    >>> from armid_ros.effects import CATALOGUE
    >>> from armid_ros.arm.testing import check_effect
    >>> check_effect(CATALOGUE['viscous_friction'])

    """
    check_kind(kind)
    trial = EffectCase.of(kind, robot)
    wrong = []
    for check in CHECKS:
        try:
            check(trial)
        except Exception as fault:  # a user-defined effect may raise any exception
            reason = ' '.join(str(fault).split())
            kind_of_fault = '' if isinstance(fault, AssertionError) else type(fault).__name__ + ' '
            wrong.append(f'{check.__name__.replace("_", " ")}: {kind_of_fault}{reason}')
    if wrong:
        raise AssertionError(f'the effect {kind.name} fails the checks: {"; ".join(wrong)}')


def docstring_bounds_and_names_are_valid(trial: EffectCase) -> None:
    """Fail if the effect class lacks a docstring, valid bounds or distinct parameter names."""
    kind = type(trial.effect)
    assert kind.__doc__ and not kind.__doc__.startswith(f'{kind.__name__}('), 'it has no docstring'
    for quantity in kind.quantities:
        assert quantity.lower < quantity.upper, f'{quantity.name} has no range'
        if quantity.typical is not None:
            smallest, largest = quantity.typical
            within = 0.0 < smallest < largest <= quantity.upper
            assert within, f'typical sizes of {quantity.name} are {quantity.typical}'
    names = [(p.name, p.joint) for p in trial.effect.parameters(trial.robot)]
    assert len(set(names)) == len(names), f'parameters share a name: {names}'
    assert len(names) == len(trial.effect.bounds()[0]), 'bounds() needs one bound per parameter'


def columns_are_finite_and_one_per_parameter(trial: EffectCase) -> None:
    """Fail if the columns of the effect are not finite, or are not of shape (N, n, P)."""
    columns = ArmModel(trial.robot).columns_of(trial.effect, trial.motion)
    assert np.all(np.isfinite(columns)), 'columns are not finite'


def size_zero_changes_nothing(trial: EffectCase) -> None:
    """Fail if the effect changes the torque when its parameters are zero."""
    bare = ArmModel(trial.robot).torque(trial.motion)
    np.testing.assert_allclose(trial.torque(0.0 * trial.values), bare, atol=1e-12)


def columns_are_the_derivative_at_zero(trial: EffectCase) -> None:
    """Fail if ``columns`` is not the torque derivative when all parameters are zero."""
    columns = ArmModel(trial.robot).columns_of(trial.effect, trial.motion)
    _compare(trial, np.zeros_like(trial.values), columns)


def columns_are_the_derivative_at_any_size(trial: EffectCase) -> None:
    """Fail if ``columns`` is not the torque derivative at typical parameter values."""
    columns = trial.arm(trial.values).columns(trial.motion)
    _compare(trial, trial.values, columns[:, :, -len(trial.values) :])


def linear_means_exact(trial: EffectCase) -> None:
    """Fail if the torque of a linear effect differs from columns times parameter values."""
    if trial.effect.linear:
        bare = ArmModel(trial.robot)
        columns = bare.columns_of(trial.effect, trial.motion)
        expected = bare.torque(trial.motion) + columns @ trial.values
        size = 1.0 + np.abs(expected).max()
        np.testing.assert_allclose(trial.torque(trial.values), expected, atol=1e-9 * size)


def instantaneous_means_sample_by_sample(trial: EffectCase) -> None:
    """Fail if the columns of an instantaneous effect depend on neighbouring samples."""
    if trial.effect.instantaneous:
        arm, part = ArmModel(trial.robot), slice(40, 60)
        whole = arm.columns_of(trial.effect, trial.motion)[part]
        alone = arm.columns_of(trial.effect, trial.motion.select(part))
        size = 1.0 + np.abs(whole).max()
        np.testing.assert_allclose(alone, whole, atol=1e-9 * size)


def shapes_stay_possible(trial: EffectCase) -> None:
    """Fail if default or start values of shape parameters are outside their bounds."""
    effect, motion = trial.effect, trial.motion
    assert motion.tau is not None
    nothing = np.zeros((*motion.q.shape, 0))
    unexplained = Unexplained(motion, motion.q, motion.tau, np.ones_like(motion.q), nothing)
    grids = effect.shape_starts(unexplained, ArmModel(trial.robot))
    assert effect.shape_values.shape == (len(effect.owners), len(effect.shapes))
    for column, (shape, grid) in enumerate(zip(effect.shapes, grids, strict=True)):
        assert len(grid) == len(effect.owners), f'{shape.name}: a grid has a row per owner'
        for value in (effect.shape_values[:, column], grid):
            inside = np.all((shape.lower <= value) & (value <= shape.upper))
            assert inside, f'{shape.name}: {value} is beyond its bounds'


def effect_can_be_pickled(trial: EffectCase) -> None:
    """Fail if the effect cannot be pickled, as needed to send it to other processes."""
    assert pickle.loads(pickle.dumps(trial.effect)) == trial.effect


def _compare(trial: EffectCase, values: FloatArray, columns: FloatArray) -> None:
    """Fail if the columns of an effect differ from finite differences of the torque."""
    lower, _ = trial.effect.bounds()
    for parameter, step in enumerate(_STEP * np.eye(len(values))):
        if values[parameter] - _STEP > lower[parameter]:
            difference = trial.torque(values + step) - trial.torque(values - step)
        else:
            near, far = trial.torque(values + step), trial.torque(values + 2.0 * step)
            difference = 4.0 * near - far - 3.0 * trial.torque(values)
        wanted = columns[:, :, parameter]
        size = 1.0 + np.abs(wanted).max()
        np.testing.assert_allclose(
            difference / (2.0 * _STEP), wanted, atol=2e-5 * size, err_msg='columns'
        )


#: All checks, in order.
CHECKS: tuple[Callable[[EffectCase], None], ...] = (
    docstring_bounds_and_names_are_valid,
    columns_are_finite_and_one_per_parameter,
    size_zero_changes_nothing,
    columns_are_the_derivative_at_zero,
    columns_are_the_derivative_at_any_size,
    linear_means_exact,
    instantaneous_means_sample_by_sample,
    shapes_stay_possible,
    effect_can_be_pickled,
)
