# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Workers killed, bags damaged, stores that fail, schedulers lost: every bag ends somewhere."""

from dataclasses import replace
from functools import partial
import os
from pathlib import Path
import shutil
import signal
import socket
import subprocess
import sys

from armid_ros.errors import FleetError
from armid_ros.fleet.bags import find_bags
from armid_ros.fleet.cluster import connected
from armid_ros.fleet.store import Store
from armid_ros.identification import SignalSettings
import dask
from distributed import get_worker
import fsspec
from fsspec import AbstractFileSystem
from fsspec.implementations.local import LocalFileSystem
import pytest

from .conftest import identified, SETTINGS, URDF
from .test_identify import digits, stamps

pytestmark = pytest.mark.long

FIXED = replace(SETTINGS, signals=SignalSettings(20.0, 8))


class Flaky(AbstractFileSystem):
    """A store over a folder of this machine that does not answer the first times."""

    protocol = 'flaky'
    cachable = False
    root_marker = '/'

    def ls(self, path, detail=True, **options):
        """List a folder."""
        return LocalFileSystem().ls(path, detail=detail)

    def info(self, path, **options):
        """Describe a file."""
        return LocalFileSystem().info(path)

    def get(self, rpath, lpath, **options):
        """Fail as often as the file `failures` beside the bags says."""
        left = Path(rpath).parents[1] / f'failures_{Path(rpath).parent.name}'
        count = int(left.read_text()) if left.exists() else 0
        if count:
            fewer = left.with_name(f'{left.name}_{os.getpid()}')
            fewer.write_text(str(count - 1))
            fewer.replace(left)  # whole, for whoever reads it now
            raise TimeoutError('silent')
        shutil.copytree(rpath, lpath)


def register():
    """Let fsspec know of the store, here or on a worker."""
    fsspec.register_implementation('flaky', Flaky, clobber=True)


def flaky(folder):
    """Return the URL of bags in the store that fails."""
    return f'flaky://{folder}/*/*'


@pytest.fixture
def copied(bags, tmp_path):
    """Return a copy of the bags that may be damaged."""
    shutil.copytree(bags, tmp_path / 'bags')
    return tmp_path / 'bags'


@pytest.fixture(scope='module')
def expected(bags, cluster, tmp_path_factory):
    """Return every number of a run in which nothing happens."""
    out = str(tmp_path_factory.mktemp('expected'))
    identified(cluster, find_bags([f'{bags}/*/*']), URDF, out, FIXED)
    return digits(Store(out))


def test_an_arm_without_a_usable_bag_is_said(copied, cluster, tmp_path):
    for file in (copied / 'arm_0002').rglob('*.mcap'):
        file.write_bytes(b'')
    outcome = identified(cluster, find_bags([f'{copied}/*/*']), URDF, str(tmp_path), FIXED)
    assert [arm.arm for arm in outcome.arms if arm.problem] == ['arm_0002']


def test_a_damaged_bag_is_refused_until_it_is_mended(copied, cluster, tmp_path):
    (file,) = (copied / 'arm_0001' / '2026-01-02').glob('*.mcap')
    whole = file.read_bytes()
    file.write_bytes(b'\0' * 5000)
    outcome = identified(cluster, find_bags([f'{copied}/*/*']), URDF, str(tmp_path), FIXED)
    (refused,) = outcome.refused
    assert (outcome.done, refused.bag.arm, refused.failed) == (8, 'arm_0001', False)
    rows = Store(str(tmp_path)).data_set('refused').to_pylist()
    assert [row['reason'] for row in rows] == [refused.reason]
    file.write_bytes(whole)
    resumed = replace(FIXED, resume=True)
    outcome = identified(cluster, find_bags([f'{copied}/*/*']), URDF, str(tmp_path), resumed)
    assert (outcome.done, outcome.found, outcome.refused) == (9, 8, ())
    assert Store(str(tmp_path)).data_set('refused') is None or not len(
        Store(str(tmp_path)).data_set('refused')
    )


def test_a_store_that_times_out_is_asked_again(copied, cluster, tmp_path):
    register()
    cluster.run(register)
    (copied / 'failures_arm_0001').write_text('2')
    outcome = identified(cluster, find_bags([flaky(copied)]), URDF, str(tmp_path), FIXED)
    assert (outcome.done, outcome.refused) == (9, ())
    assert (copied / 'failures_arm_0001').read_text() == '0'


def test_a_store_that_never_answers_costs_its_bags_and_no_others(copied, cluster, tmp_path):
    register()
    cluster.run(register)
    (copied / 'failures_arm_0001').write_text('1000')
    outcome = identified(cluster, find_bags([flaky(copied)]), URDF, str(tmp_path), FIXED)
    assert outcome.done == 6
    assert {one.bag.arm for one in outcome.refused} == {'arm_0001'}
    assert all(one.failed for one in outcome.refused)
    assert [one.reason for one in outcome.refused if 'silent' not in one.reason] == []
    (copied / 'failures_arm_0001').unlink()
    resumed = replace(FIXED, resume=True)
    again = identified(cluster, find_bags([flaky(copied)]), URDF, str(tmp_path), resumed)
    assert again.done == 9
    assert again.found >= 6  # a task of the first run may have got its answer since


def test_killing_a_worker_changes_no_digit(bags, expected, tmp_path):
    everything = find_bags([f'{bags}/*/*'])
    with connected(None, 2) as client:
        processes = list(client.run(os.getpid).values())
        killed = []

        def kill_once(ended, of):
            if ended >= 3 and not killed:
                killed.append(processes[0])
                os.kill(processes[0], signal.SIGKILL)

        outcome = identified(client, everything, URDF, str(tmp_path), FIXED, kill_once)
    assert killed and (outcome.done, outcome.refused) == (9, ())
    assert digits(Store(str(tmp_path))) == expected


def deadly(path):
    """End the process of a worker that reads a certain bag."""
    get_worker()
    if 'arm_0001/2026-01-02' in str(path):
        os.kill(os.getpid(), signal.SIGKILL)


def arm_the_trap():
    """Let reading one bag end the worker."""
    from armid_ros.fleet import merge

    whole = merge.fetched

    def trapped(url):
        deadly(url)
        return whole(url)

    merge.fetched = trapped


def test_a_bag_that_ends_its_workers_is_given_up_and_the_others_are_used(bags, tmp_path):
    with dask.config.set({'distributed.scheduler.allowed-failures': 1}):
        with connected(None, 2) as client:
            client.register_worker_callbacks(arm_the_trap)
            outcome = identified(client, find_bags([f'{bags}/*/*']), URDF, str(tmp_path), FIXED)
    (refused,) = outcome.refused
    assert (outcome.done, refused.failed) == (8, True)
    assert refused.bag.url.endswith('arm_0001/2026-01-02')
    assert 'workers ended' in refused.reason


class Deadly:
    """An outcome that ends the worker from which it is fetched."""

    def __reduce__(self):
        os.kill(os.getpid(), signal.SIGKILL)


def arm_the_end(folder):
    """Let the end of one arm be lost twice: as it is fetched, and as it is done again."""
    from armid_ros.fleet import run

    whole = run.finish

    def trapped(arm, *of):
        outcome = whole(arm, *of)
        for step in ('fetched', 'again') if arm == 'arm_0001' else ():
            try:
                (folder / step).touch(exist_ok=False)
            except FileExistsError:
                continue
            if step == 'fetched':
                return Deadly()
            os.kill(os.getpid(), signal.SIGKILL)
        return outcome

    run.finish = trapped


def test_an_arm_whose_result_is_lost_with_its_worker_is_done_again(bags, tmp_path):
    out = tmp_path / 'out'
    everything = find_bags([f'{bags}/*/*'])
    with dask.config.set({'distributed.scheduler.allowed-failures': 0}):
        with connected(None, 2) as client:
            client.register_worker_callbacks(partial(arm_the_end, tmp_path))
            outcome = identified(client, everything, URDF, str(out), FIXED)
    assert (tmp_path / 'again').exists()
    assert (outcome.done, outcome.refused) == (9, ())


def test_a_worker_that_is_given_up_is_started_anew():
    with dask.config.set({'distributed.deploy.lost-worker-timeout': '100 ms'}):
        with connected(None, 1) as client:
            (given_up,) = client.cluster.workers.values()
            client.cluster.sync(given_up.close)
            assert client.submit(os.getpid).result(timeout=100)
            assert given_up not in client.cluster.workers.values()


class Cluster:
    """A scheduler and a worker as processes of their own."""

    def __init__(self, folder):
        with socket.socket() as free:
            free.bind(('127.0.0.1', 0))
            self.port = free.getsockname()[1]
        self.folder = folder
        self.address = f'tcp://127.0.0.1:{self.port}'
        self.processes = []

    def start(self):
        """Start both."""
        own = ['--dashboard-address', '127.0.0.1:0', '--host', '127.0.0.1']
        self._run('distributed.cli.dask_scheduler', *own, '--port', str(self.port))
        worker = ['--nthreads', '1', '--no-dashboard', '--local-directory', str(self.folder)]
        self._run('distributed.cli.dask_worker', self.address, *worker)

    def _run(self, module, *arguments):
        self.processes.append(
            subprocess.Popen(
                [sys.executable, '-m', module, *arguments],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        )

    def stop(self):
        """Kill both."""
        for process in self.processes:
            process.kill()
            process.wait()
        self.processes.clear()


@pytest.fixture
def elsewhere(tmp_path):
    """Return a cluster by its address, as on other machines."""
    cluster = Cluster(tmp_path)
    cluster.start()
    yield cluster
    cluster.stop()


def test_a_scheduler_that_is_lost_leaves_what_is_done_for_the_next_run(
    bags, expected, elsewhere, tmp_path
):
    everything = find_bags([f'{bags}/*/*'])
    out = str(tmp_path / 'results')

    def lose(ended, of):
        if ended >= 4:
            elsewhere.stop()

    with pytest.raises(FleetError, match='--resume'):
        with connected(elsewhere.address) as client:
            identified(client, everything, URDF, out, FIXED, lose)
    before = stamps(out)
    assert any(name.startswith('bags') for name in before)
    elsewhere.start()
    with connected(elsewhere.address) as client:
        outcome = identified(client, everything, URDF, out, replace(FIXED, resume=True))
    assert (outcome.done, outcome.refused) == (9, ())
    assert outcome.found == sum(name.startswith('bags') for name in before)
    after = stamps(out)
    assert all(after[name] == before[name] for name in before if name.startswith('bags'))
    assert digits(Store(out)) == expected


def test_a_scheduler_that_does_not_answer_is_said_at_once(monkeypatch):
    monkeypatch.setattr('armid_ros.fleet.cluster.CONNECT_TIMEOUT', 0.5)
    with socket.socket() as free:
        free.bind(('127.0.0.1', 0))
        address = f'tcp://127.0.0.1:{free.getsockname()[1]}'
    with pytest.raises(FleetError, match=address), connected(address):
        pass
