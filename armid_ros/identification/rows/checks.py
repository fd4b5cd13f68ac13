# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of recordings before an identification: motion, limits, sign and unit of the torque."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.identification.rows.regression import Regression, REST_SPEED
from armid_ros.model import inverse_dynamics, regressor
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.recording.series import NOTHING
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter1d

#: A joint that stays within this range is at rest [rad or m].
REST_RANGE = 1e-3
#: Largest excess of a position over a limit that is no fault, as a share of the range: a stop
#: gives way, and an encoder has noise.
_LIMIT_SLACK = 0.01
#: Shortest recording that is long enough for a movement [s].
MIN_DURATION = 1.0
#: Correlation of measured and described torque above which their ratio is meaningful: four fifths
#: of the power are explained.
MIN_CORRELATION = 0.9
#: Units of torque that are mistaken for N m: number of units in 1 N m.
TORQUE_UNITS = {'N mm': 1e3, 'N cm': 1e2, 'kN m': 1e-3}
#: Units of torque, degrees for radians, and units of force on a lever. These are tested for all
#: joints at once, as a load may increase the torque of one joint tenfold.
_UNITS_OF_ALL = {
    **TORQUE_UNITS,
    'N m times 57.3 (degrees against radians)': float(np.rad2deg(1.0)),
    'kgf m': 1.0 / 9.80665,
    'kgf cm': 100.0 / 9.80665,
    'lbf in': 1.0 / 0.1129848,
}
#: Largest ratio between a factor of torques and the factor of their unit: masses of a description
#: are wrong by less.
MAX_UNIT_RATIO = 1.5
#: Unit of the force of a prismatic joint for each unit of torque.
FORCE_UNITS = {'N m': 'N', 'N mm': 'mN', 'N cm': 'cN', 'kN m': 'kN'}
#: Share of its top speed below which a joint may be held by friction with any torque.
SLOW_SHARE = 0.05
#: Message on torques that do not change.
SILENT = 'the torque of every joint is constant; fill in the effort of the joint states'


def check_motion(robot: Robot, recordings: Sequence[Recording]) -> tuple[str, ...]:
    """
    Return a note on joints at rest in recordings; raise an error if the motion is unusable.

    Raises
    ------
    IdentificationError
        If a recording is too short, positions are far out of the limits, or all joints rest.

    """
    for recording in recordings:
        check_positions(robot, recording.source, recording.q.min(axis=0), recording.q.max(axis=0))
        if recording.duration < MIN_DURATION:
            raise IdentificationError(
                f'{recording.source}: {recording.duration:.2f} s in {len(recording)} samples is '
                'too short; record a movement of several seconds; for a table, check '
                '--time-unit and --rate'
            )
    ranges = np.max([np.ptp(recording.q, axis=0) for recording in recordings], axis=0)
    return resting(robot, recordings[0].source, ranges)


def short_recording_note(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Return a note if the recordings last less than 5 s in total."""
    duration = sum(recording.duration for recording in recordings)
    return (f'{duration:.2g} s is short; record 20 s or more',) if duration < 5.0 else ()


def moving(motions: Iterable[Motion]) -> npt.NDArray[np.bool_]:
    """Return a mask (n,) of the joints that move in any of the given motions."""
    ranges = np.max([np.ptp(motion.q, axis=0) for motion in motions], axis=0)
    return np.asarray(ranges >= REST_RANGE)


def resting(robot: Robot, source: str, ranges: FloatArray) -> tuple[str, ...]:
    """Return a note on joints at rest, from position ranges (n,); raise an error if all rest."""
    names = [name for name, size in zip(robot.joints, ranges, strict=True) if size < REST_RANGE]
    if len(names) == robot.n_joints:
        raise IdentificationError(
            f'{source}: the arm does not move: every joint stays within {REST_RANGE} rad; record '
            'the arm while it follows an excitation'
        )
    if names:
        return (f'joints at rest: {", ".join(names)}; their own parameters are not identified',)
    return ()


def check_torque(
    arm: ArmModel, recordings: Sequence[Recording], problem: Sequence[Regression]
) -> tuple[str, ...]:
    """
    Return a note on constant torques; raise an error for torques that no arm model explains.

    The torque of the described links reveals sign and unit, if all comparable joints agree.
    Friction reveals the sign of the other joints.

    Raises
    ------
    IdentificationError
        For absent torques, wrong signs or units, or torques of a controller.

    """
    robot = arm.robot
    tau = np.concatenate([part.tau for part in problem])
    span, size = np.ptp(tau, axis=0), np.abs(tau).max(axis=0)
    # a smaller range is a rounding error
    constant = span <= np.maximum(NOTHING, 1e-9 * size)
    silent = [name for name, still in zip(robot.joints, constant, strict=True) if still]
    source = recordings[0].source
    if len(silent) == robot.n_joints:
        raise IdentificationError(f'{source}: {SILENT}')
    motions = [part.motion for part in problem]
    slope, correlation = torque_factors(ArmModel(robot), motions)
    clear = np.abs(correlation) > MIN_CORRELATION
    if np.sum(clear) >= min(2, robot.n_joints):
        factors = slope[clear]
        joints = ', '.join(np.array(robot.joints)[clear])
        if np.all(factors < 0.0):
            raise IdentificationError(
                f'{source}: torques of {joints} have the opposite sign of what the description '
                'predicts; positive is along the URDF joint axis. Negate them with --effort-scale '
                '-1, or leave this option out if it is given'
            )
        for unit, factor in TORQUE_UNITS.items():
            if np.all((factors > 0.5 * factor) & (factors < 2.0 * factor)):
                raise IdentificationError(
                    f'{source}: torques of {joints} are {np.median(factors):.3g} times what the '
                    f'description predicts; they are currents, or in {unit}: give --current-gain, '
                    'or convert them to N m'
                )
    driven = driven_by_friction(robot, motions)
    if driven:
        raise IdentificationError(f'{source}: {driven}')
    for part in problem:
        bag = part.source or 'recording'
        for fault in laws_of_controllers(robot, part.motion, part.informative):
            raise IdentificationError(f'{bag}: {fault}')
    if silent:
        return (f'joints with constant torque: {", ".join(silent)}',)
    return ()


def driven_by_friction(robot: Robot, motions: Sequence[Motion]) -> str:
    """
    Return a message on joints whose torque has the opposite sign of friction; empty if none.

    The described torque, weight and inertia are fitted per joint and subtracted. The residual of a
    wrist is friction, the only evidence for the sign of the wrist's torque.

    """
    found, whole = [], joined(motions)
    assert whole.tau is not None
    described = inverse_dynamics(robot, whole)
    for joint, name in enumerate(robot.joints):
        q, dq, ddq, tau = (x[:, joint] for x in (whole.q, whole.dq, whole.ddq, whole.tau))
        weight = [np.ones(len(q)), np.sin(q), np.cos(q)]
        held = np.column_stack([*weight, ddq, described[:, joint]])
        rest = residual_of_fit(np.column_stack([np.sign(dq), tau]), held)
        size = float(np.sqrt(np.prod(np.sum(rest**2, axis=0))))
        # correlation with the direction of motion above which a torque is friction alone
        if size > 0.0 and rest[:, 0] @ rest[:, 1] < -0.8 * size:
            found.append(name)
    if not found:
        return ''
    return (
        f'the torque of {", ".join(found)} has the opposite sign of friction. Negate the '
        'torque (positive is along the URDF joint axis), unless somebody moved the arm'
    )


def laws_of_controllers(
    robot: Robot, motion: Motion, informative: npt.NDArray[np.bool_]
) -> tuple[str, ...]:
    """
    Return messages if torques depend only on position and direction, like a controller's output.

    Gravity compensation outputs the weight of the arm while a hand moves it; energy shaping
    outputs a constant torque in the direction of motion. Such a torque does not contain the torque
    of inertia. A fit then attributes everything to friction, or finds an arm without mass. If only
    some joints have such a torque, the model lacks their inertia instead, and there is no message.

    The motion has R samples, with the torque filtered alike; `informative`, (R, n), is false where
    a joint is at rest. There is no message if at least half of the joints cannot be tested.

    """
    # samples where a joint reverses, and three on either side, which filters smear
    speed = np.abs(motion.dq)
    slow = speed <= REST_SPEED * speed.max(axis=0, initial=0.0)
    slow[1:] |= np.diff(np.sign(motion.dq), axis=0) != 0
    smeared = maximum_filter1d(slow, 7, axis=0, mode='constant')
    # 5000 samples are about sixty for every parameter of seven joints
    some = slice(None, None, max(1, len(motion) // 5000))
    informative = (informative & ~smeared)[some]
    motion = motion.select(some)
    assert motion.tau is not None
    weight, needed = regressor(robot, motion.at_rest()), inverse_dynamics(robot, motion)
    found: list[str] = []
    untested = 0
    for joint, (name, unit) in enumerate(zip(robot.joints, robot.torque_units, strict=True)):
        rows = informative[:, joint]
        tau = motion.tau[rows, joint]
        direction = np.sign(motion.dq[rows, joint])
        law = np.column_stack([weight[rows, joint], direction, np.ones_like(tau)])
        # with fewer samples, any torque follows a law of position and direction
        rank = int(np.linalg.matrix_rank(law)) if len(law) else 0
        if len(law) < 10 * max(rank, 1):
            untested += 1
            continue
        residual, lacking = (
            float(np.sqrt(np.sum(residual_of_fit(y, law) ** 2) / (len(law) - rank)))
            for y in (tau, needed[rows, joint])
        )
        size = float(np.sqrt(np.mean(tau**2)))
        # smallest torque of a driven joint as a share of the torque of the model. With a smaller
        # torque, the joint swings freely, or the model is wrong.
        if size < 0.5 * float(np.sqrt(np.mean(needed[rows, joint] ** 2))):
            continue
        # largest residual of the law, as a share of the torque: friction of a real joint depends
        # on speed, so it differs by more from a law without speed; and as a share of the torque
        # that the model needs in addition: no model has an inertia that is ten times too large
        if residual > 0.03 * size or residual > 0.1 * lacking:
            return ()
        found.append(
            f'the torque of {name} depends only on position and direction of motion, to '
            f'{100 * residual / size:.1f} %. A controller that carries the weight or assists the '
            f'motion causes such a torque; the {lacking:.2g} {unit} of the inertia are missing. '
            'Something else moves the arm, or body and friction cannot be distinguished: record '
            'the arm while it follows a trajectory'
        )
    return tuple(found) if len(found) > untested else ()


def check_positions(robot: Robot, source: str, lowest: FloatArray, highest: FloatArray) -> None:
    """Raise an error if positions of a joint are far outside its position limits."""
    problem = position_problem(robot, lowest, highest)
    if problem:
        raise IdentificationError(f'{source}: {problem}')


def position_problem(robot: Robot, lowest: FloatArray, highest: FloatArray) -> str:
    """Return a message on the joint farthest beyond its position limits; empty if none is far."""
    # largest excess of positions over the limits that is no wrong unit: two turns of a joint that
    # a controller lets spin [rad], or one metre [m]
    turning, sliding = 4.0 * np.pi, 1.0
    excess = np.maximum(robot.lower - lowest, highest - robot.upper)
    allowed = np.where(robot.prismatic, sliding, turning)
    worst = int(np.argmax(excess / allowed))
    if not excess[worst] > allowed[worst]:
        return ''
    reach = max(abs(lowest[worst]), abs(highest[worst]))
    # joints whose positions, taken as degrees, are within the limits
    slack = _LIMIT_SLACK * (robot.upper - robot.lower)
    degrees = np.deg2rad(lowest) > robot.lower - slack
    degrees &= ~robot.prismatic & (np.deg2rad(highest) < robot.upper + slack) & (excess > allowed)
    hint = '' if robot.prismatic[worst] or degrees[worst] else ' (degrees?)'
    text = f'{robot.joints[worst]} reaches {reach:.4g}{hint}, its'
    if degrees[worst]:
        names = ', '.join(np.array(robot.joints)[degrees])
        text = (
            f'{names} seem{"s" if degrees.sum() == 1 else ""} to be in degrees (--degrees): {text}'
        )
    return (
        f'{text} limits are {robot.lower[worst]:.4g} to {robot.upper[worst]:.4g} '
        f'{robot.position_units[worst]}; positions have to be in rad or m, with the zero of the '
        'description'
    )


def beyond_limits(robot: Robot, recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Return a note on joints that moved beyond their described position limits."""
    slack = _LIMIT_SLACK * (robot.upper - robot.lower)
    found = []
    for sign, limits, ends in (
        (-1.0, robot.lower, np.min([one.q.min(axis=0) for one in recordings], axis=0)),
        (1.0, robot.upper, np.max([one.q.max(axis=0) for one in recordings], axis=0)),
    ):
        found += [
            f'{robot.joints[j]} reaches {ends[j]:.4g} of {limits[j]:.4g} {robot.position_units[j]}'
            for j in np.flatnonzero(sign * (ends - limits) > slack)
        ]
    if not found:
        return ()
    return (
        f'positions beyond the described limits: {", ".join(found)}; check scale and zero of the '
        'positions, and the limits',
    )


def torque_factors(arm: ArmModel, motions: Sequence[Motion]) -> tuple[FloatArray, FloatArray]:
    """
    Return the ratio and the correlation of measured and modelled torque for each joint.

    An offset is fitted too, and friction if the model has no effects. With effects, only samples
    in motion are used, as friction holds a joint at rest with any torque.

    Returns
    -------
    factor, correlation : ndarray, shape (n,)
        Measured torque per modelled torque, and their correlation; 0 where there is no torque.

    """
    slope, correlation = np.zeros((2, arm.robot.n_joints))
    predicted = np.concatenate([arm.torque(motion) for motion in motions])
    whole = joined(motions)
    measured, dq = whole.tau, whole.dq
    assert measured is not None
    moves = np.abs(dq) >= SLOW_SHARE * np.abs(dq).max(axis=0)
    for joint in range(arm.robot.n_joints):
        pair = np.column_stack([predicted[:, joint], measured[:, joint]])
        speed = dq[:, joint]
        friction = [] if arm.effects else [speed, np.sign(speed)]
        nuisance = np.column_stack([np.ones(len(dq)), *friction])
        rows = moves[:, joint] if arm.effects else slice(None)
        rest = residual_of_fit(pair[rows], nuisance[rows])
        product, own, other = (float(rest[:, a] @ rest[:, b]) for a, b in ((0, 1), (0, 0), (1, 1)))
        if own > 0.0 and other > 0.0:
            slope[joint] = product / own
            correlation[joint] = product / np.sqrt(own * other)
    return slope, correlation


def joined(motions: Sequence[Motion]) -> Motion:
    """Join several motions with torques into one motion."""
    names = ('t', 'q', 'dq', 'ddq', 'tau')
    arrays = [np.concatenate([getattr(motion, name) for motion in motions]) for name in names]
    return Motion(motions[0].joints, *arrays)


def unit_of(factor: float, of_joints: Sequence[float] = (), near_force: float = 1.2) -> str:
    """
    Return the torque units that explain a ratio of measured to expected torque; '' if none.

    Parameters
    ----------
    factor : float
        Measured over expected torques of all joints together.
    of_joints : sequence of float
        Factors of single joints. A unit has to explain each factor; gains of currents differ.
    near_force : float
        Largest ratio between a factor and the factor of a unit of force on a lever. The latter
        are near gains of currents: 10 N m/A is 1.02 kgf m/A. Wrong masses change the factor of
        one joint by a fifth.

    """
    if factor <= 0.0:
        return ''
    distances = {}
    for unit, per in _UNITS_OF_ALL.items():
        near = np.log(near_force if unit.startswith(('kgf', 'lbf')) else MAX_UNIT_RATIO)
        apart = np.abs(np.log(np.array([factor, *of_joints]) / per)) / near
        if np.all(apart < 1.0):
            distances[unit] = float(apart[0])
    return ' or '.join(sorted(distances, key=distances.__getitem__))


def residual_of_fit(values: FloatArray, columns: FloatArray) -> FloatArray:
    """Return the residual of a least-squares fit of values, (N, ...), by columns, (N, k)."""
    return np.asarray(values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0])
