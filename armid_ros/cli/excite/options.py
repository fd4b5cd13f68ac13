# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the options of ``armid excite`` ask for, group by group."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.cli import options
from armid_ros.cli.excite.files import WAYPOINT_RATE
from armid_ros.cli.terminal import progress
from armid_ros.effects import parse_effect
from armid_ros.excitation import CollisionScene, DesignSettings, whole_period
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot

#: Of the run-in and the run-out [s], and at most this share of the duration.
_RUN_IN, _RUN_IN_SHARE = 2.0, 0.1


@dataclass(frozen=True)
class MotionOptions:
    """
    The motion that is wanted.

    Attributes
    ----------
    kind : str
        Designed, or one for elastic joints.
    share : float
        Of the limits, for elastic joints.
    duration : float
        From rest to rest [s].
    periods, harmonics : int
        Of the Fourier series.
    speeds : tuple of str or float
        Speed classes, or shares of the limits.
    criterion, target : str
        What is made best, of which parameters.

    """

    kind: str
    share: float
    duration: float
    periods: int
    harmonics: int
    speeds: tuple[str | float, ...]
    criterion: str
    target: str


@dataclass(frozen=True)
class ModelOptions:
    """
    What is known of the arm, and what is to be found.

    Attributes
    ----------
    model : Path or None
        A model.yaml.
    effects, focus : str
        Effects to see, and those to see best.
    texts : tuple of str
        Effects of known size.
    rival : str or None
        Effects that may be there in place of those.

    """

    model: Path | None
    effects: str
    focus: str
    texts: tuple[str, ...]
    rival: str | None

    def arms(self, robot: Robot) -> tuple[ArmModel, ArmModel | None]:
        """Return the prior model, and the one to tell it from."""
        arm = ArmModel(robot) if self.model is None else options.model_of(self.model, robot)
        arm = options.with_effects(arm, self.effects)
        rival = None
        if self.rival is not None:
            rival = options.with_effects(arm, self.rival.removesuffix('none'))
        arm = options.with_effects(arm, self.focus)
        for text in self.texts:
            arm = arm.with_effect(*parse_effect(text, robot))
        return arm, rival


@dataclass(frozen=True)
class LimitOptions:
    """
    What the motion keeps to.

    Attributes
    ----------
    start, acceleration, torque_noise : str or None
        Pose, limits and standard deviations, one number or one a joint.
    joint_limits : Path or None
        joint_limits.yaml of MoveIt.
    velocity : tuple of str
        Velocity limits, 'joint:=value' [rad/s or m/s].
    clearance : float
        Between links [m].
    environment : Path or None
        What stands around the arm.
    floor : str or None
        Its height, or that there is none.

    """

    start: str | None
    acceleration: str | None
    joint_limits: Path | None
    velocity: tuple[str, ...]
    torque_noise: str | None
    clearance: float
    environment: Path | None
    floor: str | None

    def workspace(self, robot: Robot) -> CollisionScene:
        """Return what the robot must not touch."""
        with progress('reading meshes') as tick:
            return CollisionScene.of(
                robot, self.clearance, self.floor, self.environment, progress=tick
            )


@dataclass(frozen=True)
class SearchOptions:
    """
    How the motion is searched for.

    Attributes
    ----------
    after : tuple of Path
        Bags that it adds to.
    starts, iterations : int
        Searches, and the steps of each.
    time_budget : float
        At most so long for a design [s].
    seed : int
        Of every random number.

    """

    after: tuple[Path, ...]
    starts: int
    iterations: int
    time_budget: float
    seed: int


def design_settings(
    robot: Robot,
    acceleration: FloatArray | None,
    motion: MotionOptions,
    model: ModelOptions,
    limits: LimitOptions,
    search: SearchOptions,
) -> DesignSettings:
    """Return what the design takes."""
    run_in = min(_RUN_IN, _RUN_IN_SHARE * motion.duration)
    return DesignSettings(
        period=whole_period(motion.duration, motion.periods, run_in, WAYPOINT_RATE),
        n_periods=motion.periods,
        run_in=run_in,
        harmonics=motion.harmonics,
        criterion=motion.criterion,
        target=motion.target,
        focus=tuple(name.partition('@')[0] for name in model.focus.split(',') if name),
        acceleration=acceleration
        if limits.acceleration is None
        else options.per_joint(limits.acceleration, robot, '--acceleration'),
        noise=options.per_joint(limits.torque_noise, robot, '--torque-noise'),
        clearance=limits.clearance,
        starts=search.starts,
        iterations=search.iterations,
        time_budget=search.time_budget,
    )
