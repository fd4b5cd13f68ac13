# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulation of an arm that follows a trajectory."""

from __future__ import annotations

from pathlib import Path

from armid_ros.api.arguments import arm_of, Rng, RobotLike
from armid_ros.api.excitation import ExcitationResult
from armid_ros.arm import ArmModel
from armid_ros.excitation import design, DesignSettings, Excitation, load_excitation
from armid_ros.motion import Motion, Temperatures
from armid_ros.recording import read_waypoints, ReadReport, ReadSettings, Recording
from armid_ros.recording.source import DEFAULT
from armid_ros.robots import collision_model, Robot
from armid_ros.simulation import Reference, Sensors, SimulatedRun
from armid_ros.simulation import simulate as run
import numpy as np


def simulate(
    arm: RobotLike,
    trajectory: ExcitationResult | Excitation | Motion | str | Path | None = None,
    *,
    rate: float = 200.0,
    torque_noise: float = 0.0,
    position_noise: float = 0.0,
    velocity_noise: float = 0.0,
    resolution: float = 0.0,
    rng: Rng = 0,
) -> Recording:
    """
    Simulate an arm that follows a trajectory; return the recording of its sensors.

    Parameters
    ----------
    arm : model, robot, name or path
        The arm; a robot without a model is a rigid body without friction.
    trajectory : optional
        Result of ``design_excitation``, a motion, or a file of either; by default the result of
        a short search.
    rate : float
        Recorded samples per second.
    torque_noise, position_noise, velocity_noise : float
        Standard deviations [N m, rad, rad/s].
    resolution : float
        Step of the encoders [rad].
    rng : int or Generator
        Seed, or source of randomness.

    Returns
    -------
    Recording
        Readings of the sensors.

    Raises
    ------
    ArmidError
        If the trajectory cannot be read, or does not fit the arm.

    Examples
    --------
    >>> import armid_ros as ar
    >>> run = ar.simulate('my_arm.urdf', 'plan/excitation.yaml', torque_noise=0.05, rng=1)
    >>> run.tau.shape == (len(run), 3)
    True

    """
    model = arm_of(arm, '')
    source = np.random.default_rng(rng)
    sensors = Sensors(
        torque_noise=torque_noise,
        position_noise=position_noise,
        velocity_noise=velocity_noise,
        resolution=resolution,
    )
    reference = reference_of(model.robot, trajectory, source)
    return recording_of(run(model, reference, rng=source, sensors=sensors, rate=rate))


def recording_of(run: SimulatedRun, temperature: Temperatures | None = None) -> Recording:
    """Return the sensor recording of a simulated run, with joint temperatures if known."""
    return Recording(
        joints=run.joints,
        t=run.t,
        q=run.q,
        dq=run.dq,
        tau=run.tau,
        temperature=temperature,
        source='simulation',
        report=ReadReport(messages=len(run.t), samples=len(run.t)),
    )


def reference_of(
    robot: Robot,
    trajectory: ExcitationResult | Excitation | Motion | str | Path | None,
    rng: np.random.Generator,
    settings: ReadSettings = DEFAULT,
) -> Reference:
    """
    Convert a trajectory or trajectory file to the reference motion of a simulated arm.

    Parameters
    ----------
    robot : Robot
        The arm.
    trajectory : optional
        Result of ``design_excitation``, a motion, or a file of either; by default the result of
        a short search.
    rng : numpy.random.Generator
        Source of the random start values of the search.
    settings : ReadSettings
        Settings of the reader of bags.

    Raises
    ------
    ArmidError
        If the file cannot be read.

    """
    if trajectory is None:
        quick = DesignSettings(period=10.0, starts=1, candidates=10, iterations=1)
        collision = collision_model(robot)
        trajectory = design(ArmModel(robot), quick, rng, collision=collision).excitation
    if isinstance(trajectory, ExcitationResult):
        trajectory = trajectory.trajectory
    if isinstance(trajectory, (str, Path)):
        path = Path(trajectory)
        if path.is_dir() or path.suffix in ('.mcap', '.db3'):
            return read_waypoints(path, robot.joints, settings=settings)
        trajectory = load_excitation(path)
    if isinstance(trajectory, Excitation):
        trajectory = trajectory.motion(1000.0)  # [Hz]
    return Reference.of(trajectory)
