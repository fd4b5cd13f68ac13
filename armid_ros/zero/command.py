# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command ``armid zero``: sensor zeros, gains, gravity and tool from an arm at rest."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from armid_ros.cli import columns, parameters
from armid_ros.cli.excite import excite, require_free
from armid_ros.cli.identify import identify
from armid_ros.cli.terminal import progress
import click

#: Options of `armid excite` on the limits and surroundings of an arm.
_SCENE_OPTIONS = ('joint_limits', 'velocity', 'clearance', 'floor', 'environment')


@click.group(epilog='Example: armid zero plan --robot ur5.urdf --out plan')
def zero() -> None:
    """
    Identify torque sensor zeros and gains, base tilt and tool from recordings of an arm at rest.

    plan writes a trajectory of static poses, each reached from both sides, for
    excitation_publisher. fit estimates the quantities from the rests of a recording. It takes the
    described links and the size of gravity as exact: --link-error allows for errors of links,
    --known gain fits the size. Friction at rest is a lower bound of friction in motion. The centre
    of the tool is in the frame of the last joint. --model of other commands takes model.yaml.

    """


@zero.command(epilog='Example: armid zero plan --robot ur5.urdf --out plan')
@parameters.robot
@parameters.folder
@click.option(
    '--poses', type=click.IntRange(4, 40), default=16, show_default=True, help='Number of poses.'
)
@click.option(
    '--hold',
    type=click.FloatRange(1.0, 60.0),
    default=3.0,
    show_default=True,
    help='Time at rest in each pose, from each side [s].',
)
@parameters.setting
@parameters.as_json
def plan(
    robot_source: str, gravity: str, joints: str | None, out: Path, as_json: bool, **given: Any
) -> None:
    """Plan a trajectory with rests in several poses, to be played by excitation_publisher."""
    from armid_ros.api.excitation import ExcitationResult
    from armid_ros.cli import options
    from armid_ros.excitation import CollisionScene, with_joint_limits
    from armid_ros.zero.plan import plan_zero

    joint_limits, velocity, *place = (given.pop(name) for name in _SCENE_OPTIONS)
    robot = options.open_robot(robot_source, gravity, joints)
    robot = with_joint_limits(robot, joint_limits, velocity)
    require_free(out)
    staged = options.stage(out, ExcitationResult.schema, robot_source)
    with progress('planning'):
        scene = CollisionScene.of(robot, *place)
        result = plan_zero(robot, scene, **given)
        read = [Path(robot_source.split(' ')[0]), *filter(None, (joint_limits, place[-1]))]
        step = (
            f'play {out / "excitation.yaml"} with excitation_publisher, record it, then '
            f'armid zero fit BAG --robot {robot_source} --out zeros'
        )
        summary = replace(result.summary(), then='', steps=[step])
        origin = replace(options.origin(robot_source, read, result.seed), step=step)
        options.deliver(result, staged, origin, as_json, summary)


plan.params += [one for one in excite.params if one.name in _SCENE_OPTIONS]


@zero.command(epilog='Example: armid zero fit run.mcap --robot ur5.urdf --out zeros')
@parameters.bags
@parameters.robot
@parameters.folder
@click.option(
    '--known',
    type=click.Choice(['gain', 'tilt', 'tool']),
    multiple=True,
    help='Quantity that is known and not fitted: gains of 1, no tilt, no tool; may be given '
    'several times. With known gains, the size of gravity is fitted.',
)
@click.option(
    '--link-error',
    type=click.FloatRange(0.0, 1.0),
    default=0.0,
    show_default=True,
    help='Standard deviation of the described masses and first moments of links, as a share; 0: '
    'exact.',
)
@click.option(
    '--external',
    is_flag=True,
    help='Efforts are the external torque that a controller estimates (--topic, --effort): '
    'measured torque minus the weight of the described arm, which is added again.',
)
@columns.recordings
def fit(
    bags: tuple[Path, ...],
    robot_source: str,
    gravity: str,
    joints: str | None,
    topic: str | None,
    out: Path,
    known: tuple[str, ...],
    link_error: float,
    external: bool,
    payloads: tuple[str, ...],
    seed: int,
    as_json: bool,
) -> None:
    """Estimate torque sensor zeros and gains, gravity, tool and friction from recorded rests."""
    from armid_ros import ArmModel, save_model
    from armid_ros.cli import options
    from armid_ros.identification.known_payload import payloads_of
    from armid_ros.zero.fit import fit_document, fit_rests, fit_summary, SCHEMA
    from armid_ros.zero.rests import find_rests, reading_noise
    import numpy as np

    staged = options.stage(out, SCHEMA, robot_source)
    robot = options.open_robot(robot_source, gravity, joints, bags)
    recordings = options.read(bags, robot, topic)
    options.tell_damage(*recordings)
    loaded = payloads_of(payloads, recordings, robot)
    robots = [loaded.get(recording.source, robot) for recording in recordings]
    rests = [find_rests(recording) for recording in recordings]
    if external:  # the controller has subtracted the weight of the described arm
        bare = ArmModel(robot, quasi_static=True)
        rests = [rest.with_torque(np.asarray(rest.tau) + bare.torque(rest)) for rest in rests]
    found = fit_rests(rests, robots, known, link_error)
    source = options.kept_source(robot_source, robot, staged.folder)
    save_model(staged.folder / 'model.yaml', found.model(), source)
    document = fit_document(found, known, link_error, external)
    step = f'armid identify RECORDING --robot {robot_source}, which also finds friction in motion'
    noise = np.sqrt(np.mean([reading_noise(each) ** 2 for each in recordings], axis=0))
    summary = None if as_json else fit_summary(found, document, step, noise)
    options.deliver_document(staged, 'zero', document, summary, 'model.yaml')


fit.params += [one for one in identify.params if one.name == 'payloads']
