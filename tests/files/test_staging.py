# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A result of several files is that of one run, whatever ends the next one."""

import errno
import json
from pathlib import Path
import subprocess
import sys

from armid_ros.errors import OutputError
from armid_ros.files import final_path, staged, write_file
from armid_ros.files.output import locked, STAGING
import pytest


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_text()
        for path in folder.rglob('*')
        if path.is_file()
    }


@pytest.fixture
def out(tmp_path):
    """Return a folder with a result of Monday."""
    tmp_path /= 'out'
    tmp_path.mkdir()
    for name in ('identification.json', 'model.yaml', 'identified.urdf', 'notes.txt'):
        (tmp_path / name).write_text('monday')
    (tmp_path / 'recording').mkdir()
    (tmp_path / 'recording' / 'a.mcap').write_text('monday')
    return tmp_path


@pytest.mark.parametrize('end', [OutputError, KeyboardInterrupt])
def test_a_run_that_ends_before_all_is_written_leaves_the_earlier_result(out, end):
    before = contents(out)
    with pytest.raises(end):
        with staged(out, ('*.json', 'model.yaml', 'identified.urdf')) as result:
            write_file(result.folder / 'model.yaml', 'tuesday')
            raise end
    assert contents(out) == before
    assert not (out / STAGING).exists()


def test_a_result_that_is_kept_replaces_the_earlier_one(out):
    named = ('*.json', 'model.yaml', 'identified.urdf', 'recording')
    with staged(out, named) as result:
        for name in ('model.yaml', 'identification.json'):
            write_file(result.folder / name, 'tuesday')
            result.keep()
        (result.folder / 'recording').mkdir()
        write_file(result.folder / 'recording' / 'b.mcap', 'tuesday')
        result.keep()
    assert contents(out) == {
        'model.yaml': 'tuesday',
        'identification.json': 'tuesday',
        'notes.txt': 'monday',
        'recording/b.mcap': 'tuesday',
    }
    assert not (out / STAGING).exists()


def test_a_run_that_is_killed_leaves_all_of_one_result(out):
    """The kill comes before every call of the system, one after the other."""
    command = [sys.executable, Path(__file__).with_name('killed.py'), out]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    seen = set()
    for number, line in enumerate(done.stdout.splitlines()):
        left = json.loads(line)
        results = {
            path: text
            for path, text in left.items()
            if not path.startswith((STAGING, 'notes', 'recording'))
        }
        assert sorted(results) == [
            'identification.json',
            'model.yaml',
            'report.html',
            'trajectory/a.mcap',
        ]
        assert len(set(results.values())) == 1, number
        assert left['notes.txt'] == left['recording/a.mcap'] == 'monday'
        seen |= set(results.values())
    assert len(seen) > 2  # killed after the exchange as well
    assert [path.name for path in out.parent.iterdir() if path.name.startswith('.')] == []


def test_the_current_folder_keeps_its_identity(out, monkeypatch):
    """A shell that stands in the folder must not stand in a removed one afterwards."""
    monkeypatch.chdir(out)
    before = out.stat().st_ino
    with staged(Path(), ('*.json', 'model.yaml', 'identified.urdf')) as result:
        write_file(result.folder / 'model.yaml', 'tuesday')
        result.keep()
    assert out.stat().st_ino == before
    assert (out / 'model.yaml').read_text() == 'tuesday'


def test_the_folder_stays_locked_and_keeps_its_mode(out):
    out.chmod(0o750)
    with staged(out) as result:
        write_file(result.folder / 'model.yaml', 'tuesday')
        result.keep()
        with pytest.raises(OutputError, match='another run'):
            with locked(out):
                pass
    assert out.stat().st_mode & 0o777 == 0o750


def test_a_description_that_the_result_refers_to_stays(out):
    with staged(out, ('identified.urdf',), [out / 'identified.urdf']) as result:
        write_file(result.folder / 'model.yaml', 'tuesday')
        result.keep()
    assert (out / 'identified.urdf').read_text() == 'monday'


def test_no_document_vouches_for_files_that_are_half_moved(out, monkeypatch):
    """The document that names the recordings of a model is not there beside another model."""

    def full(self, target):
        raise OSError(errno.EIO, 'Input/output error')

    with pytest.raises(OutputError, match='Input/output error'):
        with staged(out) as result:
            for name in ('model.yaml', 'identification.json'):
                write_file(result.folder / name, 'tuesday')
            monkeypatch.chdir(out)  # a folder that is not exchanged
            monkeypatch.setattr(Path, 'replace', full)
            result.keep()
    assert not (out / 'identification.json').exists()
    assert (out / 'model.yaml').read_text() == 'monday'


def test_what_a_killed_run_left_is_no_obstacle_and_no_way_out(out, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp('elsewhere')
    (elsewhere / 'precious').write_text('kept')
    (out / STAGING).symlink_to(elsewhere)
    with staged(out) as result:
        write_file(result.folder / 'model.yaml', 'tuesday')
        result.keep()
    assert contents(elsewhere) == {'precious': 'kept'}
    (out / STAGING).mkdir()
    (out / STAGING / 'model.yaml').write_text('half')
    with staged(out) as result:
        result.keep()
    assert (out / 'model.yaml').read_text() == 'tuesday'


def test_errors_name_the_place_of_a_file_and_not_where_it_is_made(out):
    with staged(out) as result:
        assert final_path(result.folder / 'model.yaml') == out / 'model.yaml'
        with pytest.raises(OutputError) as refused:
            write_file(result.folder / 'none' / 'model.yaml', '')
    assert str(refused.value).startswith(f'{out / "none" / "model.yaml"}: ')
