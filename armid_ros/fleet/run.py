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
    Branch,
    estimated,
    FAN_IN,
    merged,
    noise_products_of,
    Packed,
    Root,
    rooted,
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
from armid_ros.fleet.summary import prepare, PreparedBag, Refused
from distributed import as_completed, Client, Future, KilledWorker

#: Times that an arm is begun again whose tasks were on workers that others ended.
_HIT = 3
#: Times that Dask repeats a task whose store failed.
RETRIES = 3
#: Bags of an arm are read together until they are so large [bytes], or so many: about a second of
#: work, of which what Dask does for a task is a small part.
TASK_BYTES, TASK_BAGS = 16_000_000, 16
#: Groups of bags under way: so many, and so many more for every thread of the cluster.
_UNDER_WAY, _MORE = 2, 3
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

    def watch(self, bags: Sequence[BagFile], future: Future) -> None:
        """Count bags when their task ends; those that are lost or shared out will come again."""

        def ended(future: Future) -> None:
            if future.status == 'finished' or (future.status == 'error' and len(bags) == 1):
                self.add(bags)

        future.add_done_callback(ended)

    def add(self, bags: Sequence[BagFile]) -> None:
        """Count bags that have ended."""
        self._ended.update(bag.url for bag in bags)
        self._tell(len(self._ended), self._bags)


#: Bags of an arm that are read by one task.
Group = tuple[BagFile, ...]


@dataclass(frozen=True)
class _Waiting:
    """
    An arm that is to be done: its bags, and those of which it is known that they fail.

    And how often tasks of it were on workers that others ended.

    """

    arm: str
    groups: tuple[Group, ...]
    refused: tuple[Refused, ...] = ()
    hit: int = 0


@dataclass
class _UnderWay:
    """The tasks of an arm, in the order of its groups."""

    arm: _Waiting
    prepared: list[Future]
    root: Future
    noise: list[Future]
    last: Future


def take(bags: Group, job: Job, bags_of_arm: int) -> tuple[PreparedBag, ...]:
    """Task: find bags among the results, or read them and write them there."""
    return tuple(_taken(bag, job, bags_of_arm) for bag in bags)


def same(job: Job) -> Job:
    """Task: hold a job on a worker; unlike scattered data it can be made again."""
    return job


def branch(prepared: Sequence[PreparedBag]) -> Branch:
    """Task: merge the bags of a group, and leave their rows where they are."""
    return merged([Branch.of(one.summary) for one in prepared])


def noise(prepared: Sequence[PreparedBag], root: Root, job: Job) -> Packed | None:
    """Task: what the residuals of a group at its arm's values say of the deviations."""
    return summed([noise_products_of(one, root.fit, job) for one in prepared])


def finish(arm: str, root: Root, products: Sequence[Packed | None], job: Job) -> ArmOutcome:
    """Task: write the estimate of an arm."""
    whole = root.branch
    estimate = estimated(root, summed(products), job)
    if estimate is not None:
        write_arm(Store(job.out), arm, estimate, job)
    problem = '' if estimate is not None else 'no bag of it can be used'
    return ArmOutcome(arm, len(whole.versions), whole.found, whole.refused, problem)


def grouped(bags: Sequence[BagFile]) -> tuple[Group, ...]:
    """
    Share the bags of an arm out to tasks, in order.

    By their sizes alone, so that the tree of merges, and with it the last digit, is the same on
    every cluster. A bag of unknown size is alone.

    """
    groups: list[list[BagFile]] = []
    total = 0
    for bag in bags:
        size = bag.size or TASK_BYTES
        if not groups or total + size > TASK_BYTES or len(groups[-1]) == TASK_BAGS:
            groups.append([])
            total = 0
        groups[-1].append(bag)
        total += size
    return tuple(tuple(group) for group in groups)


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
    waiting: deque[_Waiting] = deque()
    for arm, group in itertools.groupby(sorted(bags), key=lambda bag: bag.arm):
        own = list(group)
        job = job_of[arm]
        refused = arm_is_done(Store(job.out), arm, own, job) if job.resume else None
        if refused is None:
            waiting.append(_Waiting(arm, grouped(own)))
        else:
            done = len(own) - len(refused)
            outcomes.append(ArmOutcome(arm, done, done, tuple(refused)))
            tally.add(own)
    return outcomes + _worked_off(client, waiting, job_of, tally)


def _worked_off(
    client: Client, waiting: deque[_Waiting], job_of: Mapping[str, Job], tally: Tally
) -> list[ArmOutcome]:
    """Work on all arms; begin again with those under way where the scheduler was lost."""
    outcomes: list[ArmOutcome] = []
    for _ in range(_LOST):
        under_way: dict[Any, _UnderWay] = {}
        if _ended(client, waiting, under_way, job_of, tally, outcomes):
            return outcomes
        waiting.extendleft(one.arm for one in under_way.values())
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
    waiting: deque[_Waiting],
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
        while waiting and sum(len(one.prepared) for one in under_way.values()) < limit:
            arm = waiting.popleft()
            job = job_of[arm.arm]
            if job.digest not in jobs:
                jobs[job.digest] = client.submit(same, job, pure=False)
            tasks = _submitted(client, arm, jobs[job.digest], tally)
            under_way[tasks.last.key] = tasks
            ended.add(tasks.last)
        future = next(ended)
        outcome = _fetched(future)
        if future.status in _BROKEN:
            return False
        tasks = under_way.pop(future.key)
        if outcome is not None:
            refused = (*tasks.arm.refused, *outcome.refused)
            outcomes.append(replace(outcome, refused=refused))
            continue
        left, failed = _without_failed(tasks, client, jobs[job_of[tasks.arm.arm].digest])
        for one in failed:
            write_refused(Store(job_of[tasks.arm.arm].out), one, job_of[tasks.arm.arm])
        if left.groups and left != tasks.arm:
            waiting.appendleft(left)
        else:
            problem = 'no bag of it can be used' if failed else _said(future.exception())
            outcomes.append(ArmOutcome(left.arm, refused=left.refused, problem=problem))
    return True


def _fetched(future: Future) -> ArmOutcome | None:
    """Return what became of an arm; None where its tasks failed, which its future then says."""
    try:
        outcome: ArmOutcome = future.result()
    except Exception:
        # Also of an arm that had finished, where its worker ended and it could not be redone.
        return None
    return outcome


def _submitted(client: Client, arm: _Waiting, job: Future, tally: Tally) -> _UnderWay:
    """Submit the tasks of an arm: groups of bags, their tree and its fit, their noise, the end."""

    def submit(task: Callable[..., Any], *arguments: Any, **options: Any) -> Future:
        return client.submit(task, *arguments, pure=False, **options)

    count = sum(len(group) for group in arm.groups)
    prepared = [submit(take, group, job, count, retries=RETRIES) for group in arm.groups]
    for group, future in zip(arm.groups, prepared, strict=True):
        tally.watch(group, future)
    root = submit(rooted, _tree(submit, merged, [submit(branch, one) for one in prepared]), job)
    products = [submit(noise, one, root, job, retries=RETRIES) for one in prepared]
    last = submit(finish, arm.arm, root, _tree(submit, summed, products), job, retries=RETRIES)
    return _UnderWay(arm, prepared, root, products, last)


def _tree(
    submit: Callable[..., Future], join: Callable[..., Any], leaves: list[Future]
) -> list[Future]:
    """Join results, a few at a time, until few are left."""
    level = leaves
    while len(level) > FAN_IN:
        starts = range(0, len(level), FAN_IN)
        level = [submit(join, level[start : start + FAN_IN]) for start in starts]
    return level


def _without_failed(
    tasks: _UnderWay, client: Client, job: Future
) -> tuple[_Waiting, list[Refused]]:
    """
    Return what is left of an arm whose tasks have failed, and the bags that are given up.

    A group that has failed is shared out, bag by bag, to find the one to blame. What waits for a
    task fails with it, so noise is asked of only where all bags were read. What was on a worker
    that another bag ended is held to have ended it as well, and is read once more by itself.

    """
    arm = tasks.arm
    for futures in (tasks.prepared, tasks.noise if tasks.root.status == 'finished' else []):
        if any(future.status == 'error' for future in futures):
            break
    else:
        hit = isinstance(tasks.last.exception(), KilledWorker) and arm.hit < _HIT
        return (replace(arm, hit=arm.hit + 1) if hit else arm), []
    groups: list[Group] = []
    failed: list[Refused] = []
    hit = False
    for group, future in zip(arm.groups, futures, strict=True):
        if future.status != 'error':
            groups.append(group)
        elif len(group) > 1:
            groups.extend((bag,) for bag in group)
        elif isinstance(future.exception(), KilledWorker) and _read(client, group, job):
            groups.append(group)
            hit = True
        else:
            failed.append(Refused(group[0], _said(future.exception()), failed=True))
    hits = arm.hit + (hit and arm.hit < _HIT)
    left = replace(arm, groups=tuple(groups), refused=(*arm.refused, *failed), hit=hits)
    return left, failed


def _read(client: Client, group: Group, job: Future) -> bool:
    """Return whether a group can be read while nothing else of its arm is, as far as is known."""
    future = client.submit(take, group, job, 1, pure=False, retries=RETRIES)
    ended: Future = next(as_completed([future], raise_errors=False))
    return bool(ended.status != 'error')


def _taken(bag: BagFile, job: Job, bags_of_arm: int) -> PreparedBag:
    store = Store(job.out)
    known = find_summary(store, bag, job)
    if known is not None:
        return PreparedBag(known)
    prepared = prepare(bag, job, bags_of_arm)
    if isinstance(prepared.summary, Refused):
        write_refused(store, prepared.summary, job)
    else:
        write_summary(store, prepared.summary, job)
    return prepared


def _said(error: BaseException | None) -> str:
    if isinstance(error, KilledWorker):
        return (
            f'{error.allowed_failures + 1} workers ended while they read it, of too little '
            'memory or by its content'
        )
    if isinstance(error, ArmidError):
        return str(error)
    return ' '.join(f'{type(error).__name__}: {error}'.split())
