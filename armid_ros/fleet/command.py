# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Many arms and many bags: identified on a cluster, watched over time, diagnosed."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

from armid_ros.cli import parameters as options
from armid_ros.errors import FleetError
import click


def _out(command: Callable[..., None]) -> Callable[..., None]:
    """Add --out, a place of results, and --force, to write over files of others."""
    where = click.option(
        '--out', required=True, metavar='URL', help='Folder of the results: a path, or s3://...'
    )
    return where(options.force(command))


_scheduler = click.option(
    '--scheduler',
    metavar='ADDRESS',
    help='Of a Dask cluster, as tcp://host:8786; processes of this machine by default.',
)
_workers = click.option(
    '--workers',
    type=click.IntRange(min=1),
    help='Processes of this machine; one a core by default.',
)
_alpha = click.option(
    '--alpha',
    type=click.FloatRange(0.0, 1.0, min_open=True, max_open=True),
    default=0.05,
    show_default=True,
    help='Share of healthy arms among those named, in the long run.',
)


class _Fleet(click.Group):
    """Says which packages are missing before anything is asked of them."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command of the group."""
        missing = [n for n in ('dask', 'distributed', 'fsspec', 'pyarrow') if not find_spec(n)]
        if missing:
            raise FleetError(
                f'armid fleet needs {", ".join(missing)}: pip install "armid_ros[fleet]"'
            )
        return super().invoke(ctx)


@click.group(
    cls=_Fleet,
    epilog='Example: armid fleet identify "bags/*/*" --robot arm.urdf --out results; '
    'armid fleet watch --out results.',
)
def fleet() -> None:
    """Identify, watch and diagnose many arms with many bags."""


@fleet.command(
    epilog='Example: armid fleet identify "bags/*/*" --robot arm.urdf --out results; '
    'what the first wildcard stands for is the arm.'
)
@click.argument('globs', nargs=-1, required=True, metavar='GLOB...')
@click.option('--robot', 'robot_source', metavar='R', help='Of all arms: shipped name or path.')
@click.option(
    '--robots',
    'table',
    metavar='CSV',
    help='Of each arm: columns arm and robot, if wanted gravity, joints and effects.',
)
@_out
@_scheduler
@_workers
@click.option('--arm', metavar='REGEX', help='Its first group is the arm, in the URL of a bag.')
@options.effects
@click.option(
    '--method',
    type=click.Choice(['ols', 'wls']),
    default='wls',
    show_default=True,
    help='All joints alike, or weighted by their noise.',
)
@click.option('--cutoff', type=float, help='Of the position filter [Hz]; from a few bags, once.')
@click.option('--decimation', type=int, help='Keep one sample of this many.')
@options.topic
@options.gravity
@options.joints
@options.seed
@click.option('--resume', is_flag=True, help='Leave out what earlier runs have done.')
@options.reading
@options.as_json
def identify(
    globs: tuple[str, ...],
    robot_source: str | None,
    table: str | None,
    out: str,
    scheduler: str | None,
    workers: int | None,
    arm: str | None,
    gravity: str,
    joints: str | None,
    as_json: bool,
    **fit: Any,
) -> None:
    """Identify every arm of a fleet from its bags."""
    from armid_ros.fleet.work import ClusterOptions, FleetFitOptions, identify_bags, RobotOptions

    robots = RobotOptions(robot_source, table, gravity, joints)
    cluster = ClusterOptions(scheduler, workers)
    identify_bags(globs, arm, robots, out, cluster, FleetFitOptions(**fit), as_json)


@fleet.command(epilog='Example: armid fleet watch --out results')
@_out
@_alpha
@options.as_json
def watch(out: str, alpha: float, as_json: bool) -> None:
    """Find changes and wear over time, and draw the overview."""
    from armid_ros.fleet.work import watch_arms

    watch_arms(out, alpha, as_json)


@fleet.command(epilog='Example: armid fleet diagnose --out results')
@_out
@_scheduler
@_workers
@click.option('--arm', 'arms', multiple=True, help='Which arm; those that `watch` names, if none.')
@click.option('--all', 'everyone', is_flag=True, help='All arms, whether they changed or not.')
@_alpha
@options.as_json
def diagnose(**values: Any) -> None:
    """Name what has happened to arms, each with its own past as baseline."""
    from armid_ros.fleet.work import diagnose_arms

    diagnose_arms(**values)


@fleet.command(epilog='Example: armid fleet report --out results --arm arm_7 --bag 2026-01-31')
@_out
@click.option('--arm', required=True, help='Which arm.')
@click.option(
    '--bag',
    'bags',
    multiple=True,
    metavar='NAME',
    help='As on the page of the arm, or a URL; those beside its change and the latest, if none.',
)
@options.as_json
def report(out: str, arm: str, bags: tuple[str, ...], as_json: bool) -> None:
    """Make the reports of bags of an arm, and link them on its page."""
    from armid_ros.fleet.work import report_bags

    report_bags(out, arm, bags, as_json)
