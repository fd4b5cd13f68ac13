# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The same motion comes out of every kind of file; tests/fuzz reads the plain ones."""

from dataclasses import replace
import gzip
import json
import sys

from armid_ros.errors import RecordingError
from armid_ros.recording.columns import ColumnSettings
from armid_ros.recording.reader import read_recording
from armid_ros.recording.source import DEFAULT
from armid_ros.recording.tables import open_table, side_by_side, table
import numpy as np
import pytest
from scipy.io import savemat

from .conftest import assert_holds, JOINTS

HEAD = ['time', 'q1', 'q2', 'dq1', 'dq2', 'tau1', 'tau2']


def text(motion, head=HEAD, separator=',', scale=1.0):
    """Return a motion as text, its positions and velocities in units of 1/scale."""
    t, q, dq, tau = motion
    table = np.column_stack([t, q * scale, dq * scale, tau])
    rows = [separator.join(f'{value:.9g}' for value in row) for row in table]
    return '\n'.join([separator.join(head), *rows]) + '\n'


def semicolons_and_decimal_commas(path, motion):
    path.write_text(text(motion, separator=';').replace('.', ','))


def utf_16(path, motion):
    path.write_text(text(motion), encoding='utf-16')


def blanks_below_a_comment(path, motion):
    path.write_text('# recorded today\n# ' + text(motion, separator=' '))


def compressed(path, motion):
    path.write_bytes(gzip.compress(text(motion).encode()))


def with_a_line_of_units(path, motion):
    lines = text(motion, separator='\t', scale=180 / np.pi).splitlines()
    units = '\t'.join(['s', 'deg', 'deg', 'deg/s', 'deg/s', 'Nm', 'Nm'])
    path.write_text('\n'.join([lines[0], units, *lines[1:]]))


def degrees_by_name(path, motion):
    head = ['t_ms', *(f'{name}_deg' for name in HEAD[1:5]), 'tau1', 'tau2']
    t, *rest = motion
    path.write_text(text((1e3 * t, *rest), head, scale=180 / np.pi))


def stamps_since_1970_in_ns(path, motion):
    head = ['timestamp', *HEAD[1:]]
    t = motion[0]
    lines = text(motion, head).splitlines()
    stamps = (1_760_000_000_000_000_000 + np.rint(t * 1e9).astype(np.int64)).tolist()
    rows = [
        f'{stamp},{line.split(",", 1)[1]}' for stamp, line in zip(stamps, lines[1:], strict=True)
    ]
    path.write_text('\n'.join([lines[0], *rows]))


def as_plotjuggler_exports(path, motion):
    names = [
        f'/joint_states/{joint}/{quantity}'
        for quantity in ('position', 'velocity', 'effort')
        for joint in JOINTS
    ]
    path.write_text(text(motion, ['__time', *names]))


def with_references_and_filtered(path, motion):
    t, q, dq, tau = motion
    blocks = {'q_ref': 0 * q, 'q_meas': q, 'q_filt': 0.9 * q, 'dq_meas': dq, 'tau_cmd': 0 * q}
    blocks |= {'tau_meas': tau, 'tau_ext': 0.1 * tau, 'ee_pos': q}
    names = [f'{name}{k}' for name in blocks for k in (1, 2)]
    np.savetxt(
        path,
        np.column_stack([t, *blocks.values()]),
        delimiter=',',
        header=','.join(['time', *names]),
        comments='',
    )


def npz_of_rows(path, motion):
    t, *rest = motion
    np.savez(path, t=t, **{n: v.T for n, v in zip(('q', 'qd', 'torque'), rest, strict=True)})


def mat_of_structures(path, motion):
    t, q, dq, tau = motion
    rec = {'time': t, 'act_pos_rad': q.T, 'act_vel': dq.T, 'act_torque_nm': tau.T}
    savemat(path, {'rec': rec, 'ref': {'pos_rad': 0 * q.T}, 'note': 'text'})


def parquet(path, motion):
    pa = pytest.importorskip('pyarrow')
    import pyarrow.parquet as pq

    t, q, dq, tau = motion
    columns = {'timestamp': t, 'q': list(q), 'dq': list(dq), 'tau': list(tau)}
    pq.write_table(pa.table({**columns, 'task': ['pick'] * len(t)}), path)


WRITERS = {
    semicolons_and_decimal_commas: 'run.csv',
    blanks_below_a_comment: 'run.txt',
    utf_16: 'run.csv',
    compressed: 'run.csv.gz',
    with_a_line_of_units: 'run.tsv',
    degrees_by_name: 'run.csv',
    stamps_since_1970_in_ns: 'run.csv',
    as_plotjuggler_exports: 'run.csv',
    with_references_and_filtered: 'run.csv',
    npz_of_rows: 'run.npz',
    mat_of_structures: 'run.mat',
    parquet: 'run.parquet',
}


@pytest.mark.parametrize('write', WRITERS, ids=lambda write: write.__name__)
def test_the_motion_comes_out(write, motion, tmp_path):
    path = tmp_path / WRITERS[write]
    write(path, motion)
    assert_holds(read_recording(path, joints=JOINTS), motion)


def lerobot(folder, motion, version):
    """Write a dataset of two episodes of which the second is the motion."""
    pa = pytest.importorskip('pyarrow')
    import pyarrow.parquet as pq

    t, q, dq, tau = motion
    both = np.concatenate
    table = pa.table(
        {
            'observation.state': list(both([0 * q, q])),
            'observation.velocity': list(both([0 * q, dq])),
            'observation.effort': list(both([0 * q, tau])),
            'action': list(both([q, q])),
            'timestamp': both([t, t]),
            'frame_index': np.tile(np.arange(len(t)), 2),
            'episode_index': np.repeat([0, 1], len(t)),
        }
    )
    names = {'motors': list(JOINTS)} if version == 2 else list(JOINTS)
    features = {
        name: {'dtype': 'float32', 'shape': [2], 'names': names}
        for name in ('observation.state', 'observation.velocity', 'observation.effort', 'action')
    }
    (folder / 'meta').mkdir(parents=True)
    (folder / 'meta' / 'info.json').write_text(
        json.dumps({'fps': 200, 'total_episodes': 2, 'features': features})
    )
    chunk = folder / 'data' / 'chunk-000'
    chunk.mkdir(parents=True)
    if version == 2:
        for k in range(2):
            part = table.slice(k * len(t), len(t))
            pq.write_table(part, chunk / f'episode_{k:06d}.parquet')
    else:
        pq.write_table(table, chunk / 'file-000.parquet')


@pytest.mark.parametrize('version', [2, 3])
def test_an_episode_of_a_dataset_comes_out(version, motion, tmp_path):
    lerobot(tmp_path / 'dataset', motion, version)
    said = ColumnSettings(episode=1)
    assert_holds(read_recording(tmp_path / 'dataset', joints=JOINTS, columns=said), motion)
    with pytest.raises(RecordingError, match=r'7.*1'):
        open_table(tmp_path / 'dataset', episode=7)


def test_files_side_by_side_hold_columns_of_the_same_rows(motion, tmp_path):
    _, q, _, tau = motion
    for name, values in (('positions', q), ('currents', tau)):
        np.savetxt(
            tmp_path / f'{name}.csv', values, delimiter=',', header='Joint_1,Joint_2', comments=''
        )
    joined = side_by_side([open_table(tmp_path / f'{n}.csv') for n in ('positions', 'currents')])
    assert joined.columns[0].name == 'positions:Joint_1'
    np.testing.assert_allclose(joined.column('currents:Joint_2').values, tau[:, 1])
    (tmp_path / 'short.csv').write_text('a\n1\n2\n')
    with pytest.raises(RecordingError, match=r'positions.csv.*200.*short.csv.*2'):
        side_by_side([open_table(tmp_path / f'{n}.csv') for n in ('positions', 'short')])


def edited(lines, row, cell, text):
    """Return lines of which one has another cell."""
    cells = lines[row].split(',')
    cells[cell] = text
    return [*lines[:row], ','.join(cells), *lines[row + 1 :]]


def with_holes(lines):
    for row in range(50, 150):
        lines = edited(lines, row, -1, '')
    return lines


@pytest.mark.parametrize(
    ('edit', 'message'),
    [
        (lambda lines: edited(lines, 1, 0, 'oops'), 'line 2,.* time.*oops'),
        (lambda lines: edited(lines, 7, 0, '1,1'), 'line 8.*8.*7'),
        (lambda lines: ['time,q1,q2', *lines[1:]], '3.*time, q1, q2.*line 2.*7'),
        (with_holes, '100 of 200.*effort of elbow'),
    ],
)
def test_what_is_wrong_is_named_with_file_line_and_column(edit, message, motion, tmp_path):
    path = tmp_path / 'run.csv'
    path.write_text('\n'.join(edit(text(motion).splitlines())))
    with pytest.raises(RecordingError, match=f'run.csv: .*{message}'):
        read_recording(path, joints=JOINTS)


@pytest.mark.parametrize(
    ('time', 'last', 'message'),
    [(0.005, np.nan, 'q2'), (0.0, 1.0, 'time'), (1.0, 1.0, 'time.*--time-unit')],
)
def test_columns_without_a_meaning_are_named(time, last, message, motion, tmp_path):
    t, q, *rest = motion
    path = tmp_path / 'run.csv'
    path.write_text(text((time * np.arange(len(t)), q * [1.0, last], *rest)))
    with pytest.raises(RecordingError, match=f'run.csv: .*{message}'):
        read_recording(path, joints=JOINTS)


def test_a_last_line_cut_off_is_left_out_and_said(motion, tmp_path):
    path = tmp_path / 'run.csv'
    path.write_text(text(motion)[:-30])
    recording = read_recording(path, joints=JOINTS)
    assert len(recording) == 199
    assert '201' in recording.report.describe()


def test_a_library_that_is_missing_is_named(motion, tmp_path, monkeypatch):
    path = tmp_path / 'run.parquet'
    path.write_bytes(b'')
    monkeypatch.setitem(sys.modules, 'pyarrow.parquet', None)
    with pytest.raises(RecordingError, match=r'armid_ros\[convert\]'):
        open_table(path)


def test_empty_cells_are_counted_and_the_first_is_named_with_its_line(motion, tmp_path):
    path = tmp_path / 'run.csv'
    path.write_text('\n'.join(edited(edited(text(motion).splitlines(), 3, 1, ''), 5, 4, '')))
    (note,) = open_table(path).notes
    assert all(fact in note for fact in ('2 cells', 'line 4', 'q1'))
    lacking = read_recording(path, joints=JOINTS).report.not_finite
    assert len(lacking) == 2 and all(one.endswith(' in 1') for one in lacking)


def test_what_is_packed_has_a_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(table, 'DEFAULT', replace(DEFAULT, memory_limit=1_000_000))
    path = tmp_path / 'bomb.csv.gz'
    path.write_bytes(gzip.compress(b'0,' * 10_000_000))
    with pytest.raises(RecordingError, match=r'bomb.csv.gz: '):
        open_table(path)


@pytest.mark.parametrize(
    ('name', 'content', 'fact'),
    [
        ('log.csv', b'', 'empty'),
        ('log.csv', b'\n \n', 'empty'),
        ('log.csv', 't,q\n0,1\n'.encode('utf-32'), 'binary'),
        ('log.csv', b'\x93NUMPY\x01\x00v\x00', 'binary'),
        ('log.csv', b'\xff\xfe\x00\xd8\x00\xd8', 'binary'),
        ('log.csv', b'hello\nworld\n', '2 lines'),
        ('log.csv.gz', b'a,b\n1,2\n', 'decompressed'),
        ('log.xlsx', b'', r'\.csv'),
    ],
)
def test_what_is_no_table_is_refused_with_its_kind(tmp_path, name, content, fact):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=f'^{path}: .*{fact}'):
        open_table(path)
