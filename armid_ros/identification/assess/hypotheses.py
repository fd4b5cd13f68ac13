# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Possible mistakes in a recording, each with a function that corrects the data.

`mistakes` accepts a hypothesis by its likelihood ratio against the data as recorded.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Literal

from armid_ros.arm import ArmModel
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.assess.prediction_error import common_values, thinned
from armid_ros.identification.rows.checks import FORCE_UNITS, torque_factors, TORQUE_UNITS, unit_of
from armid_ros.model import gravity_sensitivity, inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import GRAVITIES, Robot
import numpy as np

Quantity = Literal['position', 'torque', 'position and torque']
QUANTITIES: tuple[Quantity, ...] = ('position and torque', 'position', 'torque')


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """
    Possible mistake in a recording, and how to correct the data or the description.

    Attributes
    ----------
    kind : str
        Kind of mistake: body, gravity, scale (a factor of all torques), units (such a factor that
        is a unit), unit, degrees, sign, exchange, zero or delay.
    text : str
        Suspected mistake and remedy, without a full stop.
    motion : callable
        Function that returns a motion and its torque without the mistake.
    where : tuple
        Joints and quantity with the mistake.
    values : int
        Number of values that are fitted to the data.
    body : callable
        Function that returns the description without the mistake.
    nearby : callable
        Function that returns hypotheses with nearby values, in finer steps.

    """

    kind: str
    text: str
    motion: Callable[[Motion], Motion] = lambda motion: motion
    where: tuple[object, ...] = ()
    values: int = 1
    body: Callable[[Robot], Robot] = lambda robot: robot
    nearby: Callable[[], Sequence[Hypothesis]] = tuple

    @property
    def of_masses(self) -> bool:
        """Whether a common factor on all described masses would explain the data equally well."""
        return self.kind in ('gravity', 'scale', 'units')

    @property
    def of_data(self) -> bool:
        """Whether only faulty data, and not a changed arm, would explain the torques."""
        return self.kind in ('units', 'unit', 'degrees', 'sign', 'exchange')


AS_RECORDED = Hypothesis('nothing', 'the data have no mistake')
#: Hypothesis that the described links explain no torque, and friction and drives all of it.
WITHOUT_BODY = Hypothesis(
    'body',
    'the description does not explain the torques',
    body=lambda robot: robot.with_inertias(np.zeros_like(robot.rigid_parameters)),
)


def hypotheses(robot: Robot, motions: Sequence[Motion]) -> Iterator[Hypothesis]:
    """
    Yield possible mistakes in recorded motions as hypotheses to test, except torque delays.

    Only values beyond 2 pi are tested for degrees: even small angles in degrees exceed this.

    """
    turned = np.max([np.abs(one.q).max(axis=0) for one in motions], axis=0) > 2.0 * np.pi
    turned &= ~robot.prismatic
    yield from _gravity_and_scale(robot, motions)
    if np.any(turned):
        yield _in_degrees(robot)
    for joint, name in enumerate(robot.joints):
        for unit in TORQUE_UNITS:
            yield in_unit(robot, joint, unit)
        for quantity in QUANTITIES:
            text = f'the {quantity} of {name} seems to have the opposite sign: negate it'
            if quantity == 'position and torque':
                text = f'position and torque of {name} seem to have the opposite sign: negate both'
            change = _scaling(robot, quantity, joint, -1.0)
            yield Hypothesis('sign', text, change, (joint, quantity))
        if turned[joint] and robot.n_joints > 1:
            yield _in_degrees(robot, joint)
        # possible zero errors of an encoder, an axis or a description
        for degrees in () if robot.prismatic[joint] else (-135, -90, -45, 45, 90, 135, 180):
            yield _zero_off(robot, joint, degrees)
    for first, second in combinations(range(robot.n_joints), 2):
        matrix = np.eye(robot.n_joints)
        matrix[[first, second]] = matrix[[second, first]]
        for quantity in QUANTITIES:
            yield Hypothesis(
                'exchange',
                f'the {quantity} of {robot.joints[first]} and of {robot.joints[second]} seem to '
                'be exchanged: check the names of the joints',
                partial(_transformed, quantity, matrix),
                (first, second, quantity),
            )


def _gravity_and_scale(robot: Robot, motions: Sequence[Motion]) -> Iterator[Hypothesis]:
    """Yield hypotheses: another gravity vector, and a wrong common factor of all torques."""
    motion = thinned(motions, 600)
    if motion is None:
        return
    described = inverse_dynamics(robot, motion)
    weightless = inverse_dynamics(robot.with_gravity(np.zeros(3)), motion)
    by_gravity = gravity_sensitivity(robot, motion.q)
    found = other_gravity(robot, common_values(motion, weightless, by_gravity))
    if found is not None:
        yield found
    nothing, column = np.zeros_like(described), described[:, :, np.newaxis]
    factor = float(common_values(motion, nothing, column)[0])
    if abs(factor) <= np.finfo(float).tiny or not _beyond_masses(factor):
        return
    # the efforts may be in another unit than N m, or currents
    factors, correlation = torque_factors(ArmModel(robot), motions)
    # smallest correlation for a reliable factor of a joint: the residual is below 15 % of torque
    known = (correlation > 0.989) & (factors > 0.0)
    unit = unit_of(factor, factors[known].tolist())
    text = (
        f'the efforts of all joints seem to be in {unit} instead of N m: convert them'
        if unit
        else f'the efforts of all joints seem to be {factor:.2g} times the torque in N m: '
        'currents, or wrong masses in the description'
    )
    if known.any() and not unit:
        shown = zip(factors, known, strict=True)
        gains = ','.join(f'{1.0 / one:.3g}' if clear else '?' for one, clear in shown)
        hidden = ', '.join(robot.joints[k] for k in np.flatnonzero(~known))
        text += f'; for currents give --current-gain {gains}, which is as accurate as those masses'
        text += f'; the factor of {hidden} is not determined' if hidden else ''
    scaled = _scaling(robot, 'torque', slice(None), 1.0 / factor)
    yield Hypothesis('units' if unit else 'scale', text, scaled)


def in_unit(robot: Robot, joint: int, unit: str) -> Hypothesis:
    """Return the hypothesis that a joint's torque was recorded in a given wrong unit."""
    wrong = FORCE_UNITS[unit] if robot.prismatic[joint] else unit
    right = robot.torque_units[joint]
    return Hypothesis(
        'unit',
        f'the torque of {robot.joints[joint]} seems to be in {wrong} instead of {right}: '
        'convert it',
        _scaling(robot, 'torque', joint, 1.0 / TORQUE_UNITS[unit]),
        (joint, unit),
    )


def delayed(seconds: float, half_width: float) -> Hypothesis:
    """Return the hypothesis that torques lag positions by `seconds` ± `half_width` (95 %)."""
    side = 'later' if seconds > 0.0 else 'earlier'
    return Hypothesis(
        'delay',
        f'the torque seems to come about {1e3 * abs(seconds):.0f} ms {side} than the '
        f'position (± {np.ceil(1e3 * half_width):.0f} ms): give both the same time stamps',
        lambda motion: shifted(motion, seconds),
    )


def shifted(motion: Motion, seconds: float) -> Motion:
    """
    Delay the positions of a motion by `seconds`, as its torques are delayed.

    The torque is not interpolated, as this would reduce its noise.

    """
    t = motion.t - seconds
    inside = (t >= motion.t[0]) & (t <= motion.t[-1])
    q, dq, ddq = (
        np.column_stack([np.interp(t, motion.t, column) for column in x.T])
        for x in (motion.q, motion.dq, motion.ddq)
    )
    return replace(motion, q=q, dq=dq, ddq=ddq).select(inside)


def other_gravity(robot: Robot, vector: FloatArray) -> Hypothesis | None:
    """
    Return the hypothesis that gravity has another direction or size than described.

    A fitted vector near a known vector is replaced by the known vector, such as the described
    gravity along another axis.

    Parameters
    ----------
    robot : Robot
        The description.
    vector : ndarray, shape (3,)
        Gravity vector that fits the data [m/s^2].

    Returns
    -------
    Hypothesis or None
        None if no planet has such gravity, or if wrong masses may explain the difference. Wrong
        masses change the size of the fitted gravity, but not its direction.

    """
    described = robot.gravity
    size, length = (float(np.linalg.norm(one)) for one in (described, vector))
    turned = np.linalg.norm(vector / max(length, 1e-9) - described / max(size, 1e-9))
    weighs = length / size if size > 0.0 else np.inf
    if np.linalg.norm(vector - described) <= LIMITS.gravity_change * max(size, 1.0):
        return None
    # 24.8 m/s^2 is the gravity of Jupiter, the largest of a planet
    if length >= 24.8 or (turned <= LIMITS.gravity_change and not _beyond_masses(weighs)):
        return None
    known = {name: np.array(value) for name, value in GRAVITIES.items()}
    for axis in size * np.concatenate([np.eye(3), -np.eye(3)]):
        known.setdefault(','.join(f'{part:.3g}' for part in axis + 0.0), axis)
    off = {
        name: float(np.linalg.norm(vector - value)) / max(float(np.linalg.norm(value)), 1e-9)
        for name, value in known.items()
    }
    option, nearest = min(off, key=off.__getitem__), vector
    # largest distance of a gravity vector from the known vector that replaces it, over its length
    if off[option] < 0.3:
        nearest = known[option]
    else:
        # wrong masses change the length of the fitted vector, but not its direction
        if not _beyond_masses(weighs):
            nearest = vector * (size / length)
        option = ','.join(f'{part:.4g}' for part in nearest + 0.0)
    strength = max(float(np.linalg.norm(nearest)), 1e-9)
    direction = ', '.join(f'{part + 0.0:.3g}' for part in nearest / strength)
    # 5 %: more than the fit is off if all masses are right
    wrong = abs(length / strength - 1.0) > 0.05
    masses = f' (fitted: {length:.3g}, so masses may be wrong too)' if wrong else ''
    return Hypothesis(
        'gravity',
        f'gravity seems to act along ({direction}) of the base with {strength:.3g} m/s^2{masses}: '
        f'--gravity {option}',
        body=lambda robot: robot.with_gravity(vector),
        values=3,
    )


def _zero_off(robot: Robot, joint: int, degrees: float) -> Hypothesis:
    """Return the hypothesis that a joint's encoder zero is wrong by an angle [deg]."""
    shift = np.zeros(robot.n_joints)
    shift[joint] = -np.deg2rad(degrees)
    wrong = 180.0 - (180.0 - degrees) % 360.0
    remedy = f'{"subtract" if wrong > 0 else "add"} {np.deg2rad(abs(wrong)):.4g} rad'
    return Hypothesis(
        'zero',
        f'the zero of {robot.joints[joint]} seems to be off by about {wrong:.0f} degrees: '
        f'{remedy}',
        lambda motion: replace(motion, q=motion.q + shift),
        (joint,),
        nearby=lambda: [_zero_off(robot, joint, degrees + step) for step in (-15.0, 15.0)],
    )


def _in_degrees(robot: Robot, joint: int | None = None) -> Hypothesis:
    """Return the hypothesis that the positions of one joint, or of all joints, are in degrees."""
    text = 'the positions seem to be in degrees: convert them to rad'
    if joint is not None:
        text = f'the position of {robot.joints[joint]} seems to be in degrees: convert it to rad'
    change = _scaling(robot, 'position', slice(None) if joint is None else joint, np.deg2rad(1.0))
    return Hypothesis('degrees', text, change, (joint,))


def _beyond_masses(factor: float) -> bool:
    """Return whether a factor on all torques is too far from 1 to be due to wrong masses."""
    return not 1.0 / LIMITS.torque_factor < factor < LIMITS.torque_factor


def _scaling(
    robot: Robot, quantity: Quantity, joint: int | slice, factor: float
) -> Callable[[Motion], Motion]:
    """Return a function that scales positions, torques or both of some joints in a motion."""
    scale = np.ones(robot.n_joints)
    scale[joint] = factor
    return partial(_transformed, quantity, np.diag(scale))


def _transformed(quantity: Quantity, matrix: FloatArray, motion: Motion) -> Motion:
    """Return a motion whose positions, torques or both are multiplied by a matrix, (n, n)."""
    if quantity != 'torque':
        q, dq, ddq = (x @ matrix for x in (motion.q, motion.dq, motion.ddq))
        motion = replace(motion, q=q, dq=dq, ddq=ddq)
    if quantity != 'position':
        assert motion.tau is not None
        motion = motion.with_torque(motion.tau @ matrix)
    return motion
