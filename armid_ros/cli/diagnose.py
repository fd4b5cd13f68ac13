# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `armid diagnose`: effects that a model lacks, found from recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import math
from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.cli import columns, parameters
from armid_ros.cli.terminal import progress
from armid_ros.errors import ArmidError, ModelError
from armid_ros.files.cells import listed, parted
import click

if TYPE_CHECKING:
    from armid_ros.arm import ArmModel
    from armid_ros.effects.tied import Partner
    from armid_ros.recording import Recording
    from armid_ros.robots import Robot
    from armid_ros.robots.ties import Tie


def share_of_percent(
    ctx: click.Context | None, param: click.Parameter | None, value: str
) -> float:
    """Convert text such as '1' or '1 %' to a share from 0 to 1."""
    try:
        share = float(value.removesuffix('%')) / 100.0
    except ValueError:
        share = math.nan
    if not 0.0 <= share < 1.0:
        raise click.BadParameter(f"'{value}' is not a percentage from 0% to 100%", ctx, param)
    return share


@click.command(epilog='Example: armid diagnose slow.mcap fast.mcap --robot ur10.urdf --out found')
@parameters.bags
@parameters.robot
@parameters.folder
@parameters.validate
@click.option(
    '--model',
    type=parameters.ModelPath(path_type=Path),
    help='model.yaml of the arm; its effects are part of the model in question.',
)
@click.option(
    '--baseline',
    multiple=True,
    type=click.Path(path_type=Path),
    metavar='BAG',
    help='A bag recorded while the model was right, to find changes since; may be given several '
    'times. By default the bags of the identification of --model, if they exist.',
)
@click.option(
    '--no-baseline',
    is_flag=True,
    help='Diagnose without a baseline: the gap is then the residual beyond the misfit that '
    'identify wrote into --model.',
)
@click.option(
    '--against',
    multiple=True,
    type=click.Path(path_type=Path),
    metavar='BAG',
    help='A bag of a simulated arm, to find effects that the simulator lacks; may be given '
    'several times. The model is then identified from this bag, with --effects if given.',
)
@click.option(
    '--material',
    callback=share_of_percent,
    default='1%',
    show_default=True,
    metavar='PERCENT',
    help="Share of a joint's torque (rms) below which an effect does not matter.",
)
@click.option('--everything', is_flag=True, help='Add immaterial effects to the model as well.')
@click.option(
    '--prior',
    'priors',
    shell_complete=parameters.completed,
    multiple=True,
    metavar='E=HOW',
    help='Frequency of an effect on this arm: often, usual, seldom or never; may be given '
    'several times.',
)
@click.option(
    '--effects',
    shell_complete=parameters.completed,
    default='',
    metavar='E,...',
    help="Effects that the model has, to fit them anew; 'E@joint+joint' for some joints only.",
)
@click.option(
    '--residual',
    type=click.Choice(['gp']),
    help='Learn the unexplained residual where the verdict is partial or unknown. gp: a Gaussian '
    'process of each joint.',
)
@click.option(
    '--strict',
    is_flag=True,
    help='End with code 3 if a gap has no named effect (unknown, not_repeatable). Data '
    'that cannot be diagnosed (bad_data) end with code 2 in any case.',
)
@parameters.cutoff
@parameters.decimation
@columns.options
@parameters.topic
@click.option(
    '--partner',
    metavar='R',
    help='Shipped name, URDF or xacro of a machine or person in the same bags that the arm '
    'may be tied to.',
)
@click.option('--partner-topic', help='JointState topic of the partner, if not unique.')
@click.option(
    '--tie',
    'ties',
    multiple=True,
    metavar='JOINT=JOINT',
    help='Possible tie: a joint of the arm and a joint of the partner. JOINT@X,Y,Z sets '
    'a point of the link [m]; the centroid by default. By default links with equal indices.',
)
@parameters.setting
@parameters.every
@parameters.as_json
def diagnose(
    bags: tuple[Path, ...],
    robot_source: str,
    gravity: str,
    joints: str | None,
    topic: str | None,
    out: Path,
    validate: tuple[Path, ...],
    model: Path | None,
    baseline: tuple[Path, ...],
    no_baseline: bool,
    against: tuple[Path, ...],
    effects: str,
    residual: str | None,
    strict: bool,
    partner: str | None,
    partner_topic: str | None,
    ties: tuple[str, ...],
    seed: int,
    every: bool,
    as_json: bool,
    priors: tuple[str, ...],
    **settings: Any,
) -> None:
    """Find the effects that a model lacks, and add them to the model."""
    if baseline and no_baseline:
        raise click.UsageError('--baseline and --no-baseline were both given; give only one')
    if against and (model or baseline):
        raise click.UsageError('--against cannot be used together with --model or --baseline')
    from armid_ros.api.arguments import with_effects
    from armid_ros.api.diagnosis import diagnose as run
    from armid_ros.api.diagnosis import DiagnosisResult, require_residual
    from armid_ros.arm import ArmModel
    from armid_ros.cli import options
    from armid_ros.identification.parameters_file import read_misfit

    if residual is not None:
        require_residual()
    staged = options.stage(out, DiagnosisResult.schema, robot_source)
    robot = options.open_robot(robot_source, gravity, joints, bags)
    arm = ArmModel(robot) if model is None else _model_of(model, robot)
    arm = with_effects(arm, effects)
    other = open_partner(partner, ties, robot, gravity)
    misfit = None if model is None else read_misfit(model, arm)
    if model is not None and other is None and not (baseline or no_baseline):
        baseline = _identified_from(model, [*bags, *validate])
    with progress('reading') as tick:
        recordings, held_out, before, simulated = (
            options.read(paths, robot, topic) for paths in (bags, validate, baseline, against)
        )
        options.tell_damage(*recordings, *held_out, *before, *simulated)
        if other is not None:
            recordings, held_out = (
                read_together(named, some, other, partner_topic)
                for named, some in ((bags, recordings), (validate, held_out))
            )
        result = run(
            arm,
            recordings,
            validate=held_out,
            baseline=before,
            against=simulated,
            effects=effects,
            misfit=misfit,
            partner=other,
            prior=dict(one.partition('=')[::2] for one in priors),
            rng=seed,
            progress=tick,
            **settings,
        )
        source = options.kept_source(robot_source, robot, staged.folder)
        files = [*bags, *validate, *baseline, *against]
        origin = options.origin(robot_source, files, seed, source=source)
        result.fill(staged.folder, origin)
        staged.keep()
        result = result.with_extras(residual is not None, seed, tick)
        tick(1.0, 'writing')
        summary = result.summary(str(out / 'model.yaml'), every)
        options.deliver(result, staged, origin, as_json, summary)
    stopped = {'bad_data': 2, **({'unknown': 3, 'not_repeatable': 3} if strict else {})}
    click.get_current_context().exit(stopped.get(result.verdict, 0))


def _identified_from(model: Path, diagnosed: list[Path]) -> tuple[Path, ...]:
    """Return the recordings of a model's identification; () if one of them is diagnosed."""
    from armid_ros.identification.output import identified_from, require_as_identified

    found = identified_from(model)
    if not found or {path.resolve() for path in found} & {path.resolve() for path in diagnosed}:
        return ()
    require_as_identified(model)
    origin = 'which the model was identified from'
    click.echo(f'baseline: {", ".join(map(str, found))}, {origin}', err=True)
    return tuple(found)


def _model_of(path: Path, robot: Robot) -> ArmModel:
    """Read a model.yaml; ArmidError if the kinematics of its robot and of `robot` differ."""
    from armid_ros.arm import load_model
    from armid_ros.cli import options
    from armid_ros.identification.output import kinematics_digest

    arm = options.model_of(path, robot)
    try:
        known = load_model(path).robot
    except ArmidError:  # the description was moved, or is inside a bag
        return arm
    if known.joints == robot.joints and kinematics_digest(known) != kinematics_digest(robot):
        raise ArmidError(
            f'{path}: the joints of this model have other kinematics than those of '
            f'{robot.name}; name the description of the model with --robot, or identify this arm'
        )
    return arm


def open_partner(
    source: str | None, ties: Sequence[str], robot: Robot, gravity: str
) -> Partner | None:
    """
    Load the robot of --partner with its possible ties to the arm; None without --partner.

    Raises
    ------
    ModelError
        If --tie is needed to choose the joints that may be tied, or names an unknown joint.

    """
    from armid_ros.effects.tied import Partner
    from armid_ros.robots import load_robot
    from armid_ros.robots.ties import centroid_ties, leg_ties

    if source is None:
        if ties:
            raise ModelError(
                '--tie also needs --partner, the description of the machine or person that the '
                'arm is tied to'
            )
        return None
    other = load_robot(source, gravity=gravity)
    kept = str(Path(source).resolve()) if Path(source).is_file() else source
    if ties:
        found = [_tie(text, robot, other) for text in ties]
    elif (robot.name, other.name) == ('exoskeleton_legs', 'human_legs'):
        found = list(leg_ties(robot, other))
    elif robot.n_joints != other.n_joints:
        raise ModelError(
            f'{robot.name} has {robot.n_joints} joints, but {other.name} has {other.n_joints}: '
            f'name the tied joints with --tie JOINT=JOINT. The joints of {robot.name} are '
            f'{", ".join(robot.joints)}, those of {other.name} are {", ".join(other.joints)}'
        )
    else:
        pairs = list(zip(robot.joints, other.joints, strict=True))
        found = centroid_ties(robot, other, pairs)
    return Partner(other, tuple(found), kept)


def read_together(
    bags: Sequence[Path],
    recordings: Sequence[Recording],
    partner: Partner,
    topic: str | None,
) -> list[Recording]:
    """Return the recordings of the arm, with the partner's motion from the same bags."""
    from armid_ros.cli import options
    from armid_ros.recording import read_recording, recorded_together

    joints, how = partner.robot.joints, options.read_settings()
    others = [read_recording(bag, joints=joints, topic=topic, settings=how) for bag in bags]
    options.tell_damage(*others)
    return [
        recorded_together(recording, other, partner.robot, partner.ties)
        for recording, other in zip(recordings, others, strict=True)
    ]


def _tie(text: str, robot: Robot, other: Robot) -> Tie:
    from armid_ros.robots.ties import centroid_ties

    ends = [[*listed(end, '@'), ''] for end in parted(text, '=')]
    if len(ends) != 2:
        raise ModelError(f"--tie '{text}' has to be ARM_JOINT=PARTNER_JOINT")
    (joint, point, *_), (far, far_point, *_) = ends
    (tie,) = centroid_ties(robot, other, [(joint, far)])
    return replace(
        tie,
        point=_point(text, point) if point else tie.point,
        other_point=_point(text, far_point) if far_point else tie.other_point,
    )


def _point(text: str, numbers: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(number) for number in numbers.split(','))
    except ValueError:
        raise ModelError(f"--tie '{text}': points are X,Y,Z in the joint's frame [m]") from None
    return x, y, z
