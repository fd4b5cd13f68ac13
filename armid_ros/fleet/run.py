# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identification of a fleet on a cluster: Dask tasks of every arm, and the outcomes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
import itertools
from typing import Any

from armid_ros.errors import ArmidError, FleetError
from armid_ros.fleet.bags import BagFile
from armid_ros.fleet.merge import BagSummary, FleetFit, MergedBags, prepare, Refused
from armid_ros.fleet.plan import Job
from armid_ros.fleet.results import (
    arm_is_done,
    find_summary,
    write_arm,
    write_refused,
    write_summary,
)
from armid_ros.fleet.store import Store
from armid_ros.identification import Conditioning
from armid_ros.motion import FloatArray
from distributed import as_completed, Client, Future, KilledWorker
import numpy as np

#: Number of times that Dask repeats a task if its store failed.
RETRIES = 3


@dataclass(frozen=True)
class ArmOutcome:
    """
    Outcome of the identification of an arm.

    Attributes
    ----------
    arm : str
        Name of the arm.
    done : int
        Number of bags in the estimate.
    found : int
        Number of these bags that an earlier run had read.
    refused : tuple of Refused
        Bags that are not used.
    problem : str
        Why there is no estimate; empty if there is an estimate.

    """

    arm: str
    done: int = 0
    found: int = 0
    refused: tuple[Refused, ...] = ()
    problem: str = ''


@dataclass(frozen=True)
class FleetOutcome:
    """
    Outcome of the identification of a fleet.

    Attributes
    ----------
    arms : tuple of ArmOutcome
        Outcomes of all arms.
    filters : dict of str to Conditioning
        Filters of every kind of arm, by the name of its robot.

    """

    arms: tuple[ArmOutcome, ...]
    filters: dict[str, Conditioning]

    @property
    def done(self) -> int:
        """Number of bags that contribute to the estimates of the arms."""
        return sum(arm.done for arm in self.arms)

    @property
    def found(self) -> int:
        """Number of contributing bags that an earlier run had already read."""
        return sum(arm.found for arm in self.arms)

    @property
    def refused(self) -> tuple[Refused, ...]:
        """Bags that are left out of the identification, sorted by arm and URL."""
        return tuple(sorted((one for a in self.arms for one in a.refused), key=lambda r: r.bag))


#: All bags of an arm, and their fit; None instead of the fit if there are too few rows.
Fitted = tuple[MergedBags, FleetFit | None]


def take(bag: BagFile, job: Job, bags_of_arm: int) -> BagSummary | Refused:
    """Dask task: return the summary of a bag; read the bag if there is no stored summary."""
    store = Store(job.out)
    found = find_summary(store, bag, job)
    if found is None:
        found = prepare(bag, job, bags_of_arm)
        if isinstance(found, Refused):
            write_refused(store, found, job)
        else:
            write_summary(store, found, job)
    return found


def same(job: Job) -> Job:
    """Dask task: return the job, so that workers store the job and Dask can recreate it."""
    return job


def fit(bags: Sequence[MergedBags], job: Job) -> Fitted:
    """Dask task: sum the normal equations of all bags of an arm, and fit parameters."""
    merged = MergedBags.together(bags)
    return merged, None if merged.normal is None else FleetFit.of(merged.normal, job)


def noise(taken: BagSummary | Refused, fitted: Fitted, job: Job) -> FloatArray | None:
    """Dask task: return the noise covariance (r, r) of the normal equations of a bag."""
    known = fitted[1]
    if known is None or isinstance(taken, Refused):
        return None
    return known.noise(taken.rows_again(job))


def finish(
    arm: str, fitted: Fitted, products: Sequence[FloatArray | None], job: Job
) -> ArmOutcome:
    """Dask task: write the estimate of an arm to the results, and return the outcome."""
    merged, known = fitted
    problem = ''
    if known is None or merged.normal is None:
        problem = 'none of its bags can be used'
    else:
        total = np.sum([one for one in products if one is not None], axis=0)
        write_arm(Store(job.out), arm, known.estimate(merged.normal, total), merged, job)
    return ArmOutcome(arm, len(merged.versions), merged.found, merged.refused, problem)


def identify_fleet(
    client: Client,
    bags: Sequence[BagFile],
    job_of: Mapping[str, Job],
    report: Callable[[int, int], None] = lambda finished, bags: None,
) -> FleetOutcome:
    """
    Identify every arm of a fleet on a cluster, and return the outcome.

    Parameters
    ----------
    client : distributed.Client
        Client of a cluster.
    bags : sequence of BagFile
        All bags.
    job_of : mapping of str to Job
        Model and filters of every arm.
    report : callable
        Callback with the number of finished bags and the number of all bags.

    Raises
    ------
    FleetError
        If the scheduler was lost; finished results are kept for a run with `resume`.

    """
    run = _Run(client, bags, job_of, report)
    run.work()
    outcomes = sorted(run.outcomes, key=lambda one: one.arm)
    filters = {job.arm.robot.name: job.filters for job in job_of.values()}
    return FleetOutcome(tuple(outcomes), filters)


@dataclass(frozen=True)
class _Waiting:
    """Arm that waits for the submission of its Dask tasks: bags to read and failed bags."""

    arm: str
    bags: tuple[BagFile, ...]
    refused: tuple[Refused, ...] = ()
    hit: int = 0  # number of worker failures due to other tasks


@dataclass
class _UnderWay:
    """Submitted Dask tasks of an arm; tasks of bags are in the order of the bags."""

    arm: _Waiting
    prepared: list[Future]
    fitted: Future
    noise: list[Future]
    last: Future


class _Run:
    """State of the identification of a fleet: waiting arms, and outcomes of finished arms."""

    def __init__(
        self,
        client: Client,
        bags: Sequence[BagFile],
        job_of: Mapping[str, Job],
        report: Callable[[int, int], None],
    ) -> None:
        self._client, self._job_of = client, job_of
        self._report, self._bags = report, len(bags)
        self._ended: set[str] = set()
        self._jobs: dict[str, Future] = {}
        self._waiting: deque[_Waiting] = deque()
        self.outcomes: list[ArmOutcome] = []
        for arm, group in itertools.groupby(sorted(bags), key=lambda bag: bag.arm):
            own, job = list(group), job_of[arm]
            refused = arm_is_done(Store(job.out), arm, own, job) if job.settings.resume else None
            if refused is None:
                self._waiting.append(_Waiting(arm, tuple(own)))
            else:
                done = len(own) - len(refused)
                self.outcomes.append(ArmOutcome(arm, done, done, tuple(refused)))
                self._count(own)

    def work(self) -> None:
        """Process all arms, with enough arms at the same time to keep all workers busy."""
        # bags in progress: a constant, and a number per thread
        limit = 2 + 4 * sum(self._client.nthreads().values())
        under_way: dict[Any, _UnderWay] = {}
        ended = as_completed(raise_errors=False)
        while self._waiting or under_way:
            while self._waiting and sum(len(one.prepared) for one in under_way.values()) < limit:
                tasks = self._submitted(self._waiting.popleft())
                under_way[tasks.last.key] = tasks
                ended.add(tasks.last)
            future = next(ended)
            try:
                outcome = future.result()
            except Exception:
                # An arm that had finished also fails if its worker ends and its tasks cannot be
                # repeated.
                outcome = None
            if future.status in ('cancelled', 'lost'):
                raise FleetError(
                    'the scheduler and its tasks were lost; finished results are kept: '
                    'run the same command again with --resume'
                )
            tasks = under_way.pop(future.key)
            if outcome is None:
                self._begin_again(tasks)
            else:
                refused = (*tasks.arm.refused, *outcome.refused)
                self.outcomes.append(replace(outcome, refused=refused))

    def _count(self, bags: Sequence[BagFile]) -> None:
        self._ended.update(bag.url for bag in bags)
        self._report(len(self._ended), self._bags)

    def _submit(self, task: Callable[..., Any], *arguments: Any, **options: Any) -> Future:
        return self._client.submit(task, *arguments, pure=False, **options)

    def _job(self, arm: str) -> Future:
        job = self._job_of[arm]
        if job.digest not in self._jobs:
            self._jobs[job.digest] = self._submit(same, job)
        return self._jobs[job.digest]

    def _submitted(self, arm: _Waiting) -> _UnderWay:
        """Submit the Dask tasks of an arm: read bags, fit, compute noise covariances, write."""
        job, count = self._job(arm.arm), len(arm.bags)
        prepared = []
        for bag in arm.bags:
            future = self._submit(take, bag, job, count, retries=RETRIES)
            prepared.append(future)

            def ended(future: Future, bag: BagFile = bag) -> None:
                if future.status in ('finished', 'error'):  # others will be submitted again
                    self._count([bag])

            future.add_done_callback(ended)
        fitted = self._submit(fit, [self._submit(MergedBags.of, one) for one in prepared], job)
        products = [self._submit(noise, one, fitted, job, retries=RETRIES) for one in prepared]
        last = self._submit(finish, arm.arm, fitted, products, job, retries=RETRIES)
        return _UnderWay(arm, prepared, fitted, products, last)

    def _begin_again(self, tasks: _UnderWay) -> None:
        """Submit a failed arm again, without the bags that caused the failure."""
        # Tasks that depend on a failed task fail too, so the noise tasks are checked only if all
        # bags were read. If another bag may have killed the worker, the bag is read once more
        # alone.
        arm = tasks.arm
        job, futures = self._job_of[arm.arm], tasks.prepared
        if tasks.fitted.status == 'finished' and all(one.status != 'error' for one in futures):
            futures = tasks.noise
        bags: list[BagFile] = []
        failed: list[Refused] = []
        error = tasks.last.exception()
        hit = isinstance(error, KilledWorker) and all(one.status != 'error' for one in futures)
        for bag, future in zip(arm.bags, futures, strict=True):
            failure = future.exception() if future.status == 'error' else None
            if isinstance(failure, KilledWorker):  # repeat the task alone
                future = self._submit(take, bag, self._job(arm.arm), 1, retries=RETRIES)
                next(as_completed([future], raise_errors=False))
                hit |= future.status != 'error'
            if future.status != 'error':
                bags.append(bag)
            else:
                failed.append(Refused(bag, _reason(future.exception()), failed=True))
        for one in failed:
            write_refused(Store(job.out), one, job)
        left = _Waiting(
            arm.arm,
            tuple(bags),
            (*arm.refused, *failed),
            arm.hit + (hit and arm.hit < 3),  # at most three times
        )
        if left.bags and left != arm:
            self._waiting.appendleft(left)
        else:
            problem = 'none of its bags can be used' if failed else _reason(error)
            self.outcomes.append(ArmOutcome(left.arm, refused=left.refused, problem=problem))


def _reason(error: BaseException | None) -> str:
    if isinstance(error, KilledWorker):
        return (
            f'{error.allowed_failures + 1} workers ended while they read the bag: too little '
            'memory, or damaged content'
        )
    if isinstance(error, ArmidError):
        return str(error)
    return ' '.join(f'{type(error).__name__}: {error}'.split())
