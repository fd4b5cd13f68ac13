# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories that show the parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
import sys
from typing import Any, TYPE_CHECKING

from armid_ros.api.arguments import (
    drivable,
    RecordingLike,
    recordings_of,
    Rng,
    RobotLike,
    spelled,
)
from armid_ros.api.table import data_frame, DEFAULT_ORIGIN, ResultOrigin, Shown, Summary
from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    ClearanceModel,
    CollisionScene,
    Design,
    design,
    DesignProblem,
    DesignProgress,
    DesignSettings,
    Excitation,
    Fitness,
    fitness,
    plan_run,
    Run,
    save_excitation,
    transfer_limits,
    TransferPlanner,
    whole_period,
    with_joint_limits,
)
from armid_ros.files import json_text, settled, write_file
from armid_ros.identification import SignalSettings
from armid_ros.identification.rows.signals import conditioning, segments
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording, write_joint_trajectory
from armid_ros.recording.curves import draw_joints
import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas

#: Waypoints per second of a JointTrajectory; controllers interpolate between them.
WAYPOINT_RATE = 50.0
SCHEMA = 'armid/excitation/1'
#: Of more joints one search is made by default: each step of it takes seconds.
_MANY_JOINTS = 20
#: Name of the bag.
BAG = 'trajectory'
#: Of the run-in and the run-out [s], and at most this share of the duration.
_RUN_IN, _RUN_IN_SHARE = 2.0, 0.1


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
    given_start : ndarray, shape (n,), or None
        Pose to leave from and to return to [rad or m]; the free pose nearest to zero by default.
    after : tuple of str
        Recordings that it adds to.
    seed : int
        Of the search.

    Examples
    --------
    >>> import armid_ros as ar
    >>> plan = ar.design_excitation('my_arm.urdf', duration=6.0, starts=1, iterations=1)
    >>> sorted(path.name for path in plan.save('short_plan').iterdir())
    ['excitation.csv', 'excitation.json', 'excitation.yaml', 'report.html', 'trajectory']

    """

    core: Design
    arm: ArmModel
    scene: CollisionScene
    given_start: FloatArray | None = None
    after: tuple[str, ...] = ()
    seed: int = 0

    files = (
        *('excitation.json', 'report.html', 'excitation.yaml', 'excitation.csv'),
        f'{BAG} (a bag)',
    )

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

    def plot(self) -> npt.NDArray[np.object_]:
        """Draw the position of each joint; return its axes (matplotlib), shape (n,)."""
        motion = self.motion()
        curves = {'position': (motion.t, motion.q)}
        return draw_joints(motion.joints, curves, 'position [rad or m]')

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the waypoints as a pandas table: t, and q, dq, ddq of every joint."""
        motion = self.motion()
        columns, parts = {'t': motion.t}, {'q': motion.q, 'dq': motion.dq, 'ddq': motion.ddq}
        for k, joint in enumerate(motion.joints):
            columns |= {f'{name}_{joint}': values[:, k] for name, values in parts.items()}
        return data_frame(columns)

    @cached_property
    def planner(self) -> TransferPlanner:
        """Return what plans the ways to the trajectory and back."""
        return _planner(self.arm, self.core.settings, self.scene)

    @cached_property
    def start(self) -> FloatArray:
        """Return the pose that the run leaves from and returns to, shape (n,) [rad or m]."""
        return self.planner.free_start()[0] if self.given_start is None else self.given_start

    @cached_property
    def run(self) -> Run:
        """Return the trajectory with the way there and back; TrajectoryError if there is none."""
        excitation = self.core.excitation
        return plan_run(excitation, self.planner, self.start, WAYPOINT_RATE, seed=self.seed)

    @cached_property
    def fitness(self) -> Fitness:
        """Return what was checked of the run."""
        return fitness(self.run, self.core.limits, self.scene)

    def document(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """Return what excitation.json holds."""
        core = replace(self.core, excitation=self.run.excitation)
        information, settings = core.information, core.settings
        used = core.limits_used(self.arm)
        nearest, low, floor = self.fitness.nearest, self.fitness.lowest, self.scene.floor
        return {
            'schema': SCHEMA,
            'robot': origin.of(self.arm.robot).robot,
            'verdict': self.fitness.word,
            'summary': str(self.fitness),
            'not_checked': list(self.fitness.unchecked),
            'excluded_pairs': self.scene.collision.excluded,
            'joints': list(core.excitation.joints),
            'duration': core.excitation.duration,
            'period': settings.period,
            'start': self.start.tolist(),
            'approach': self.run.approach.duration,
            'trajectory_duration': self.run.duration,
            'floor': {'height': floor.height, 'source': floor.source},
            'lowest_point': {'height': low.height, 'link': low.link, 'time': low.time},
            'speed': settings.speed,
            'criterion': settings.criterion,
            'cost': core.cost,
            'stopped': core.stopped,
            'seed': self.seed,
            'condition_number': information.condition,
            'log_det': information.log_det,
            'rank': int(np.count_nonzero(np.isfinite(information.std))),
            'clearance': None if nearest is None else nearest.distance,
            'limits_used': {name: share.tolist() for name, share in used.items()},
            'parameters': [
                {'name': name.name, 'joint': name.joint, 'std': std, 'unit': name.unit}
                for name, std in zip(information.parameters, information.std, strict=True)
            ],
        }

    def page(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> str:
        """Return report.html on the quality of the run."""
        from armid_ros.report.excitation_report import excitation_report

        return excitation_report(
            replace(self.core, excitation=self.run.excitation),
            self.arm,
            self.run,
            self.fitness,
            robot=origin.of(self.arm.robot).robot,
            scene=self.scene,
            provenance=origin.provenance,
        )

    def fill(self, folder: Path, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """
        Write excitation.yaml, .csv and .json, a bag with the run, and report.html into a folder.

        What takes longest to find is written first.

        Raises
        ------
        TrajectoryError
            If no way leads from the start to the trajectory; its coefficients are written then.

        """
        for name in ('excitation.yaml', 'excitation.csv'):
            save_excitation(self.core.excitation, folder / name)
        for name in ('excitation.yaml', 'excitation.csv'):  # where a way there is found
            save_excitation(self.run.excitation, folder / name)
        robot = self.arm.robot
        write_joint_trajectory(folder / BAG, self.run.motion(), robot_description=robot.urdf)
        document = self.document(origin)
        write_file(folder / 'excitation.json', json_text(document, indent=1))
        page = folder / 'report.html'
        try:
            write_file(page, self.page(origin))
        except Exception as error:  # whatever it is, the trajectory is written and good
            sys.stderr.write(f'{settled(page)}: not written: {type(error).__name__}: {error}\n')
        return document

    def summary(self) -> Summary:
        """Return how much of its limits every joint uses."""
        shares = self.core.limits_used(self.arm)
        rows = [
            (joint, *(f'{100 * share[k]:.0f} %' for share in shares.values()))
            for k, joint in enumerate(self.arm.robot.joints)
        ]
        information, speed = self.core.information, self.core.settings.speed
        unseen = int(np.sum(~np.isfinite(information.std)))
        return Summary(
            f'{speed}: condition number {information.condition:.1f}, '
            f'{len(information.parameters)} parameters' + f', {unseen} not seen' * bool(unseen),
            heads=('joint', *(f'{name} used' for name in shares)),
            rows=rows,
            lines=self._of_run(),
        )

    def _of_run(self) -> list[str]:
        """Say whether the run is fit, where it starts, and whether the search was stopped."""
        try:
            run, fit = self.run, self.fitness
        except TrajectoryError as error:
            return [f'there is no way to the trajectory: {error}']
        robot = self.arm.robot
        fault = '' if self.given_start is not None else self.planner.fault(robot.zero_pose)
        parts = zip(robot.joints, self.start, robot.position_units, strict=True)
        pose = [f'{joint} {value:.3g} {unit}' for joint, value, unit in parts if value]
        why = f' (the zero of the description is not free: {fault})' if fault else ''
        begin = f'starts at rest at {", ".join(pose) or "zero"}{why}'
        on = f'is on the trajectory after {run.approach.duration:.1f} s'
        lines = ['not checked: ' + '; '.join(fit.unchecked)] if fit.unchecked else []
        end = f'{begin}, {on} and back after {run.duration:.1f} s'
        lines += [str(fit).partition('; not checked: ')[0], end]
        early = f'stopped early ({self.core.stopped}): not what the seed would give'
        return [*lines, early] if self.core.stopped else lines


@spelled
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
    progress: Callable[[DesignProgress], None] | None = None,
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
    floor : str or float, optional
        Height of the floor above the origin of the base [m], or 'none'; by default the base plane
        of an arm that stands, or what is shipped with the robot.
    environment : str or Path, optional
        YAML with what stands around the arm, or a planning scene of MoveIt.
    joint_limits : str, Path or mapping of str to float, optional
        ``joint_limits.yaml`` of MoveIt (position, velocity, acceleration), or velocity limits by
        name [rad/s or m/s]. A joint without any gets a slow one, which the summary names.
    scene : CollisionScene, optional
        Bodies, floor and surroundings, in place of ``floor`` and ``environment``.
    start : ndarray, shape (n,), optional
        Pose to leave from and to return to [rad or m]; the free pose nearest to zero by default.
    after : recording or path, or several
        Recordings whose information the trajectory adds to.
    rival : ArmModel, optional
        With ``criterion='T'``: what may be there in place of the effects of ``arm``.
    progress : callable, optional
        Called with the progress of the search.
    speed : str or float
        'slow', 'medium', 'fast' or a share of the velocity and acceleration limits.
    criterion : {'D', 'A', 'E', 'condition', 'T'}
        What is made best; 'T' tells the arm from ``rival``.
    target : {'all', 'gravity', 'effects'}
        Of which parameters.
    focus : tuple of str
        Names of effects to see best, everything else being fitted too.
    harmonics : int
        Fourier harmonics per joint.
    acceleration, noise : ndarray, shape (n,)
        Acceleration limits [rad/s^2 or m/s^2], by default the top speed in 0.25 s; standard
        deviation of the torque noise [N m or N], by default 1 % of the torque limits.
    clearance : float
        Distance between bodies that may touch [m].
    starts, iterations, candidates : int
        Searches, by default 4, and 1 above 20 joints; iterations of each; random trajectories
        that they begin with.
    time_budget : float
        Processor time [s]: by default 120, and above 20 joints 25.

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
    model = drivable(arm)
    if joint_limits is not None:
        named = joint_limits if isinstance(joint_limits, Mapping) else {}
        file = None if isinstance(joint_limits, Mapping) else joint_limits
        velocity = [f'{joint}:={limit}' for joint, limit in named.items()]
        robot, known = with_joint_limits(model.robot, file, velocity)
        model = replace(model, robot=robot)
        acceleration = known if acceleration is None else acceleration
    searches, seconds = (1, 25.0) if model.robot.n_joints > _MANY_JOINTS else (4, 120.0)
    run_in = min(_RUN_IN, _RUN_IN_SHARE * duration)
    period = whole_period(duration, periods, run_in, WAYPOINT_RATE)
    asked = DesignSettings(
        period=period,
        n_periods=periods,
        run_in=run_in,
        speed=speed,
        criterion=criterion,
        target=target,
        focus=focus,
        harmonics=harmonics,
        acceleration=acceleration,
        noise=noise,
        clearance=clearance,
        starts=searches if starts is None else starts,
        iterations=iterations,
        candidates=candidates,
        time_budget=seconds if time_budget is None else time_budget,
    )
    if scene is None:
        height = None if floor is None else str(floor)
        scene = CollisionScene.of(model.robot, asked.clearance, height, environment)
    planner = _planner(model, asked, scene)
    if start is None:
        planner.free_start()  # where there is none, that is said before the search
    elif fault := planner.fault(start):
        raise TrajectoryError(f'--start: {fault}')
    earlier = recordings_of(after, model.robot)
    found = design(
        model,
        asked,
        np.random.default_rng(rng),
        collision=scene.bodies,
        prior_information=_information(model, asked, earlier, rng) if earlier else None,
        rival=rival,
        progress=progress,
    )
    names = tuple(one.source for one in earlier)
    return ExcitationResult(found, model, scene, start, names, rng if isinstance(rng, int) else 0)


excite = design_excitation  # as the command is called


def _planner(arm: ArmModel, settings: DesignSettings, scene: CollisionScene) -> TransferPlanner:
    """Return what plans the ways of an arm to a run with such settings, and back."""
    return TransferPlanner(
        arm,
        transfer_limits(arm.robot, settings.speed, settings.acceleration),
        ClearanceModel.of(scene.bodies),
        settings.clearance,
    )


def _information(
    arm: ArmModel, settings: DesignSettings, recordings: Sequence[Recording], rng: Rng
) -> FloatArray:
    """Return the information that recordings hold already, shape (r, r)."""
    used = conditioning(list(recordings), SignalSettings())
    problem = DesignProblem.of(arm, settings, np.random.default_rng(rng))
    matrix = np.zeros(2 * [len(problem.base.parameters)])
    for recording in recordings:
        for motion in segments(recording, used):
            thinned = motion.select(slice(None, None, used.decimation))
            matrix += problem.information(thinned, np.ptp(motion.t) * settings.rate).matrix
    return matrix
