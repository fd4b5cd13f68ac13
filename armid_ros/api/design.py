# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Search for a trajectory that makes the parameters identifiable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from armid_ros.api.arguments import drivable, RecordingLike, recordings_of, Rng, RobotLike
from armid_ros.api.excitation import ExcitationResult, WAYPOINT_RATE
from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    CollisionScene,
    design,
    DesignProblem,
    DesignSettings,
    Progress,
    TransferPlanner,
    whole_period,
    with_joint_limits,
)
from armid_ros.excitation.limits import with_acceleration_limit
from armid_ros.identification import SignalSettings
from armid_ros.identification.rows.signals import conditioning, segments
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np


def design_excitation(
    arm: RobotLike,
    *,
    duration: float = 24.0,
    periods: int = 2,
    rng: Rng = 0,
    floor: str | float | None = None,
    environment: str | Path | None = None,
    joint_limits: str | Path | Mapping[str, float] | None = None,
    scene: CollisionScene | None = None,
    start: FloatArray | None = None,
    after: RecordingLike | Sequence[RecordingLike] = (),
    rival: ArmModel | None = None,
    progress: Progress = lambda done, cost: None,
    speed: str | float = 'fast',
    criterion: str = 'D',
    target: str = 'all',
    focus: tuple[str, ...] = (),
    harmonics: int = 5,
    acceleration: FloatArray | None = None,
    noise: FloatArray | None = None,
    clearance: float = 0.01,
    starts: int | None = None,
    iterations: int = 200,
    candidates: int = 60,
    time_budget: float | None = None,
) -> ExcitationResult:
    """
    Find a trajectory that makes the parameters identifiable, without collisions, inside limits.

    Arm, floor and surroundings are checked as by ``armid excite``.

    Parameters
    ----------
    arm : model, robot, name or path
        The model to identify.
    duration : float
        Duration of the whole run [s].
    periods : int
        Number of equal periods; the difference of two is the noise floor.
    rng : int or Generator
        Seed, or source of randomness.
    floor : str or float, optional
        Height of the floor above the origin of the base [m], or 'none'; by default the height
        shipped with the robot, or the base plane of a standing arm.
    environment : str or Path, optional
        YAML file of obstacles around the arm, or a planning scene of MoveIt.
    joint_limits : str, Path or mapping of str to float, optional
        ``joint_limits.yaml`` of MoveIt (position, velocity, acceleration), or velocity limits by
        name [rad/s or m/s]. A joint without limit gets a low one, which the summary names.
    scene : CollisionScene, optional
        Bodies, floor and surroundings, in place of ``floor`` and ``environment``.
    start : ndarray, shape (n,), optional
        Pose to leave from and to return to [rad or m]; the free pose nearest to zero by default.
    after : recording or path, or several
        Earlier recordings; the trajectory adds to their information.
    rival : ArmModel, optional
        With ``criterion='T'``: model with the rival effects in place of those of ``arm``.
    progress : callable
        Called with the share of the search that is done, and the cost of the best trajectory.
    speed : str or float
        'slow', 'medium', 'fast' or a share of the velocity and acceleration limits.
    criterion : {'D', 'A', 'E', 'condition', 'T'}
        Criterion to optimise; 'T' distinguishes the arm from ``rival``.
    target : {'all', 'gravity', 'effects'}
        Parameters that count in the criterion.
    focus : tuple of str
        Names of effects to identify best, while all other parameters are fitted too.
    harmonics : int
        Fourier harmonics per joint.
    acceleration, noise : ndarray, shape (n,)
        Acceleration limits [rad/s^2 or m/s^2], by default the top speed per 0.25 s; standard
        deviation of the torque noise [N m or N], by default 1 % of the torque limits.
    clearance : float
        Distance to keep between bodies that may touch [m].
    starts, iterations, candidates : int
        Number of searches (default 4, above 20 joints 1), of iterations of each search, and
        of random trajectories at the start.
    time_budget : float
        Largest processor time [s]; by default 120, or 25 for more than 20 joints.

    Returns
    -------
    ExcitationResult
        Prints as a table; ``motion``, ``report``, ``save``.

    Raises
    ------
    TrajectoryError
        If no trajectory is inside the limits; the message names the limit or the bodies that
        touch. Also if the height of the floor is unknown.

    Examples
    --------
    >>> import armid_ros as ar
    >>> plan = ar.design_excitation('my_arm.urdf', duration=12.0, starts=1, iterations=5)
    >>> round(plan.duration, 1)
    12.0

    """
    model = drivable(arm)
    robot = model.robot
    if isinstance(joint_limits, Mapping):
        robot = with_joint_limits(robot, None, [f'{j}:={v}' for j, v in joint_limits.items()])
    elif joint_limits is not None:
        robot = with_joint_limits(robot, joint_limits)
    if acceleration is not None:
        robot = with_acceleration_limit(robot, acceleration)
    model = replace(model, robot=robot)
    # one search for an arm of many joints, as each step takes seconds
    searches, seconds = (1, 25.0) if robot.n_joints > 20 else (4, 120.0)
    run_in = min(2.0, 0.1 * duration)  # [s]
    settings = DesignSettings(
        period=whole_period(duration, periods, run_in, WAYPOINT_RATE),
        n_periods=periods,
        run_in=run_in,
        speed=speed,
        criterion=criterion,
        target=target,
        focus=focus,
        harmonics=harmonics,
        noise=noise,
        clearance=clearance,
        starts=searches if starts is None else starts,
        iterations=iterations,
        candidates=candidates,
        time_budget=seconds if time_budget is None else time_budget,
    )
    if scene is None:
        height = None if floor is None else str(floor)
        scene = CollisionScene.of(robot, clearance, height, environment)
    earlier = recordings_of(after, robot)
    return _searched(model, settings, scene, start, earlier, rng, rival, progress)


excite = design_excitation  # name of the command


def _searched(
    model: ArmModel,
    settings: DesignSettings,
    scene: CollisionScene,
    start: FloatArray | None,
    earlier: Sequence[Recording],
    rng: Rng,
    rival: ArmModel | None,
    progress: Progress,
) -> ExcitationResult:
    """Search for an excitation trajectory, after a check that the start pose is collision-free."""
    planner = TransferPlanner.of(model, scene, settings.speed)
    start = None if start is None else np.asarray(start, dtype=float)
    if start is None:
        planner.free_start()  # raises an error before the search if no pose is free
    elif start.shape != (model.robot.n_joints,):
        raise TrajectoryError(
            f'the start pose has shape {start.shape}; the arm needs ({model.robot.n_joints},)'
        )
    elif fault := planner.fault(start):
        hint = '; are these degrees?' if not planner.fault(np.radians(start)) else ''
        raise TrajectoryError(f'start: {fault}{hint}')
    prior = None
    if earlier:  # information matrix of existing recordings
        used = conditioning(earlier, SignalSettings())
        problem = DesignProblem.of(model, settings, np.random.default_rng(rng))
        prior = np.zeros(2 * [len(problem.base.parameters)])
        for recording in earlier:
            for motion in segments(recording, used):
                rows = motion.select(slice(None, None, used.decimation))
                prior += problem.information(rows, np.ptp(motion.t) * settings.rate).matrix
    found = design(
        model,
        settings,
        np.random.default_rng(rng),
        collision=scene.bodies,
        prior_information=prior,
        rival=rival,
        progress=progress,
    )
    names = tuple(one.source for one in earlier)
    return ExcitationResult(found, model, scene, start, names, rng if isinstance(rng, int) else 0)
