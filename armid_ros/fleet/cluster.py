# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Connection to workers: processes of this machine, or a Dask cluster with a given address."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import logging
import os
import tempfile

from armid_ros.errors import FleetError
from armid_ros.version import __version__
import dask
from distributed import Client, LocalCluster

#: Timeout of the connection to a cluster [s].
CONNECT_TIMEOUT = 30.0
#: Settings that reduce the work of Dask for its dashboard, which is not used here.
_DASK_SETTINGS = {
    'distributed.worker.profile.enabled': False,
    'distributed.admin.tick.interval': '1s',
    'distributed.admin.system-monitor.interval': '2s',
    'distributed.worker.memory.monitor-interval': '500ms',
    'distributed.scheduler.active-memory-manager.start': False,
    # MALLOC_TRIM_THRESHOLD_ is left out: with it, the kernel allocates every array again
    'distributed.nanny.pre-spawn-environ': dict.fromkeys(
        ('OMP_NUM_THREADS', 'MKL_NUM_THREADS', 'OPENBLAS_NUM_THREADS'), '1'
    ),
}


@contextmanager
def connected(scheduler: str | None, workers: int | None = None) -> Iterator[Client]:
    """
    Connect to a Dask cluster, or start worker processes on this machine; yield a Dask client.

    Parameters
    ----------
    scheduler : str or None
        Address of a scheduler, such as tcp://host:8786; None for processes of this machine.
    workers : int, optional
        Number of processes of this machine; one per core by default.

    Raises
    ------
    FleetError
        If no scheduler answers, or workers lack this version of the package.

    """
    logging.getLogger('distributed').setLevel(logging.CRITICAL)
    if scheduler is None:
        with _local(workers or len(os.sched_getaffinity(0))) as client:
            yield client
        return
    try:
        client = Client(scheduler, timeout=CONNECT_TIMEOUT)
    except (OSError, ValueError, TimeoutError) as error:
        raise FleetError(f'--scheduler {scheduler}: no Dask scheduler answers: {error}') from error
    with client:
        found = client.get_versions(packages=['armid_ros'])['workers'].values()
        other = {str(worker['packages']['armid_ros']) for worker in found} - {__version__}
        if other:
            raise FleetError(
                f'--scheduler {scheduler}: workers have armid_ros {", ".join(sorted(other))}, but '
                f'this computer has {__version__}; install one version everywhere'
            )
        yield client


@contextmanager
def _local(count: int) -> Iterator[Client]:
    """Start worker processes on this machine; yield their Dask client."""
    before = os.environ.get('PYTHONSAFEPATH', '')
    os.environ['PYTHONSAFEPATH'] = '1'  # workers do not import modules from the current folder
    try:
        with tempfile.TemporaryDirectory(prefix='armid-fleet-') as folder:
            with (
                dask.config.set(_DASK_SETTINGS),
                LocalCluster(
                    n_workers=count,
                    threads_per_worker=1,
                    memory_limit=1_200_000_000,  # bytes; beyond, Dask uses the disk
                    dashboard_address='127.0.0.1:0',
                    local_directory=folder,
                    silence_logs=logging.CRITICAL,
                ) as cluster,
                Client(cluster) as client,
            ):
                # Dask restarts a worker that ends, but not one that ends or is slow while it
                # starts. Tasks would then wait for ever, so the number of workers is adapted.
                cluster.adapt(minimum=count, maximum=count, interval='2s')
                yield client
    finally:
        os.environ['PYTHONSAFEPATH'] = before
