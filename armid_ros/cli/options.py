# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Work that several commands share: reading their inputs, and writing and printing results."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
import shlex
import sys
from typing import Any, TYPE_CHECKING

from armid_ros.api.table import Shown, Summary
from armid_ros.arm import ArmModel, load_model
from armid_ros.cli import columns
from armid_ros.cli.commands import NOTES
from armid_ros.cli.following import next_command
from armid_ros.cli.parameters import CRC, FORCE, MEMORY
from armid_ros.cli.terminal import say
from armid_ros.errors import ModelError, RobotError, visible
from armid_ros.files import (
    default_memory_limit,
    json_text,
    reading,
    result_folder,
    Staged,
    staged,
    write_file,
)
from armid_ros.files.cells import listed
from armid_ros.files.output import hash_files, WRITES
from armid_ros.identification import write_document
from armid_ros.motion import FloatArray
from armid_ros.recording import read_robot_description, ReadSettings, Recording
from armid_ros.recording.columns import numbers
from armid_ros.recording.columns import per_joint as values_per_joint
from armid_ros.recording.reader import is_table, read_recording
from armid_ros.report.blocks import VerdictSection
from armid_ros.report.provenance import Provenance, ResultOrigin, versions
from armid_ros.robots import driven_in_words, load_robot, parse_gravity, Robot, robot_from_urdf
import click
from click.core import ParameterSource
import numpy as np

if TYPE_CHECKING:
    from armid_ros.recording.tables import TablePlan

Corners = tuple[Sequence[float], Sequence[float]]

#: Context key of the table plans that were printed.
_SHOWN = 'armid.columns.shown'


def stage(out: Path, schema: str, robot: str = '', also: Collection[str] = ()) -> Staged:
    """
    Create and lock the results folder of a command; return the staging folder.

    Files appear in the folder only when the command keeps the staging folder. Other files of an
    earlier result are then removed, except a description that --robot names. With --force, files
    that are not replaced stay.

    Parameters
    ----------
    out : Path
        The folder.
    schema : str
        Schema of the results.
    robot : str
        Name of the robot in the results.
    also : collection of str
        Names of further files that the command writes.

    """
    context = click.get_current_context()
    forced = bool(context.meta.get(FORCE, False))
    context.with_resource(result_folder(out, schema, robot, also=also, force=forced))
    replaced = () if forced else (*WRITES.get(schema, ()), *also)
    spared = (out / 'robot.urdf', *(Path(part) for part in (robot, robot.split(' ')[0]) if part))
    return context.with_resource(staged(out, replaced, spared))


def deliver(
    result: Shown,
    staged: Staged | None,
    origin: ResultOrigin,
    as_json: bool,
    summary: Summary | None = None,
) -> None:
    """
    Print the summary or the JSON document of a result; write its files to a given folder.

    Parameters
    ----------
    result : Shown
        The result.
    staged : Staged or None
        Staging folder; None: the result is only printed.
    origin : ResultOrigin
        Provenance of the result.
    as_json : bool
        Whether the document is printed in place of the summary.
    summary : Summary, optional
        Summary to print; by default that of the result.

    """
    document, shown = None, summary or result.summary()
    step = next_command(shown.then, result) if shown.then else ''
    if staged is not None:
        document = result.fill(staged.folder, replace(origin, step=step))
        staged.keep()
    if as_json:
        click.echo(json_text(document or result.document(origin)))
        return
    files = [] if staged is None else [f'{staged.out}: {", ".join(result.files)}']
    for line in shown.text(*files):
        say(line)
    if step:
        say(f'next: {step}')


def deliver_page(
    staged: Staged,
    page: str,
    name: str,
    document: Mapping[str, Any],
    verdict: VerdictSection,
    table: tuple[Sequence[str], Sequence[Sequence[str]]] | None,
) -> None:
    """Write report.html and NAME.json; print verdict and table, or else the document."""
    write_file(staged.folder / 'report.html', page)
    summary = None
    if table is not None:
        first, *others = verdict.sentences
        lines, steps = [*others, *verdict.beware], [verdict.step] if verdict.step else []
        summary = Summary(first, verdict.grade, *table, lines, steps)
    deliver_document(staged, name, document, summary, 'report.html')


def deliver_document(
    staged: Staged, name: str, document: Mapping[str, Any], summary: Summary | None, *files: str
) -> None:
    """Write NAME.json and keep the staging folder; print the summary, or else the document."""
    write_document(staged.folder / f'{name}.json', document)
    staged.keep()
    if summary is None:
        click.echo(json_text(document))
        return
    for line in summary.text(f'{staged.out}: {", ".join([f"{name}.json", *files])}'):
        say(line)


def provenance(
    paths: Iterable[Path], settings: Mapping[str, Any] | None = None, seed: int | None = None
) -> Provenance:
    """
    Return the provenance of the running command.

    Parameters
    ----------
    paths : iterable of Path
        Files and folders that the command reads.
    settings : mapping of str to object, optional
        Settings that the command uses.
    seed : int, optional
        Seed of the random numbers.

    """

    def text(value: Any) -> str:
        if isinstance(value, list):
            return ', '.join(map(text, value))
        return f'{value:.6g}' if isinstance(value, float) else str(value)

    return Provenance(
        files=hash_files(paths),
        versions=versions(),
        settings={name: text(value) for name, value in (settings or {}).items()},
        seed=seed,
        command=shlex.join(['armid', *sys.argv[1:]]),
        created=datetime.now().astimezone().isoformat(' ', 'seconds'),
    )


def origin(
    robot: str, paths: Iterable[Path], seed: int | None = None, source: str = ''
) -> ResultOrigin:
    """Return the origin of a result: text of --robot, source of the robot, provenance."""
    return ResultOrigin(robot, source, provenance(paths, seed=seed))


def read_settings() -> ReadSettings:
    """Return the settings for reading bags from the options of the running command."""
    meta = click.get_current_context().meta
    limit = meta.get(MEMORY)
    size = default_memory_limit() if limit is None else int(limit * 1e6)
    return ReadSettings(check_crc=bool(meta.get(CRC, True)), memory_limit=size)


def tell_damage(*recordings: Recording) -> None:
    """Print the damage of recordings on stderr, each message once."""
    for text in dict.fromkeys(
        f'{r.source}: {r.report.damage}' for r in recordings if r.report.damage
    ):
        click.echo(visible(text), err=True)


def open_robot(
    source: str,
    gravity: str,
    joints: str | Sequence[str] | None,
    bags: Sequence[Path] = (),
    tell: bool = True,
) -> Robot:
    """Load the robot that the options name; store notes, which are printed at the end."""
    named = listed(joints) if isinstance(joints, str) else joints
    if source != '-':
        robot = load_robot(source, gravity=gravity, joints=named or None)
    else:
        texts = (
            (path, None if is_table(path) else read_robot_description(path, read_settings()))
            for path in bags
        )
        held = next(((path, text) for path, text in texts if text is not None), None)
        if held is None:
            raise RobotError(
                f'no /robot_description in {", ".join(map(str, bags)) or "any bag"}; '
                'name the URDF with --robot'
            )
        path, text = held
        robot = robot_from_urdf(text, gravity=gravity, joints=named or None, source=str(path))
    if tell:
        lines = driven_in_words(robot) if joints is None else ()
        notes = click.get_current_context().meta.setdefault(NOTES, [])
        doubts = robot.description.inertia_doubts()
        found = [visible(f'note: {line}') for line in (*lines, *doubts)]
        notes += [line for line in found if line not in notes]
    return robot


def model_of(path: Path, robot: Robot | None) -> ArmModel:
    """
    Read a model.yaml, for the given robot or for the robot that the file names.

    Raises
    ------
    ModelError
        If the file cannot be read, or has another gravity than --gravity.

    """
    arm = load_model(path, robot)
    context = click.get_current_context()
    if context.get_parameter_source('gravity') is not ParameterSource.COMMANDLINE:
        return arm
    given, own = parse_gravity(context.params['gravity']), arm.robot.gravity
    if not np.allclose(given, own):
        typed, known = (','.join(f'{part:g}' for part in vector) for vector in (given, own))
        raise ModelError(
            f'{path}: the model has gravity {known}, but --gravity is {typed}: leave it out, or '
            'write the other gravity into the file if the mounting of the arm has changed'
        )
    return arm


def box(text: str, robot: Robot) -> tuple[str, Corners]:
    """Convert the text of --box to a joint name and the two corners of a box [m]."""
    *parts, corners = listed(text, '=')
    joint = '='.join(parts)
    robot.index(joint)
    try:
        lower, upper = ([float(x) for x in corner.split(',')] for corner in corners.split(':'))
    except ValueError:
        lower = upper = []
    if len(lower) != 3 or len(upper) != 3:
        raise RobotError(f"--box '{text}' has to be JOINT=X,Y,Z:X,Y,Z, two corners in metres")
    return joint, (lower, upper)


def per_joint(text: str | None, robot: Robot, option: str) -> FloatArray | None:
    """Convert a text with one number, or one per joint, to an array (n,); None without text."""
    with reading(option, RobotError):
        return None if text is None else values_per_joint(numbers(text), robot.joints, repr(text))


def read(
    paths: Sequence[Path], robot: Robot | None, topic: str | None, **known: Any
) -> list[Recording]:
    """
    Read recordings from bags and tables; print guessed columns on stderr, each once.

    Without a robot, further arguments of `read_recording` state what is known of the joints.

    """
    settings, reading = columns.settings(), read_settings()
    shown: set[str] = click.get_current_context().meta.setdefault(_SHOWN, set())

    def show(plan: TablePlan) -> None:
        lines = plan.lines()
        body = '\n'.join(lines[1:])
        if plan.guessed or plan.notes:
            click.echo('\n'.join(lines) if body not in shown else f'{lines[0]}, alike', err=True)
        shown.add(body)

    if robot is not None:
        known = {'joints': robot.joints, 'slides': list(robot.prismatic)}
    return [
        read_recording(path, topic=topic, columns=settings, show=show, settings=reading, **known)
        for path in paths
    ]


def kept_source(source: str, robot: Robot, out: Path) -> str:
    """Return path or name of the robot for result files; write the URDF of a bag to `out`."""
    if source == '-':
        write_file(out / 'robot.urdf', robot.urdf)
        return 'robot.urdf'
    path, *arguments = source.split(' ') if ':=' in source else [source]
    kept = str(Path(path).resolve()) if Path(path).is_file() else path
    return ' '.join([kept, *arguments])
