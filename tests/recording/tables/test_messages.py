# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Names, stamps and dates that exports of messages write into cells are those of the recording."""

from datetime import datetime, UTC
from itertools import chain

from armid_ros.errors import RecordingError
from armid_ros.recording.columns import ColumnSettings
from armid_ros.recording.reader import read_recording
from armid_ros.recording.tables import open_table, plan
import numpy as np
import pytest

from .conftest import assert_holds, JOINTS

START = 1_455_208_158


def stamps(motion):
    """Return seconds and nanoseconds of a motion since 1970."""
    return np.divmod(START * 10**9 + np.round(motion[0] * 1e9).astype(np.int64), 10**9)


def rows(motion, order=lambda k: (0, 1)):
    """Yield stamp, names, positions, velocities and torques of messages, each in an order."""
    _, *values = motion
    for k, (sec, nanosec) in enumerate(zip(*stamps(motion), strict=True)):
        o = list(order(k))
        yield sec, nanosec, [JOINTS[i] for i in o], *(v[k, o].tolist() for v in values)


def as_rostopic_echoes(folder, motion):
    kinds = [
        f'field.{what}{k}' for what in ('name', 'position', 'velocity', 'effort') for k in (0, 1)
    ]
    text = ','.join(['%time', 'field.header.seq', 'field.header.stamp', *kinds]) + '\n'
    for sec, nanosec, *fields in rows(motion, lambda k: (1, 0)):
        cells = [f'{sec + 1}{nanosec:09d}', 7, f'{sec}{nanosec:09d}', *chain(*fields)]
        text += ','.join(map(str, cells)) + '\n'
    (folder / 'run.csv').write_text(text)
    return 'run.csv'


def as_parquet(folder, motion):
    pyarrow = pytest.importorskip('pyarrow')
    from pyarrow import parquet

    heads = ('stamp_sec', 'stamp_nanosec', 'name', 'position', 'velocity', 'effort')
    columns = zip(*rows(motion, lambda k: (k % 2, 1 - k % 2)), strict=True)
    table = pyarrow.table(
        {head: list(column) for head, column in zip(heads, columns, strict=True)}
    )
    parquet.write_table(table, folder / 'run.parquet')
    return 'run.parquet'


def as_hdf5(folder, motion):
    h5py = pytest.importorskip('h5py')
    with h5py.File(folder / 'run.h5', 'w') as file:
        file['sec'], file['nanosec'] = stamps(motion)
        for name, values in zip(('pos_J', 'vel_J', 'eff_J'), motion[1:], strict=True):
            file[name] = values
    return 'run.h5'


def with_dates(folder, motion):
    text = 'mode,stamp,q1,q2,dq1,dq2,tau1,tau2\n'
    for sec, nanosec, _, *fields in rows(motion):
        date = datetime.fromtimestamp(sec, UTC).strftime(
            f'%Y-%m-%dT%H:%M:%S.{nanosec // 1000:06d}Z'
        )
        text += f'run,{date},{",".join(map(str, chain(*fields)))}\n'
    (folder / 'run.csv').write_text(text)
    return 'run.csv'


@pytest.mark.parametrize(
    'write',
    [
        as_rostopic_echoes,
        as_parquet,
        as_hdf5,
        with_dates,
    ],
)
def test_each_joint_has_its_own_values_at_the_stamps_of_the_driver(write, tmp_path, motion):
    recording = read_recording(tmp_path / write(tmp_path, motion), joints=JOINTS)
    assert_holds(recording, motion)
    assert recording.start_ns == pytest.approx(START * 10**9, abs=1000)
    assert len(recording) == len(motion[0])


def test_joints_that_cells_name_are_not_taken_for_others(tmp_path, motion):
    path = tmp_path / as_rostopic_echoes(tmp_path, motion)
    with pytest.raises(RecordingError, match=r'field.position'):
        read_recording(path, joints=('hip', 'knee'))
    assert plan(open_table(path), ColumnSettings()).joints == ('elbow', 'shoulder')
    asked = ColumnSettings(position='field.position{}', velocity='none', effort='none')
    np.testing.assert_allclose(read_recording(path, joints=JOINTS, columns=asked).q, motion[1])


@pytest.mark.parametrize(
    ('columns', 'asked'),
    [
        ('tau1,tau2,tau1', {}),
        ('tau1 [Nm],tau2,tau1 [A]', {}),
        ('tau1,tau2,tau1', {'effort': 'tau{}'}),
        ('tau1,tau2,tau1', {'effort': 'tau1,tau2'}),
    ],
)
def test_two_columns_of_one_name_are_refused_where_they_differ(tmp_path, columns, asked):
    ramp = np.arange(50.0)
    for last, differs in ((ramp + 4.0, True), (ramp, False)):
        values = np.column_stack([0.01 * ramp, ramp, ramp, ramp, ramp, last])
        path = tmp_path / f'{differs}.csv'
        np.savetxt(path, values, delimiter=',', header=f't,q1,q2,{columns}', comments='')
        if differs:
            with pytest.raises(RecordingError, match='tau1'):
                plan(open_table(path), ColumnSettings(**asked))
        elif not asked:
            assert 'effort' not in plan(open_table(path), ColumnSettings()).missing


@pytest.mark.parametrize('word', ['eff', 'torque', 'tau', 'cur', 'i', 'load'])
def test_abbreviations_of_efforts_are_known(tmp_path, word):
    text = f't,q1,q2,{word}_J1,{word}_J2\n'
    text += ''.join(f'{0.01 * k},{k},{k},{2 * k},{3 * k}\n' for k in range(50))
    (tmp_path / 'run.csv').write_text(text)
    found = plan(open_table(tmp_path / 'run.csv'), ColumnSettings())
    (effort,) = [one for one in found.sources if one.quantity == 'effort']
    assert effort.pattern == f'{word}_J{{}}'
    assert any('currents' in note for note in found.notes) == (word in ('cur', 'i', 'load'))
