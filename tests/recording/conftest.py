# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A recording of a swinging arm, and bags made message by message."""

import sqlite3

from armid_ros.recording import BagWriter, Recording
from armid_ros.recording.bag import Bag
from armid_ros.recording.joint_state.encoder import joint_state_cdr
from armid_ros.recording.message_types import JOINT_STATE
import numpy as np
import pytest

JOINTS = ('shoulder', 'elbow', 'wrist')
START_NS = 1_795_254_519_961_369_502
PERIOD_NS = 1_000_000


def swing(samples=500, joints=JOINTS, period_ns=PERIOD_NS, start_ns=START_NS):
    """Return a recording of joints that swing at different rates."""
    t = np.arange(samples) * period_ns * 1e-9
    rates = 2.0 + np.arange(len(joints))
    return Recording(
        joints=joints,
        t=t,
        q=np.sin(np.outer(t, rates)),
        dq=rates * np.cos(np.outer(t, rates)),
        tau=10 * np.cos(np.outer(t, rates) + 0.2),
        start_ns=start_ns,
    )


def serialised(*samples, **options):
    """Return the messages of samples as a list of CDR."""
    return [cdr for batch in joint_state_cdr(*samples, **options) for cdr in batch.tolist()]


def sqlite_bag(path, messages, columns=', offered_qos_profiles TEXT'):
    """Write messages of one topic into a database as rosbag2 does; return the open database."""
    database = sqlite3.connect(path)
    database.executescript(
        'CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, '
        f'serialization_format TEXT{columns});'
        'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, '
        'data BLOB);'
    )
    row = (1, messages[0][0], JOINT_STATE, 'cdr') + (('',) if columns else ())
    database.execute(f'INSERT INTO topics VALUES ({",".join("?" * len(row))})', row)
    database.executemany(
        'INSERT INTO messages(topic_id, timestamp, data) VALUES (1, ?, ?)',
        [(time, cdr) for _, cdr, time in messages],
    )
    database.commit()
    return database


def iter_raw(path):
    """Yield all messages of a bag as raw CDR."""
    with Bag(path) as bag:
        yield from bag.messages()


def messages_of(recording, stamps, joints=None, *, log=None, topic='/joint_states', **kept):
    """Return messages of samples, one each, logged at their stamps; `kept` replaces arrays."""
    names = list(joints or recording.joints)
    columns = [recording.joints.index(name) for name in names]
    values = []
    for quantity in ('q', 'dq', 'tau'):
        array = kept.get(quantity, getattr(recording, quantity))
        values.append(None if array is None else array[:, columns])
    cdr = serialised(names, stamps, *values)
    times = np.asarray(stamps if log is None else log).tolist()
    return [(topic, data, time) for data, time in zip(cdr, times, strict=True)]


def assert_same(got, expected, samples=slice(None), joints=None):
    """Compare a recording with some samples of another one."""
    columns = [expected.joints.index(name) for name in joints or expected.joints]
    assert got.joints == tuple(joints or expected.joints)
    t = expected.t[samples]
    np.testing.assert_allclose(got.t, t - t[0], rtol=0, atol=1e-9)
    for quantity in ('q', 'dq', 'tau'):
        np.testing.assert_array_equal(
            getattr(got, quantity), getattr(expected, quantity)[samples][:, columns]
        )


@pytest.fixture
def swinging():
    """Return a recording of three joints, 500 samples at 1 kHz."""
    return swing()


@pytest.fixture
def stamps(swinging):
    """Return the stamps of the recording [ns]."""
    return START_NS + PERIOD_NS * np.arange(len(swinging), dtype=np.int64)


@pytest.fixture
def write_bag(tmp_path):
    """Return a function that writes messages, given as (topic, CDR, log time), to a bag."""

    def write(messages, name='bag', type_name=JOINT_STATE, **options):
        with BagWriter(tmp_path / name, **options) as writer:
            for topic, cdr, log_time_ns in messages:
                writer.add_topic(topic, type_name)
                writer.write(topic, cdr, log_time_ns)
        return tmp_path / name

    return write
