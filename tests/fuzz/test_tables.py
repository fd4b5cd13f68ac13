# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Damaged tables: what is read of them is what was written, or it is said."""

import io
import json
import zipfile
import zlib

from armid_ros.recording.columns import ColumnSettings
from armid_ros.recording.reader import read_recording
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.io import savemat

from tests.fuzz.mutants import (
    BYTE_EDIT,
    edited_bytes,
    edited_text,
    edited_tree,
    INTEGERS,
    PLACE,
    TEXT_EDIT,
    TREE_EDIT,
)
from tests.fuzz.property import judge

JOINTS = ('shoulder', 'elbow')
T = np.arange(200) * 0.005
Q = 0.4 * np.sin(T[:, None] * [6.0, 10.0])
TAU = 3.0 * Q + 0.1
NAMES = ('pos_shoulder', 'pos_elbow', 'tau_shoulder', 'tau_elbow')
#: Formats whose bytes have checksums, or fields in places of their own.
KINDS = ('csv', 'npy', 'npz', 'packed.npz', 'v4.mat', 'v5.mat', 'packed.mat', 'v73.mat', 'h5',
         'chunked.h5', 'parquet')  # fmt: skip
FIELD = st.tuples(PLACE, st.sampled_from(INTEGERS), st.sampled_from([1, 2, 4, 8]))


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder with a table of each kind."""
    h5py, pyarrow = pytest.importorskip('h5py'), pytest.importorskip('pyarrow')
    from pyarrow import parquet

    folder = tmp_path_factory.mktemp('tables')
    (folder / 'work').mkdir()
    columns = {'t': T, **dict(zip(NAMES, np.column_stack([Q, TAU]).T, strict=True))}
    matrix = np.column_stack(list(columns.values()))
    np.savetxt(folder / 'csv', matrix, '%.17g', ',', header=','.join(columns), comments='')
    fields = np.rec.fromarrays(list(columns.values()), names=list(columns))
    with (folder / 'npy').open('wb') as file:
        np.save(file, np.asarray(fields))
    with (folder / 'npz').open('wb') as file:
        np.savez(file, **columns)
    with (folder / 'packed.npz').open('wb') as file:
        np.savez_compressed(file, **columns)
    with (folder / 'v4.mat').open('wb') as file:
        savemat(file, columns, format='4')
    for name, packed in (('v5.mat', False), ('packed.mat', True)):
        with (folder / name).open('wb') as file:
            savemat(file, {'log': columns, 'cells': [{'a': 1.0}, 'x']}, do_compression=packed)
    for name, how in (('h5', {}), ('chunked.h5', {'chunks': True, 'compression': 'gzip'})):
        with h5py.File(folder / name, 'w') as file:
            for key, values in columns.items():
                file.create_dataset(key, data=values, **how)
    (folder / 'v73.mat').write_bytes(bytes(512) + (folder / 'h5').read_bytes())
    parquet.write_table(pyarrow.table(columns), folder / 'parquet')
    return folder


def read(path):
    return read_recording(path, joints=JOINTS, columns=ColumnSettings(velocity='none'))


def agrees(answer, whole):
    """Compare a recording with what was written; numbers alone have no checksum."""
    assert np.isfinite(answer.q).all()
    assert (np.diff(answer.t) > 0.0).all()
    same = len(answer) == len(whole.t) and answer.tau is not None
    if same and np.array_equal(answer.q, whole.q) and np.array_equal(answer.tau, whole.tau):
        return 'same'
    if same or not answer.report.unharmed or answer.tau is None:
        return 'said' if not answer.report.unharmed or answer.tau is None else 'other'
    return f'{len(answer)} of {len(whole.t)} samples without a word'


def text_agrees(answer, whole):
    """Accept fewer lines, of which text has no count."""
    verdict = agrees(answer, whole)
    return verdict if verdict in ('same', 'said') else 'other'


@pytest.fixture(scope='module')
def whole(folder):
    path = folder / 'work' / 'whole.csv'
    path.write_bytes((folder / 'csv').read_bytes())
    return read(path)


@pytest.mark.parametrize('kind', KINDS)
def test_undamaged(folder, whole, kind):
    path = folder / 'work' / f'sound.{kind}'
    path.write_bytes((folder / kind).read_bytes())
    assert agrees(read(path), whole) == 'same'


@given(
    kind=st.sampled_from(KINDS),
    edits=st.lists(BYTE_EDIT, min_size=1, max_size=4),
    fields=st.lists(FIELD, max_size=3),
    head=st.booleans(),
)
def test_bytes(folder, whole, kind, edits, fields, head):
    content = (folder / kind).read_bytes()
    size = min(1024, len(content)) if head else len(content)
    mutant = bytearray(content[:size] if fields else edited_bytes(content[:size], edits))
    for place, value, width in fields:
        at = int(place * max(1, len(mutant) - width))
        mutant[at : at + width] = (value & (2 ** (8 * width) - 1)).to_bytes(width, 'little')
    path = folder / 'work' / f'bytes.{kind}'
    path.write_bytes(bytes(mutant) + content[size:])
    judge(read, path, whole, text_agrees if kind == 'csv' else agrees)


@given(edits=st.lists(TEXT_EDIT, min_size=1, max_size=3))
def test_csv_text(folder, whole, edits):
    path = folder / 'work' / 'text.csv'
    text = (folder / 'csv').read_text().replace(',', ' , ')
    path.write_text(edited_text(text, edits), errors='surrogatepass')
    judge(read, path, whole, text_agrees)


@given(edits=st.lists(TREE_EDIT, min_size=1, max_size=3))
def test_description_of_a_dataset(folder, whole, edits):
    bag = folder / 'work' / 'dataset'
    (bag / 'meta').mkdir(parents=True, exist_ok=True)
    (bag / 'data').mkdir(exist_ok=True)
    (bag / 'data' / 'episode_000000.parquet').write_bytes((folder / 'parquet').read_bytes())
    features = {name: {'dtype': 'float64', 'names': None} for name in ('t', *NAMES)}
    tree = {'fps': 200, 'total_episodes': 1, 'features': features}
    (bag / 'meta' / 'info.json').write_text(json.dumps(edited_tree(tree, edits)))
    judge(read, bag, whole, agrees)


@given(shape=st.lists(st.sampled_from(INTEGERS[4:]), min_size=1, max_size=3), kind=st.sampled_from(
    ['npy', 'npz', 'mat', 'h5']))  # fmt: skip
def test_stated_sizes_are_bounds(folder, whole, shape, kind):
    """A file of some bytes that states to hold terabytes takes none."""
    path = folder / 'work' / f'bomb.{kind}'
    head = io.BytesIO()
    stated = {'descr': '<f8', 'fortran_order': False, 'shape': tuple(shape)}
    np.lib.format.write_array_header_2_0(head, stated)
    if kind == 'npy':
        path.write_bytes(head.getvalue() + bytes(80))
    elif kind == 'npz':
        with zipfile.ZipFile(path, 'w', zipfile.ZIP_DEFLATED) as archive:
            archive.writestr('q.npy', head.getvalue() + bytes(80))
    elif kind == 'mat':
        path.write_bytes(matlab_of(shape))
    else:
        h5py = pytest.importorskip('h5py')
        try:
            with h5py.File(path, 'w') as file:
                file.create_dataset('q', tuple(shape), chunks=True, dtype='f8')
        except (OSError, ValueError, OverflowError):
            return  # no such file can be made
    judge(read, path, whole, agrees)


def matlab_of(shape):
    """Return a MAT file of version 5 with a packed array that states a shape."""
    dimensions = np.array([*shape, 1], np.uint64).astype(np.int32).tobytes()
    dimensions += bytes(-len(dimensions) % 8)
    words = [6, 8, 6, 0, 5, 4 * (len(shape) + 1)]
    body = np.array(words, np.int32).tobytes() + dimensions
    body += np.array([1, 1], np.int32).tobytes() + b'q' + bytes(7)
    body += np.array([9, 80], np.int32).tobytes() + bytes(80)
    packed = zlib.compress(np.array([14, len(body)], np.int32).tobytes() + body)
    return (
        b'MATLAB 5.0 MAT-file'.ljust(124)
        + np.array([0x0100, 0x4D49], np.uint16).tobytes()
        + np.array([15, len(packed)], np.int32).tobytes()
        + packed
    )
