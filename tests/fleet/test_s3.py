# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags and results in an object store, served by moto on this machine."""

from armid_ros.fleet.bags import find_bags
from armid_ros.fleet.cluster import connected
from armid_ros.fleet.store import Store
from armid_ros.fleet.watch import watch_fleet, write_watch
import fsspec
from moto.server import ThreadedMotoServer
import pytest

from .conftest import identified, URDF
from .test_faults import FIXED
from .test_identify import digits

# what the libraries below do, not this package
pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings('ignore::DeprecationWarning'),
    pytest.mark.filterwarnings('ignore::ResourceWarning'),
]


@pytest.fixture(scope='module')
def bucket(bags):
    """Return a bucket that holds the small fleet; its address is in the environment."""
    patch = pytest.MonkeyPatch()
    server = ThreadedMotoServer('127.0.0.1', port=0, verbose=False)
    server.start()
    _, port = server.get_host_and_port()
    for name, value in (
        ('AWS_ENDPOINT_URL', f'http://127.0.0.1:{port}'),
        ('AWS_ACCESS_KEY_ID', 'nobody'),
        ('AWS_SECRET_ACCESS_KEY', 'nothing'),
        ('AWS_DEFAULT_REGION', 'us-east-1'),
    ):
        patch.setenv(name, value)
    filesystem = fsspec.filesystem('s3', skip_instance_cache=True)
    filesystem.mkdir('fleet')
    for arm in ('arm_0000', 'arm_0001'):
        filesystem.put(str(bags / arm), f'fleet/bags/{arm}', recursive=True)
    yield 's3://fleet'
    fsspec.get_filesystem_class('s3').clear_instance_cache()
    server.stop()
    patch.undo()


@pytest.mark.long
def test_an_object_store_gives_the_digits_of_a_folder_and_is_watched(bags, bucket, tmp_path):
    with connected(None, 1) as client:
        found = find_bags([f'{bucket}/bags/*/*'])
        assert [(bag.arm, bag.day) for bag in found[:1]] == [('arm_0000', '2026-01-01')]
        outcome = identified(client, found, URDF, f'{bucket}/results', FIXED)
        local = find_bags([f'{bags}/arm_000[01]/*'])
        identified(client, local, URDF, str(tmp_path), FIXED)
    assert (outcome.done, outcome.refused) == (6, ())
    store = Store(f'{bucket}/results')
    assert digits(store) == digits(Store(str(tmp_path)))
    write_watch(store, watch_fleet(store))
    assert store.read('alarms.jsonl') == b''
    assert len(store.read_table('watch/arms.parquet')) == 2
