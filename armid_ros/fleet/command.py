# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command ``armid fleet``: identify, watch and diagnose many arms on a cluster."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
import time
from typing import Any, TYPE_CHECKING

from armid_ros.cli import parameters as options
from armid_ros.cli.terminal import progress, say
from armid_ros.errors import FleetError
from armid_ros.files import json_text
import click

if TYPE_CHECKING:
    from armid_ros.fleet.store import Store


def _out(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options --out (folder of results) and --force (overwrite files) to a command."""
    where = click.option(
        '--out', required=True, metavar='URL', help='Folder of the results: a path, or s3://...'
    )
    return where(options.force(command))


_scheduler = click.option(
    '--scheduler',
    metavar='ADDRESS',
    help='Address of a Dask cluster, as tcp://host:8786; processes of this machine by default.',
)
_workers = click.option(
    '--workers',
    type=click.IntRange(min=1),
    help='Number of processes of this machine; one per core by default.',
)
_alpha = click.option(
    '--alpha',
    type=click.FloatRange(0.0, 1.0, min_open=True, max_open=True),
    default=0.05,
    show_default=True,
    help='False discovery rate: mean share of healthy arms among the reported arms.',
)


class _Fleet(click.Group):
    """Group of the fleet commands; it raises an error if an optional package is missing."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command of the group; raise a FleetError if an optional package is missing."""
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


@contextmanager
def _results(out: str, doing: str) -> Iterator[tuple[Store, Callable[..., None]]]:
    """Lock the results folder during a command; yield the folder and a progress function."""
    from armid_ros.files import result_folder
    from armid_ros.fleet.plan import SCHEMA
    from armid_ros.fleet.store import Store, StoreError

    store = Store(out)
    try:
        with progress(doing) as tick:
            if store.local is not None:
                context = click.get_current_context()
                forced = bool(context.meta.get(options.FORCE, False))
                context.with_resource(result_folder(store.local, SCHEMA, force=forced))
            yield store, tick
    except StoreError as error:
        raise FleetError(f'{error}; is --out a folder that can be read and written?') from error


def _print_shown(lines: Sequence[str], rest: str) -> None:
    """Print at most eight lines; if there are more, name the file `rest` with all lines."""
    most = 8
    for line in lines[:most]:
        say(line)
    if len(lines) > most:
        say(f'... and {len(lines) - most} more, in {rest}')


def _print_json(name: str, **document: Any) -> None:
    click.echo(json_text({'schema': f'armid/{name}/1', **document}, indent=1))


@fleet.command(
    epilog='Example: armid fleet identify "bags/*/*" --robot arm.urdf --out results; '
    'the first wildcard matches the name of the arm.'
)
@click.argument('globs', nargs=-1, required=True, metavar='GLOB...')
@click.option(
    '--robot', 'robot_source', metavar='R', help='Robot of all arms: shipped name or path.'
)
@click.option(
    '--robots',
    'table',
    metavar='CSV',
    help='Table of the arms: columns arm, robot; optional are gravity, joints, effects.',
)
@_out
@_scheduler
@_workers
@click.option(
    '--arm',
    metavar='REGEX',
    help='Regular expression whose first group is the arm, in the URL of a bag.',
)
@options.effects
@click.option(
    '--method',
    type=click.Choice(['ols', 'wls']),
    default='wls',
    show_default=True,
    help='Least squares with equal weights (ols), or with joints weighted by their noise (wls).',
)
@click.option(
    '--cutoff', type=float, help='Position filter cut-off [Hz]; default: from a few bags.'
)
@click.option('--decimation', type=int, help='Decimation: fit every k-th sample.')
@options.topic
@options.gravity
@options.joints
@options.seed
@click.option('--resume', is_flag=True, help='Skip bags that earlier runs have processed.')
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
    method: str,
    cutoff: float | None,
    decimation: int | None,
    joints: str | None,
    as_json: bool,
    **settings: Any,
) -> None:
    """Identify every arm of a fleet from its bags."""
    from armid_ros.cli.options import read_settings
    from armid_ros.fleet.bags import find_bags
    from armid_ros.fleet.cluster import connected
    from armid_ros.fleet.plan import FleetSettings, plan_fleet, read_table
    from armid_ros.fleet.run import identify_fleet
    from armid_ros.identification import SignalSettings

    if (robot_source is None) == (table is None):
        raise FleetError(
            'give either the robot of all arms with --robot, or a table of robots with --robots'
        )
    robots = read_table(table) if table is not None else str(robot_source)
    fit = FleetSettings(
        joints=joints or '',
        weighted=method == 'wls',
        signals=SignalSettings(cutoff, decimation),
        reading=read_settings(),
        **settings,
    )
    start = time.monotonic()
    with _results(out, 'listing bags') as (_, tick):
        bags = find_bags(globs, arm)
        jobs = plan_fleet(bags, robots, out, fit)
        tick(0.0, 'starting workers')
        with connected(scheduler, workers) as client:
            outcome = identify_fleet(
                client, bags, jobs, lambda ended, of: tick(ended / of, f'{ended} of {of} bags')
            )
    refused = [
        {
            'arm': one.bag.arm,
            'bag': one.bag.url,
            'what': 'failed' if one.failed else 'refused',
            'reason': one.reason,
        }
        for one in outcome.refused
    ]
    without = {one.arm: one.problem for one in outcome.arms if one.problem}
    if as_json:
        counts = {'arms': len(outcome.arms), 'bags': outcome.done + len(refused)}
        done = {'done': outcome.done, 'found': outcome.found}
        _print_json(
            'fleet-run', out=out, **counts, **done, refused=refused, without_estimate=without
        )
        return
    found = f', {outcome.found} of them by earlier runs' if outcome.found else ''
    say(
        f'{len(outcome.arms)} arms: {outcome.done} bags done{found}, {len(refused)} refused, '
        f'in {time.monotonic() - start:.0f} s'
    )
    lines = [f'{name}: no estimate: {problem}' for name, problem in without.items()]
    lines += [f'{one["arm"]}: {one["what"]}: {one["bag"]}: {one["reason"]}' for one in refused]
    _print_shown(lines, f'{out}/refused')
    used = [
        f'{robot}: as `armid identify --cutoff {filters.cutoff_hz:.6g} '
        f'--decimation {filters.decimation}`'
        for robot, filters in outcome.filters.items()
    ]
    _print_shown(used, f'{out}/fleet.json')
    say(f'{out}: bags, parameters, arms, refused (Parquet), fleet.json')


@fleet.command(epilog='Example: armid fleet watch --out results')
@_out
@_alpha
@options.as_json
def watch(out: str, alpha: float, as_json: bool) -> None:
    """Find changes and wear of all arms over time, and write the overview page."""
    from armid_ros.fleet.pages import write_pages
    from armid_ros.fleet.watch import change_rows, watch_fleet, write_watch

    with _results(out, 'reading results') as (store, tick):
        found = watch_fleet(store, alpha)
        tick(0.5, 'writing')
        write_watch(store, found)
        write_pages(store, found)
    rows: list[Mapping[str, Any]] = [row for arm in found.arms for row in change_rows(arm)[:1]]
    if as_json:
        _print_json('fleet-watch', changes=rows)
        return
    counts = dict.fromkeys(('changed', 'wearing', 'healthy', 'too few bags'), 0)
    for arm in found.arms:
        counts[arm.health] += 1
    say(', '.join(f'{count} {word}' for word, count in counts.items() if count))
    _print_shown([f'{row["arm"]}: {row["text"]}' for row in rows], f'{out}/alarms.jsonl')
    say(f'{out}: index.html, pages/, watch/ (Parquet), alarms.jsonl')


@fleet.command(epilog='Example: armid fleet diagnose --out results')
@_out
@_scheduler
@_workers
@click.option(
    '--arm', 'arms', multiple=True, help='Arm to diagnose; by default every arm with a change.'
)
@click.option('--all', 'everyone', is_flag=True, help='Diagnose all arms, changed or not.')
@_alpha
@options.as_json
def diagnose(
    out: str,
    scheduler: str | None,
    workers: int | None,
    arms: tuple[str, ...],
    everyone: bool,
    alpha: float,
    as_json: bool,
) -> None:
    """Diagnose arms of a fleet; the baseline of each arm is its earlier bags."""
    from armid_ros.fleet.cluster import connected
    from armid_ros.fleet.diagnose import cases, diagnose_fleet
    from armid_ros.fleet.pages import write_pages
    from armid_ros.fleet.watch import watch_fleet, write_watch
    from armid_ros.report.notation import pretty

    rows: list[dict[str, Any]] = []
    with _results(out, 'reading results') as (store, tick):
        found = watch_fleet(store, alpha)
        chosen = cases(found, arms, everyone)
        if chosen:
            with connected(scheduler, workers) as client:
                rows = diagnose_fleet(
                    client,
                    store,
                    chosen,
                    found,
                    lambda ended, of: tick(ended / of, f'{ended} of {of} arms'),
                )
        write_watch(store, found)
        write_pages(store, found)
    if as_json:
        _print_json('fleet-diagnoses', arms=rows)
        return
    words = Counter(row['verdict'].replace('_', ' ') for row in rows)
    counts = ', '.join(f'{count} {word}' for word, count in words.most_common())
    say(
        f'{len(rows)} diagnosed: {counts}'
        if rows
        else 'No arm changed; use --arm or --all to diagnose others.'
    )
    lines = [f'{row["arm"]}: {row["verdict"].replace("_", " ")}: {row["summary"]}' for row in rows]
    _print_shown(list(map(pretty, lines)), f'{out}/reports')
    say(f'{out}: index.html, pages/, reports/, watch/diagnoses.parquet')
