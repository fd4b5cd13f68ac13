# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Static poses that determine zeros, gains, gravity and tool, and a closed tour through them.

The tour has for each pose a transfer, a rest, a short motion beyond it and back, and another rest.
The arm thus reaches each pose from both sides. A Gaussian filter smooths the tour, so it keeps all
limits. The tour is a Fourier series, so the publisher plays it like any `Excitation`.

"""

from __future__ import annotations

from dataclasses import replace

from armid_ros import ArmModel, Robot
from armid_ros.api.excitation import ExcitationResult
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    CollisionScene,
    DesignProblem,
    DesignSettings,
    evaluate,
    FourierTrajectory,
    Limits,
    trajectory_faults,
    TransferPlanner,
)
from armid_ros.excitation.problem import torque_noise
from armid_ros.motion import FloatArray, Motion
from armid_ros.zero.fit import arm_at_rest
import numpy as np

#: Distance of the motion beyond a pose and back [rad or m].
_OVERSHOOT = 0.1


def plan_zero(
    robot: Robot,
    scene: CollisionScene,
    *,
    poses: int = 16,
    hold: float = 3.0,
    seed: int = 0,
) -> ExcitationResult:
    """
    Plan a motion through several static poses, with rests of `hold` [s] in each pose.

    The tour approaches each pose from each free side. `seed` is the seed of the random poses.
    TrajectoryError: too few poses are free, or no tour is found.

    """
    arm, model, rng = ArmModel(robot), arm_at_rest(robot), np.random.default_rng(seed)
    settings = DesignSettings(clearance=scene.clearance, n_periods=1, target='effects')
    limits = Limits.of(robot, speed=1.0)
    planner = TransferPlanner.of(arm, scene, settings.speed)
    assert planner.limits is not None and planner.clearance is not None
    inside = replace(planner.limits, lower=limits.lower, upper=limits.upper)
    # 50 % more, as the filter shortens the motion
    reserve = replace(planner.clearance, margin=1.5 * scene.clearance)
    careful = replace(planner, limits=inside, clearance=reserve)
    chosen = _poses(careful, inside, model, poses, torque_noise(arm, settings), rng)
    trajectory = _tour(careful, inside, chosen, hold)
    faults = trajectory_faults(arm, limits, trajectory, planner.clearance)
    if faults:
        raise TrajectoryError(f'no path through all poses: {faults}; try another --seed')
    settings = replace(settings, period=trajectory.period, harmonics=trajectory.harmonics)
    core = evaluate(DesignProblem.of(model, settings, rng), trajectory)
    return ExcitationResult(core, arm, scene, seed=seed)


def _poses(
    planner: TransferPlanner,
    limits: Limits,
    model: ArmModel,
    count: int,
    noise: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """
    Return the most informative collision-free poses in the order of a short path, (count, n).

    The determinant of the information on all effects is maximised, pose by pose and then by
    exchange. Source: Fedorov 1972.

    """
    robot = model.robot
    lower, upper = limits.position_range()
    turn = np.where(robot.prismatic, np.inf, np.pi)  # gravity torque is periodic with a full turn
    lower, upper = np.maximum(lower, -turn), np.minimum(upper, turn)
    room = np.minimum(_OVERSHOOT, 0.1 * (upper - lower))
    drawn = rng.uniform(lower + room, upper - room, (400, robot.n_joints))
    free = np.array([q for q in drawn if not planner.fault(q)])
    if len(free) < count:
        reason = next(filter(None, map(planner.fault, drawn)))
        raise TrajectoryError(
            f'only {len(free)} of {len(drawn)} random poses are valid, and {count} are needed: '
            f'{reason}; reduce --poses, or give the arm more free space'
        )
    sides = [Motion.of_states(robot.joints, free, side, 0.0) for side in (-1.0, 1.0)]
    columns = np.concatenate([model.effect_columns(side) for side in sides], axis=1)
    columns /= np.tile(noise, 2)[:, np.newaxis]
    size = np.sqrt(np.mean(columns**2, axis=(0, 1)))
    columns = columns[:, :, size > 0.0] / size[size > 0.0]
    each = np.einsum('cjp,cjr->cpr', columns, columns)
    chosen: list[int] = []
    for step in range(3 * count):  # each pose is exchanged twice
        chosen = chosen[step >= count :]
        total = each[chosen].sum(axis=0) + 1e-6 * np.eye(each.shape[1])
        gain = np.linalg.slogdet(total + each)[1]
        gain[chosen] = -np.inf
        chosen.append(int(np.argmax(gain)))
    remaining, order = list(free[chosen]), [planner.free_start()]
    while remaining:  # the nearest pose next
        times = [(np.abs(q - order[-1]) / limits.velocity).max() for q in remaining]
        order.append(remaining.pop(int(np.argmin(times))))
    return np.array(order[1:])


def _tour(
    planner: TransferPlanner, limits: Limits, poses: FloatArray, hold: float
) -> FourierTrajectory:
    """Return a closed trajectory with rests of `hold` [s] in each reachable pose."""
    rate, smoothing = 20.0, 0.5  # [Hz], and standard deviation of the filter [s]
    # the filter moves the arm for three standard deviations at either end of a rest
    count = round((hold + 6.0 * smoothing) * rate)
    u = np.linspace(0.0, 1.0, round(4.0 * rate), endpoint=False)[:, np.newaxis]  # 4 s
    bump = (4.0 * u * (1.0 - u)) ** 4  # begins and ends smoothly
    now, reason = poses[0], ''
    parts: list[FloatArray] = []
    for pose in (*poses[1:], poses[0]):
        try:
            way = planner(now, pose)
        except TrajectoryError as error:
            reason = str(error)
            continue
        now, rest = pose, np.tile(pose, (count, 1))
        parts += [way.at(np.arange(0.0, way.duration, 1.0 / rate)).q, rest]
        over = pose + np.where(way.q[-1] < way.q[-2], -_OVERSHOOT, _OVERSHOOT)
        over = np.clip(over, limits.lower, limits.upper)
        if not planner.fault(over):
            parts += [pose + bump * (over - pose), rest]
    if not np.array_equal(now, poses[0]):
        raise TrajectoryError(f'no path back to the first pose: {reason}; try another --seed')
    q = np.roll(np.concatenate(parts), count // 2, axis=0)  # begins and ends in a rest
    q = np.concatenate([q, np.tile(q[-1], (-len(q) % int(rate), 1))])  # whole seconds
    period = len(q) / rate
    # up to 0.7 Hz, which the filter reduces to a tenth of its amplitude
    w = 2.0 * np.pi / period * np.arange(1, round(0.7 * period) + 1)
    waves = np.fft.rfft(q, axis=0)[: len(w) + 1].T / len(q)
    series = 2.0 * w * waves[:, 1:] * np.exp(-0.5 * (smoothing * w) ** 2)
    return FourierTrajectory(limits.joints, period, waves[:, 0].real, -series.imag, -series.real)
