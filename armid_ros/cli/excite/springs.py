# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What shows elastic joints: multisines through the resonances, and steps."""

from __future__ import annotations

import os
from pathlib import Path

from armid_ros.api.excitation import BAG, ExcitationResult
from armid_ros.cli import options
from armid_ros.cli.terminal import say
from armid_ros.errors import RecordingError
from armid_ros.excitation import ClearanceModel, CollisionScene, Limits
from armid_ros.files.own import is_plan
from armid_ros.motion import FloatArray
from armid_ros.recording import write_joint_trajectory
from armid_ros.simulation.elastic import multisine_course, step_course
import click
import numpy as np

#: Each with what it is made of, and the options of armid excite that it takes.
COURSES = {'multisine': multisine_course, 'steps': step_course}
#: Options that a course takes as well as a design, and that a course alone takes.
_SHARED = {
    'robot_source', 'out', 'kind', 'duration', 'clearance', 'environment', 'floor', 'gravity',
    'joints', 'seed', 'force', 'crc', 'memory_limit',
}  # fmt: skip
_OWN = {'share'}


def refuse_other_options(context: click.Context) -> None:
    """Raise a UsageError for an option that does not go with the kind."""
    kind, default = context.params['kind'], click.core.ParameterSource.DEFAULT
    for option in context.command.params:
        name = str(option.name)
        fits = name in _SHARED or (name in _OWN) == (kind in COURSES)
        if not fits and context.get_parameter_source(name) is not default:
            raise click.UsageError(f'{option.opts[0]} does not go with --kind {kind}')


def require_free(folder: Path) -> None:
    """Raise a RecordingError if the recording exists, before the design begins."""
    if any(folder.glob('*.mcap')) or (folder / 'metadata.yaml').exists():
        raise RecordingError(f'{folder} is a recording; name another --out')
    if os.path.lexists(folder / BAG) and not is_plan(folder / BAG):
        raise RecordingError(
            f'{folder / BAG}: is no trajectory of armid excite; name another --out, or move it '
            'away'
        )


def write_course(
    kind: str, space: CollisionScene, duration: float, share: float, seed: int, out: Path
) -> None:
    """Write the trajectory as a bag."""
    robot = space.collision.robot
    require_free(out)
    staged = options.stage(out, ExcitationResult.schema, robot.name)
    bodies, margin = ClearanceModel.of(space.bodies), space.clearance

    def clear(q: FloatArray) -> bool:
        inside = np.all((q >= robot.lower) & (q <= robot.upper))
        return bool(inside) and float(bodies.smallest(q, margin).min()) >= margin

    rng = np.random.default_rng(seed)
    course = COURSES[kind](robot, duration, share, rng, clear)
    write_joint_trajectory(staged.folder / BAG, course, robot_description=robot.urdf)
    staged.keep()
    say(f'{out / BAG}: {len(course.t)} waypoints, {course.duration:.1f} s')
    first = ', '.join(
        f'{joint} {q:.3g} {unit}'
        for joint, q, unit in zip(robot.joints, course.q[0], robot.position_units, strict=True)
    )
    say(f'starts at rest in the middle of the ranges, {first}: bring the arm there first')
    for missing in space.not_checked(Limits.of(robot)):
        say(f'not checked: {missing}', 'yellow')
