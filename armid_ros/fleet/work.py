# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Many arms and many bags: identified on a cluster, watched over time, diagnosed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
import time
from typing import Any, TYPE_CHECKING

from armid_ros.cli import options
from armid_ros.cli.terminal import print_rows, progress, say
from armid_ros.errors import FleetError
from armid_ros.files import json_text
from armid_ros.identification import SignalSettings
import click

if TYPE_CHECKING:
    from armid_ros.fleet.identify import FleetOutcome
    from armid_ros.fleet.store import Store
    from distributed import Client

#: Refused bags that are shown; all are in the table `refused`.
_SHOWN = 20


@dataclass(frozen=True)
class RobotOptions:
    """
    Which robots the arms are.

    Attributes
    ----------
    robot_source : str or None
        That of all arms.
    table : str or None
        A CSV with that of each.
    gravity : str
        A name, or a vector [m/s^2].
    joints : str or None
        Driven joints with commas.

    """

    robot_source: str | None
    table: str | None
    gravity: str
    joints: str | None


@dataclass(frozen=True)
class ClusterOptions:
    """
    Where it is done.

    Attributes
    ----------
    scheduler : str or None
        Address of a Dask cluster.
    workers : int or None
        Processes of this machine.

    """

    scheduler: str | None
    workers: int | None


@dataclass(frozen=True)
class FleetFitOptions:
    """
    What is fitted to every bag.

    Attributes
    ----------
    effects, method : str
        What acts beside the rigid body, and the least squares.
    cutoff : float or None
        Of the position filter [Hz].
    decimation : int or None
        One sample of this many is kept.
    topic : str or None
        Of the joint states.
    seed : int
        Of every random number.
    resume : bool
        Whether what is done already is left out.

    """

    effects: str
    method: str
    cutoff: float | None
    decimation: int | None
    topic: str | None
    seed: int
    resume: bool


@contextmanager
def _place_of_results() -> Iterator[None]:
    """Say of a place of results that fails that it may be --out."""
    from armid_ros.fleet.store import StoreError

    try:
        yield
    except StoreError as error:
        raise FleetError(f'{error}; is --out a folder that can be read and written?') from error


@_place_of_results()
def identify_bags(
    globs: tuple[str, ...],
    arm: str | None,
    robots: RobotOptions,
    out: str,
    cluster: ClusterOptions,
    fit: FleetFitOptions,
    as_json: bool,
) -> None:
    """Identify every arm of a fleet from its bags."""
    from armid_ros.fleet.bags import find_bags
    from armid_ros.fleet.identify import FleetSettings, identify_fleet, plan_fleet
    from armid_ros.fleet.kinds import read_table
    from armid_ros.fleet.store import Store

    if (robots.robot_source is None) == (robots.table is None):
        raise FleetError('name the robot of all arms with --robot, or a table with --robots')
    settings = FleetSettings(
        effects=fit.effects,
        gravity=robots.gravity,
        joints=robots.joints or '',
        weighted=fit.method == 'wls',
        signals=SignalSettings(fit.cutoff, fit.decimation),
        topic=fit.topic,
        resume=fit.resume,
        seed=fit.seed,
        reading=options.read_settings(),
    )
    meant = read_table(robots.table) if robots.table is not None else str(robots.robot_source)
    start = time.monotonic()
    with progress('listing bags') as tick:
        bags = find_bags(globs, arm)
        _hold(Store(out))
        jobs = plan_fleet(bags, meant, out, settings)
        tick(0.0, 'starting workers')
        with _cluster(cluster.scheduler, cluster.workers) as client:
            outcome = identify_fleet(
                client,
                bags,
                jobs,
                lambda ended, of: tick(ended / of, f'{ended} of {of} bags'),
            )
    _print(outcome, out, time.monotonic() - start, as_json)


def _hold(store: Store) -> None:
    """Keep a folder of this machine for the results of this command as long as it runs."""
    from armid_ros.fleet.kinds import SCHEMA

    if store.local is not None:
        options.hold(store.local, SCHEMA)


@contextmanager
def _cluster(scheduler: str | None, workers: int | None) -> Iterator[Client]:
    from armid_ros.fleet.cluster import connected

    with connected(scheduler, workers) as client:
        yield client


def _print(outcome: FleetOutcome, out: str, seconds: float, as_json: bool) -> None:
    refused = [
        {
            'arm': one.bag.arm,
            'bag': one.bag.url,
            'what': 'failed' if one.failed else 'refused',
            'reason': one.reason,
        }
        for one in outcome.refused
    ]
    if as_json:
        document = {
            'schema': 'armid/fleet-run/1',
            'out': out,
            'arms': len(outcome.arms),
            'bags': outcome.done + len(refused),
            'done': outcome.done,
            'found': outcome.found,
            'refused': refused,
            'without_estimate': {arm.arm: arm.problem for arm in outcome.arms if arm.problem},
        }
        click.echo(json_text(document, indent=1))
        return
    found = f', {outcome.found} of them by earlier runs' if outcome.found else ''
    say(
        f'{len(outcome.arms)} arms: {outcome.done} bags done{found}, {len(refused)} refused, '
        f'in {seconds:.0f} s'
    )
    for robot, filters in outcome.filters.items():
        say(
            f'{robot}: as `armid identify --cutoff {filters.cutoff_hz:.6g} '
            f'--decimation {filters.decimation}`'
        )
    for arm in outcome.arms:
        if arm.problem:
            say(f'{arm.arm}: no estimate: {arm.problem}')
    if refused:
        print_rows(refused[:_SHOWN], as_json=False)
        if len(refused) > _SHOWN:
            say(f'... and {len(refused) - _SHOWN} more, in {out}/refused')
    say(f'{out}: bags, parameters, arms, refused (Parquet), fleet.json')


@_place_of_results()
def watch_arms(out: str, alpha: float, as_json: bool) -> None:
    """Find changes and wear over time, and draw the overview."""
    from armid_ros.fleet.pages import write_pages
    from armid_ros.fleet.store import Store
    from armid_ros.fleet.watch import change_rows, write_watch
    from armid_ros.fleet.watch import watch as look

    store = Store(out)
    _hold(store)
    with progress('reading results') as tick:
        found = look(store, alpha)
        tick(0.5, 'writing')
        write_watch(store, found)
        write_pages(store, found)
    rows = [row for arm in found.arms for row in change_rows(arm)[:1]]
    if as_json:
        click.echo(json_text({'schema': 'armid/fleet-watch/1', 'changes': rows}, indent=1))
        return
    counts = dict.fromkeys(('changed', 'wearing', 'healthy', 'too few bags'), 0)
    for arm in found.arms:
        counts[arm.health] += 1
    say(', '.join(f'{count} {word}' for word, count in counts.items() if count))
    for row in rows[:_SHOWN]:
        say(f'{row["arm"]}: {row["text"]}')
    if len(rows) > _SHOWN:
        say(f'... and {len(rows) - _SHOWN} more, in {out}/alarms.jsonl')
    say(f'{out}: index.html, pages/, watch/ (Parquet), alarms.jsonl')


@_place_of_results()
def diagnose_arms(
    out: str,
    scheduler: str | None,
    workers: int | None,
    arms: tuple[str, ...],
    everyone: bool,
    alpha: float,
    as_json: bool,
) -> None:
    """Name what has happened to arms, each with its own past as baseline."""
    from armid_ros.fleet.diagnose import cases, diagnose_fleet
    from armid_ros.fleet.pages import write_pages
    from armid_ros.fleet.store import Store
    from armid_ros.fleet.watch import watch as look
    from armid_ros.fleet.watch import write_watch

    store = Store(out)
    _hold(store)
    with progress('reading results') as tick:
        found = look(store, alpha)
        chosen = cases(found, arms, everyone)
        rows: list[dict[str, Any]] = []
        if chosen:
            with _cluster(scheduler, workers) as client:
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
        click.echo(json_text({'schema': 'armid/fleet-diagnoses/1', 'arms': rows}, indent=1))
        return
    if not rows:
        say('no arm is named; --arm or --all diagnose others')
    for row in rows:
        say(f'{row["arm"]}: {row["verdict"].replace("_", " ")}: {row["summary"]}')
    say(f'{out}: index.html, pages/, reports/, watch/diagnoses.parquet')


@_place_of_results()
def report_bags(out: str, arm: str, bags: tuple[str, ...], as_json: bool) -> None:
    """Make the reports of bags of an arm, and link them on its page."""
    from armid_ros.fleet.bag_reports import asked_bags, write_reports
    from armid_ros.fleet.pages import write_arm_page
    from armid_ros.fleet.store import Store
    from armid_ros.fleet.watch import watch as look

    store = Store(out)
    _hold(store)
    with progress('reading results') as tick:
        found = look(store)
        urls = asked_bags(found, arm, bags)
        watched = next(one for one in found.arms if one.arm == arm)
        written = write_reports(
            store, watched, urls, lambda ended, of: tick(ended / of, f'{ended} of {of} bags')
        )
        write_arm_page(store, found, watched)
    if as_json:
        click.echo(json_text({'schema': 'armid/fleet-reports/1', 'reports': written}, indent=1))
        return
    for name in written:
        say(f'{out}/{name}')
