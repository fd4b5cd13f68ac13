# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A run over a fleet: which tasks there are, and what becomes of every bag."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
import itertools
import time
from typing import Any

from armid_ros.errors import ArmidError, FleetError
from armid_ros.fleet.bags import BagFile
from armid_ros.fleet.job import Job
from armid_ros.fleet.merge import (
    ArmFit,
    Branch,
    estimated,
    FAN_IN,
    fitted,
    merged,
    noise_products_of,
    Packed,
    summed,
)
from armid_ros.fleet.results import (
    arm_is_done,
    find_summary,
    write_arm,
    write_refused,
    write_summary,
)
from armid_ros.fleet.store import Store
from armid_ros.fleet.summary import prepare, Prepared, Refused
from distributed import as_completed, Client, Future, KilledWorker

#: Times that Dask repeats a task whose store failed.
RETRIES = 3
#: Bags under way: so many, and so many more for every thread of the cluster.
_UNDER_WAY, _MORE = 32, 8
#: Times that a scheduler may be lost.
_LOST = 5
#: How often is looked whether it is back [s].
_LOOK_EVERY = 0.1
#: What tasks are called whose scheduler is gone.
_BROKEN = ('cancelled', 'lost')


@dataclass(frozen=True)
class ArmOutcome:
    """
    What became of the bags of an arm.

    Attributes
    ----------
    arm : str
        Which one.
    done : int
        Bags that its estimate is made of.
    found : int
        Of these, those that an earlier run had read.
    refused : tuple of Refused
        The others.
    problem : str
        Why there is no estimate; empty where there is one.

    """

    arm: str
    done: int = 0
    found: int = 0
    refused: tuple[Refused, ...] = ()
    problem: str = ''


class Tally:
    """
    How far a run is.

    Parameters
    ----------
    bags : int
        All of them.
    tell : callable
        Told how many have ended, and how many there are.

    """

    def __init__(self, bags: int, tell: Callable[[int, int], None]) -> None:
        self._bags, self._tell = bags, tell
        self._ended: set[str] = set()

    def watch(self, bag: BagFile, future: Future) -> None:
        """Count a bag when its task ends; one that is lost will come again."""

        def ended(future: Future) -> None:
            if future.status in ('finished', 'error'):
                self.add([bag])

        future.add_done_callback(ended)

    def add(self, bags: Sequence[BagFile]) -> None:
        """Count bags that have ended."""
        self._ended.update(bag.url for bag in bags)
        self._tell(len(self._ended), self._bags)


@dataclass
class _UnderWay:
    """The tasks of an arm."""

    arm: str
    bags: list[BagFile]
    refused: tuple[Refused, ...]
    prepared: dict[BagFile, Future]
    fit: Future
    noise: dict[BagFile, Future]
    last: Future


def take(bag: BagFile, job: Job, bags_of_arm: int) -> Prepared:
    """Task: find a bag among the results, or read it and write it there."""
    store = Store(job.out)
    known = find_summary(store, bag, job)
    if known is not None:
        return Prepared(known)
    prepared = prepare(bag, job, bags_of_arm)
    if isinstance(prepared.summary, Refused):
        write_refused(store, prepared.summary, job)
    else:
        write_summary(store, prepared.summary, job)
    return prepared


def same(job: Job) -> Job:
    """Task: hold a job on a worker; unlike scattered data it can be made again."""
    return job


def branch(prepared: Prepared) -> Branch:
    """Task: leave the rows where they are."""
    return Branch.of(prepared.summary)


def finish(
    arm: str, whole: Branch, fit: ArmFit | None, products: Packed | None, job: Job
) -> ArmOutcome:
    """Task: write the estimate of an arm."""
    estimate = estimated(whole, fit, products, job)
    if estimate is not None:
        write_arm(Store(job.out), arm, estimate, job)
    problem = '' if estimate is not None else 'no bag of it can be used'
    return ArmOutcome(arm, len(whole.versions), whole.found, whole.refused, problem)


def run_fleet(
    client: Client,
    bags: Sequence[BagFile],
    job_of: Mapping[str, Job],
    tell: Callable[[int, int], None] = lambda finished, bags: None,
) -> list[ArmOutcome]:
    """
    Identify every arm of a fleet.

    Parameters
    ----------
    client : distributed.Client
        A cluster.
    bags : sequence of BagFile
        All bags.
    job_of : mapping of str to Job
        Model and filters of every arm.
    tell : callable
        Told how many bags have ended, and how many there are.

    Raises
    ------
    FleetError
        The scheduler was lost and did not come back.

    """
    tally = Tally(len(bags), tell)
    outcomes: list[ArmOutcome] = []
    waiting: deque[tuple[str, list[BagFile], tuple[Refused, ...]]] = deque()
    for arm, group in itertools.groupby(sorted(bags), key=lambda bag: bag.arm):
        own = list(group)
        job = job_of[arm]
        refused = arm_is_done(Store(job.out), arm, own, job) if job.resume else None
        if refused is None:
            waiting.append((arm, own, ()))
        else:
            done = len(own) - len(refused)
            outcomes.append(ArmOutcome(arm, done, done, tuple(refused)))
            tally.add(own)
    return outcomes + _worked_off(client, waiting, job_of, tally)


def _worked_off(
    client: Client,
    waiting: deque[tuple[str, list[BagFile], tuple[Refused, ...]]],
    job_of: Mapping[str, Job],
    tally: Tally,
) -> list[ArmOutcome]:
    """Work on all arms; begin again with those under way where the scheduler was lost."""
    outcomes: list[ArmOutcome] = []
    for _ in range(_LOST):
        under_way: dict[Any, _UnderWay] = {}
        if _ended(client, waiting, under_way, job_of, tally, outcomes):
            return outcomes
        waiting.extendleft((one.arm, one.bags, one.refused) for one in under_way.values())
        while client.status == 'connecting':
            time.sleep(_LOOK_EVERY)
        if client.status != 'running':
            break
    raise FleetError(
        'the scheduler was lost, and with it the tasks; what is done is kept: run the same '
        'command again with --resume'
    )


def _ended(
    client: Client,
    waiting: deque[tuple[str, list[BagFile], tuple[Refused, ...]]],
    under_way: dict[Any, _UnderWay],
    job_of: Mapping[str, Job],
    tally: Tally,
    outcomes: list[ArmOutcome],
) -> bool:
    """Keep so many arms under way that no worker waits; return False when all were lost."""
    limit = _UNDER_WAY + _MORE * sum(client.nthreads().values())
    jobs: dict[str, Future] = {}
    ended = as_completed(raise_errors=False)
    while waiting or under_way:
        while waiting and sum(len(one.bags) for one in under_way.values()) < limit:
            arm, bags, refused = waiting.popleft()
            job = job_of[arm]
            if job.digest not in jobs:
                jobs[job.digest] = client.submit(same, job, pure=False)
            tasks = _submitted(client, arm, bags, refused, jobs[job.digest], tally)
            under_way[tasks.last.key] = tasks
            ended.add(tasks.last)
        future = next(ended)
        if future.status in _BROKEN:
            return False
        tasks = under_way.pop(future.key)
        if future.status == 'finished':
            outcome: ArmOutcome = future.result()
            outcomes.append(replace(outcome, refused=(*tasks.refused, *outcome.refused)))
            continue
        failed = _failed(tasks)
        for one in failed:
            write_refused(Store(job_of[tasks.arm].out), one, job_of[tasks.arm])
        refused, out = (*tasks.refused, *failed), {one.bag for one in failed}
        rest = [bag for bag in tasks.bags if bag not in out]
        if failed and rest:
            waiting.appendleft((tasks.arm, rest, refused))
        else:
            problem = 'no bag of it can be used' if failed else _said(future.exception())
            outcomes.append(ArmOutcome(tasks.arm, refused=refused, problem=problem))
    return True


def _submitted(
    client: Client,
    arm: str,
    bags: list[BagFile],
    refused: tuple[Refused, ...],
    job: Future,
    tally: Tally,
) -> _UnderWay:
    """Submit the tasks of an arm: bags, their tree, the fit, its noise, the end."""

    def submit(task: Callable[..., Any], *arguments: Any, **options: Any) -> Future:
        return client.submit(task, *arguments, pure=False, **options)

    prepared = {bag: submit(take, bag, job, len(bags), retries=RETRIES) for bag in bags}
    for bag, future in prepared.items():
        tally.watch(bag, future)
    whole = _tree(submit, merged, [submit(branch, one) for one in prepared.values()])
    fit = submit(fitted, whole, job)
    noise = {
        bag: submit(noise_products_of, one, fit, job, retries=RETRIES)
        for bag, one in prepared.items()
    }
    products = _tree(submit, summed, list(noise.values()))
    last = submit(finish, arm, whole, fit, products, job, retries=RETRIES)
    return _UnderWay(arm, bags, refused, prepared, fit, noise, last)


def _tree(submit: Callable[..., Future], join: Callable[..., Any], leaves: list[Future]) -> Future:
    """Join results, a few at a time."""
    level = leaves
    while True:
        starts = range(0, len(level), FAN_IN)
        level = [submit(join, level[start : start + FAN_IN]) for start in starts]
        if len(level) == 1:
            return level[0]


def _failed(tasks: _UnderWay) -> list[Refused]:
    """Return the bags whose own tasks have failed; what waits for them fails with them."""
    for futures in (tasks.prepared, tasks.noise if tasks.fit.status == 'finished' else {}):
        failed = [(bag, future) for bag, future in futures.items() if future.status == 'error']
        if failed:
            return [Refused(bag, _said(future.exception()), failed=True) for bag, future in failed]
    return []


def _said(error: BaseException | None) -> str:
    if isinstance(error, KilledWorker):
        return (
            f'{error.allowed_failures + 1} workers ended while they read it, of too little '
            'memory or by its content'
        )
    if isinstance(error, ArmidError):
        return str(error)
    return ' '.join(f'{type(error).__name__}: {error}'.split())
