# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories that show the parameters, and arms that follow them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.api.arguments import arm_of, generator, Rng, RobotLike
from armid_ros.api.table import Shown, Summary
from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    CollisionScene,
    Design,
    design,
    DesignSettings,
    Excitation,
    load_excitation,
    save_excitation,
    whole_period,
    with_joint_limits,
)
from armid_ros.excitation.geometry.floor import NO_FLOOR
from armid_ros.files import write_file
from armid_ros.motion import Motion
from armid_ros.recording import read_waypoints, ReadReport, Recording, write_joint_trajectory
from armid_ros.robots import joints_beside_arms
from armid_ros.simulation import Reference, Sensors
from armid_ros.simulation import simulate as run
import numpy as np

if TYPE_CHECKING:
    import pandas

#: Waypoints per second of a JointTrajectory; controllers interpolate between them.
WAYPOINT_RATE = 50.0
_RUN_IN = 2.0
#: Rate of a trajectory that a simulation follows [Hz].
_FINE = 1000.0


@dataclass(frozen=True, repr=False, eq=False)
class ExcitationResult(Shown):
    """
    A trajectory worth running.

    Attributes
    ----------
    core : Design
        Everything that the design found.
    arm : ArmModel
        What it was made for.
    scene : CollisionScene
        Bodies, floor and surroundings that it was checked against.

    Examples
    --------
    >>> import armid_ros as ar
    >>> plan = ar.design_excitation('my_arm.urdf', duration=6.0, starts=1, iterations=1)
    >>> sorted(path.name for path in plan.save('short_plan').iterdir())
    ['excitation.csv', 'excitation.yaml', 'report.html', 'trajectory']

    """

    core: Design
    arm: ArmModel
    scene: CollisionScene

    @property
    def trajectory(self) -> Excitation:
        """Return what is to be run, from rest to rest."""
        return self.core.excitation

    @property
    def duration(self) -> float:
        """How long that takes [s]."""
        return self.trajectory.duration

    def motion(self, rate: float = WAYPOINT_RATE) -> Motion:
        """Return positions, velocities and accelerations at a rate [Hz]."""
        return self.trajectory.motion(rate)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the waypoints as a pandas table: t, and q, dq, ddq of every joint."""
        from pandas import DataFrame

        motion = self.motion()
        columns = {'t': motion.t}
        for k, joint in enumerate(motion.joints):
            parts = {'q': motion.q, 'dq': motion.dq, 'ddq': motion.ddq}
            columns |= {f'{name}_{joint}': values[:, k] for name, values in parts.items()}
        return DataFrame(columns)

    def report(self, path: str | Path = 'report.html') -> Path:
        """Write the page on its quality; return where it is."""
        from armid_ros.report.excitation_report import excitation_report

        robot = self.arm.robot
        page = excitation_report(
            self.core,
            self.arm,
            robot=robot.name,
            scene=self.scene,
        )
        write_file(Path(path), page)
        return Path(path)

    def save(self, folder: str | Path) -> Path:
        """Write excitation.yaml and .csv, report.html, and a bag with the JointTrajectory."""
        out = Path(folder)
        out.mkdir(parents=True, exist_ok=True)
        save_excitation(self.trajectory, out / 'excitation.yaml')
        save_excitation(self.trajectory, out / 'excitation.csv')
        urdf = self.arm.robot.urdf
        write_joint_trajectory(out / 'trajectory', self.motion(), robot_description=urdf)
        self.report(out / 'report.html')
        return out

    def summary(self) -> Summary:
        """Return how much of its limits every joint uses."""
        shares = self.core.limits_used(self.arm)
        joints, unchecked = self.arm.robot.joints, self.scene.unchecked
        rows = [
            (joint, *(f'{100 * share[k]:.0f} %' for share in shares.values()))
            for k, joint in enumerate(joints)
        ]
        return Summary(
            f'{self.arm.robot.name}: {self.duration:.1f} s, condition number '
            f'{self.core.information.condition:.4g}, {len(self.core.information.parameters)} '
            'parameters',
            heads=('joint', *(f'{name} used' for name in shares)),
            rows=rows,
            lines=['not checked: ' + '; '.join(unchecked)] if unchecked else [],
        )


def design_excitation(
    arm: RobotLike,
    *,
    duration: float = 24.0,
    periods: int = 2,
    rng: Rng = 0,
    time_budget: float = 60.0,
    floor: str | float | None = None,
    environment: str | Path | None = None,
    joint_limits: str | Path | Mapping[str, float] | None = None,
    **settings: Any,
) -> ExcitationResult:
    """
    Find a trajectory that shows the parameters, inside all limits and free of collisions.

    The arm, its floor and its surroundings are checked as by ``armid excite``.

    Parameters
    ----------
    arm : model, robot, name or path
        What is to be identified.
    duration : float
        Of the whole run [s].
    periods : int
        How often the trajectory is run through; two tell noise from what a model lacks.
    rng : int or Generator
        Seed, or source of randomness.
    time_budget : float
        Processor time of each search process [s]; the best so far is kept.
    floor : str or float, optional
        Height of the floor above the origin of the base [m], or 'none'; by default the base plane
        of an arm that stands, or what is shipped with the robot.
    environment : str or Path, optional
        YAML with what stands around the arm, or a planning scene of MoveIt.
    joint_limits : str, Path or mapping of str to float, optional
        ``joint_limits.yaml`` of MoveIt, or the velocity limit of joints by name [rad/s or m/s].
        A joint without any velocity limit gets a slow one, which the summary names.
    **settings
        Further ones of ``armid_ros.excitation.DesignSettings``: ``speed='slow'``, ``starts=1``,
        ``iterations=20``, ``criterion='D'``.

    Returns
    -------
    ExcitationResult
        Prints as a table; ``motion``, ``report``, ``save``.

    Raises
    ------
    TrajectoryError
        No trajectory is inside the limits, with the limit or the bodies that touch; or the height
        of the floor is unknown.

    Examples
    --------
    >>> import armid_ros as ar
    >>> plan = ar.design_excitation('my_arm.urdf', duration=12.0, starts=1, iterations=5)
    >>> round(plan.duration, 1)
    12.0

    """
    model = arm_of(arm)
    others = joints_beside_arms(model.robot) if isinstance(arm, str | Path) else ()
    if others:
        kept = ', '.join(repr(joint) for joint in model.robot.joints if joint not in others)
        raise TrajectoryError(
            f'{arm}: {", ".join(others)} belong to no arm; choose what is driven with '
            f'ar.load_robot({str(arm)!r}, joints=[{kept}])'
        )
    velocity = joint_limits if isinstance(joint_limits, Mapping) else {}
    file = None if isinstance(joint_limits, Mapping) else joint_limits
    given = [f'{joint}:={limit}' for joint, limit in velocity.items()]
    robot, acceleration = with_joint_limits(model.robot, file, given)
    model = replace(model, robot=robot)
    run_in = min(_RUN_IN, 0.1 * duration)
    known = DesignSettings(
        period=whole_period(duration, periods, run_in, WAYPOINT_RATE),
        n_periods=periods,
        run_in=run_in,
        time_budget=time_budget,
        **{'acceleration': acceleration, **settings},
    )
    height = None if floor is None else str(floor)
    scene = CollisionScene.of(model.robot, known.clearance, height, environment)
    found = design(model, known, generator(rng), collision=scene.bodies)
    return ExcitationResult(found, model, scene)


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
    Let a simulated arm follow a trajectory and record it.

    Parameters
    ----------
    arm : model, robot, name or path
        The arm; a robot without a model is a rigid body without friction.
    trajectory : optional
        What ``design_excitation`` found, a motion, or a file of either; one made in a hurry by
        default.
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
        What the sensors read.

    Raises
    ------
    ArmidError
        The trajectory cannot be read, or does not fit the arm.

    Examples
    --------
    >>> import armid_ros as ar
    >>> run = ar.simulate('my_arm.urdf', 'plan/excitation.yaml', torque_noise=0.05, rng=1)
    >>> run.tau.shape == (len(run), 3)
    True

    """
    model = arm_of(arm, '')
    source = generator(rng)
    sensors = Sensors(
        torque_noise=torque_noise,
        position_noise=position_noise,
        velocity_noise=velocity_noise,
        resolution=resolution,
    )
    reference = _reference(model, trajectory, source)
    measured = run(model, reference, rng=source, sensors=sensors, rate=rate)
    return Recording(
        joints=measured.joints,
        t=measured.t,
        q=measured.q,
        dq=measured.dq,
        tau=measured.tau,
        source='simulation',
        report=ReadReport(messages=len(measured.t), samples=len(measured.t)),
    )


def _reference(
    arm: ArmModel,
    trajectory: ExcitationResult | Excitation | Motion | str | Path | None,
    rng: np.random.Generator,
) -> Reference:
    if trajectory is None:
        trajectory = design_excitation(
            ArmModel(arm.robot), duration=12.0, periods=1, rng=rng, starts=1, candidates=10,
            iterations=1, floor=NO_FLOOR,
        )  # fmt: skip
    if isinstance(trajectory, ExcitationResult):
        trajectory = trajectory.trajectory
    if isinstance(trajectory, (str, Path)):
        path = Path(trajectory)
        if path.is_dir() or path.suffix in ('.mcap', '.db3'):
            read = read_waypoints(path, arm.robot.joints)
            return Reference(read.joints, read.t, read.q, read.dq, read.ddq, read.tau)
        trajectory = load_excitation(path)
    if isinstance(trajectory, Excitation):
        trajectory = trajectory.motion(_FINE)
    return Reference.of(trajectory)
