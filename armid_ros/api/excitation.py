# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Results of the design of excitation trajectories."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
import sys
from typing import Any, TYPE_CHECKING

from armid_ros.api.arguments import source_of
from armid_ros.api.table import data_frame, Shown, Summary
from armid_ros.arm import ArmModel
from armid_ros.diagnosis.next_run.isolability import Isolability, isolability
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    CollisionScene,
    Design,
    Excitation,
    Fitness,
    fitness,
    plan_run,
    Run,
    save_excitation,
    TransferPlanner,
)
from armid_ros.excitation.problem import torque_noise
from armid_ros.excitation.scene import UNFIT
from armid_ros.files import final_path, json_text, write_file
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import write_joint_trajectory
from armid_ros.recording.curves import draw_joints
from armid_ros.report.excitation_report import excitation_report, identifiable
from armid_ros.report.provenance import DEFAULT_ORIGIN, ResultOrigin
import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas

#: Waypoints per second of a JointTrajectory; controllers interpolate between them.
WAYPOINT_RATE = 50.0
#: Verdict if no path to the trajectory was found.
NO_WAY = 'no trajectory'
#: Name of the bag.
BAG = 'trajectory'


@dataclass(frozen=True, repr=False, eq=False)
class ExcitationResult(Shown):
    """
    Designed excitation trajectory with its collision scene and predicted accuracy.

    Attributes
    ----------
    core : Design
        Everything that the design found.
    arm : ArmModel
        Model of the arm.
    scene : CollisionScene
        Bodies, floor and surroundings for the check of clearance.
    given_start : ndarray, shape (n,), or None
        Start and end pose [rad or m]; the free pose nearest to zero by default.
    after : tuple of str
        Names of earlier recordings; the trajectory adds to their information.
    seed : int
        Seed of the search.
    with_isolability : bool
        Whether results contain the `isolability`.

    Examples
    --------
    >>> import armid_ros as ar
    >>> plan = ar.design_excitation('my_arm.urdf', duration=6.0, starts=1, iterations=1)
    >>> sorted(path.name for path in plan.save('short_plan').iterdir())
    ['excitation.csv', 'excitation.json', 'excitation.yaml', 'report.html', 'trajectory']

    """

    schema = 'armid/excitation/1'

    core: Design
    arm: ArmModel
    scene: CollisionScene
    given_start: FloatArray | None = None
    after: tuple[str, ...] = ()
    seed: int = 0
    with_isolability: bool = False

    files = (
        *('excitation.json', 'report.html', 'excitation.yaml', 'excitation.csv'),
        f'{BAG} (a bag)',
    )

    @property
    def trajectory(self) -> Excitation:
        """Trajectory from rest to rest, without approach and return."""
        return self.core.excitation

    @property
    def duration(self) -> float:
        """Duration of the trajectory [s]."""
        return self.trajectory.duration

    def motion(self, rate: float = WAYPOINT_RATE) -> Motion:
        """Return samples of the trajectory at a rate [Hz]: position, velocity, acceleration."""
        return self.trajectory.motion(rate)

    def plot(self) -> npt.NDArray[np.object_]:
        """Plot the position of each joint over time; return an array (n,) of matplotlib axes."""
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
        """Planner of the motions from the start pose to the trajectory and back."""
        return TransferPlanner.of(self.arm, self.scene, self.core.settings.speed)

    @cached_property
    def start(self) -> FloatArray:
        """Pose in which the run starts and ends, shape (n,) [rad or m]."""
        return self.planner.free_start() if self.given_start is None else self.given_start

    @cached_property
    def start_reason(self) -> str:
        """Return why the start pose is not zero; empty if it is zero or was given by the user."""
        if self.given_start is not None:
            return ''
        robot, nearest = self.arm.robot, self.planner.zero_pose
        ranges = ', '.join(
            f'{robot.joints[j]} ({robot.lower[j]:.4g} to {robot.upper[j]:.4g} '
            f'{robot.position_units[j]})'
            for j in np.flatnonzero(nearest)
        )
        limits = f'zero is outside the used 96 % of the position range of {ranges}'
        fault = self.planner.fault(nearest)
        reasons = [limits] * bool(ranges) + [f'the zero pose is not free: {fault}'] * bool(fault)
        return f'the start pose is not zero: {"; ".join(reasons)}' if reasons else ''

    @cached_property
    def run(self) -> Run:
        """Run of approach, trajectory and way back; TrajectoryError if no path is found."""
        excitation = self.core.excitation
        return plan_run(excitation, self.planner, self.start, WAYPOINT_RATE, seed=self.seed)

    @cached_property
    def isolability(self) -> Isolability:
        """Effects that the trajectory makes detectable, and effects that it cannot separate."""
        settings = self.core.settings
        noise, count = torque_noise(self.arm, settings), settings.rate * self.duration
        return isolability(self.arm, self.motion(), noise, count)

    @cached_property
    def fitness(self) -> Fitness:
        """Return the result of the safety checks: limits, clearance and floor along the run."""
        return fitness(self.run.motion(), self.scene)

    def document(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """Return the content of excitation.json."""
        core = replace(self.core, excitation=self.run.excitation)
        information, settings = core.information, core.settings
        used = core.limits_used(self.arm)
        nearest, low, floor = self.fitness.nearest, self.fitness.lowest, self.scene.floor
        return {
            'schema': self.schema,
            'robot': origin.of(source_of(self.arm.robot)).robot,
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
            **({'isolability': self.isolability.document()} if self.with_isolability else {}),
        }

    def page(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> str:
        """Return the text of report.html on the quality of the trajectory."""
        return excitation_report(
            replace(self.core, excitation=self.run.excitation),
            self.arm,
            self.run,
            self.fitness,
            scene=self.scene,
            isolability=self.isolability if self.with_isolability else None,
            start_reason=self.start_reason,
            origin=self.with_step(
                replace(origin, step=self.fitness.remedy or origin.step), self.arm.robot
            ),
        )

    def fill(self, folder: Path, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """
        Write excitation.yaml, .csv and .json, a bag of the run, and report.html into a folder.

        The trajectory, which takes longest to find, is written first.

        Raises
        ------
        TrajectoryError
            If no path leads from the start to the trajectory; its coefficients are still written.

        """
        for name in ('excitation.yaml', 'excitation.csv'):
            save_excitation(self.core.excitation, folder / name)
        for name in ('excitation.yaml', 'excitation.csv'):  # if a path to the trajectory is found
            save_excitation(self.run.excitation, folder / name)
        robot = self.arm.robot
        write_joint_trajectory(folder / BAG, self.run.motion(), robot_description=robot.urdf)
        document = self.document(origin)
        write_file(folder / 'excitation.json', json_text(document, indent=1))
        page = folder / 'report.html'
        try:
            write_file(page, self.page(origin))
        except Exception as error:  # the written trajectory is valid despite any error
            sys.stderr.write(f'{final_path(page)}: not written: {type(error).__name__}: {error}\n')
        return document

    def summary(self) -> Summary:
        """Return the terminal summary: identifiable parameters, and used share of joint limits."""
        robot, shares = self.arm.robot, self.core.robot_limits_used(self.arm)
        rows = [
            (joint, *(f'{100 * share[k]:.0f} %' for share in shares.values()))
            for k, joint in enumerate(robot.joints)
        ]
        try:
            run, fit = self.run, self.fitness
        except TrajectoryError as error:
            word, remedy = NO_WAY, 'Give another --start or --seed.'
            lines = [f'There is no path to the trajectory: {error}.']
        else:
            word, remedy, lines = fit.word, fit.remedy, fit.sentences()
            parts = zip(robot.joints, self.start, robot.position_units, strict=True)
            pose = [f'{joint} {value:.3g} {unit}' for joint, value, unit in parts if value]
            lines.append(
                f'The run starts at rest at {", ".join(pose) or "zero"}, reaches the trajectory '
                f'after {run.approach.duration:.1f} s and is back after {run.duration:.1f} s.'
            )
            lines += [self.start_reason] if self.start_reason else []
            early = f'stopped early ({self.core.stopped}): another run with this seed may differ'
            lines += [early] if self.core.stopped else []
        lines += identifiable(self.core, robot.links)
        lines += [str(self.isolability)] if self.with_isolability else []
        return Summary(
            lines[0],
            word,
            ('joint', *(f'{name} used' for name in shares)),
            rows,
            lines[1:],
            [remedy] if remedy else [],
            then='' if word in (UNFIT, NO_WAY) else 'simulate',
        )
