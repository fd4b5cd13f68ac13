# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Results are whole or absent, and no run takes the place of another unawares."""

import errno
import json
import os
import subprocess
import sys

from armid_ros.errors import OutputError
from armid_ros.files import json_text, result_folder, write_file
from armid_ros.files.output import refuse_replacing
import pytest

SCHEMA = 'armid/identification/1'


def test_a_link_is_replaced_and_not_followed(tmp_path):
    (tmp_path / 'out').mkdir()
    (tmp_path / 'precious').write_text('kept')
    for name in ('a.json', '.a.json.part'):
        (tmp_path / 'out' / name).symlink_to(tmp_path / 'precious')
    write_file(tmp_path / 'out' / 'a.json', 'result')
    assert (tmp_path / 'precious').read_text() == 'kept'
    assert (tmp_path / 'out' / 'a.json').read_text() == 'result'
    assert not (tmp_path / 'out' / 'a.json').is_symlink()


def test_a_disk_that_is_full_leaves_the_old_file(tmp_path, monkeypatch):
    write_file(tmp_path / 'a.json', 'old')

    def full(*_):
        raise OSError(errno.ENOSPC, 'No space left on device')

    monkeypatch.setattr('armid_ros.files.output.os.fdopen', full)
    with pytest.raises(OutputError, match=r'a\.json: '):
        write_file(tmp_path / 'a.json', 'new')
    monkeypatch.undo()
    assert [path.name for path in tmp_path.iterdir()] == ['a.json']
    assert (tmp_path / 'a.json').read_text() == 'old'


WRITE_FOR_EVER = """
import json, sys
from armid_ros.files import write_file

for k in range(10**9):
    write_file(sys.argv[1], json.dumps([k] * 20_000))
    print(k, flush=True)
"""


def test_a_writer_that_is_killed_leaves_a_whole_file(tmp_path):
    command = [sys.executable, '-c', WRITE_FOR_EVER, str(tmp_path / 'a.json')]
    for round_ in range(10):
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as writer:
            while int(writer.stdout.readline()) < round_:
                pass
            writer.kill()
        assert len(json.loads((tmp_path / 'a.json').read_text())) == 20_000


def test_json_has_null_for_what_is_no_number():
    assert json.loads(json_text({'a': [1.5, float('nan')], 'b': float('inf')})) == {
        'a': [1.5, None],
        'b': None,
    }


def test_a_second_run_in_one_folder_is_refused(tmp_path):
    with result_folder(tmp_path, SCHEMA):
        with pytest.raises(OutputError, match=str(tmp_path)):
            with result_folder(tmp_path, SCHEMA):
                pass
    with result_folder(tmp_path, SCHEMA):
        pass


PAGE = '<!DOCTYPE html>\n<head>\n<meta name="generator" content="armid_ros">\n</head>'
OWN = {'model.yaml': 'schema: armid/model/1\nrobot: ur5\n'}


@pytest.mark.parametrize(
    ('files', 'refusal'),
    [
        ({}, None),
        ({'identification.json': f'{{"schema": "{SCHEMA}", "robot": "ur5"}}'}, None),
        (
            {'identification.json': f'{{"schema": "{SCHEMA}", "robot": "panda"}}'},
            'panda.* ur5.*--force',
        ),
        ({'identification.json': '{"schema": "armid/d/1"}'}, ' d, .*identification.*--force'),
        ({'identification.json': '"rubbish"'}, 'identification.json'),
        ({'lunar.json': '{"schema": "armid/lunar/1"}'}, 'lunar'),
        ({'fleet.json': '{"schema": "armid/fleet/1"}'}, 'fleet'),
        (OWN, None),
        ({'model.yaml': 'schema: armid/model/1\nrobot: panda\n'}, 'panda.* ur5.*--force'),
        ({'model.yaml': 'schema: other/1\nrobot: ur5\n'}, 'other/1'),
        ({'model.yaml': 'hello'}, 'model.yaml'),
        ({'report.html': PAGE}, None),
        ({**OWN, 'report.html': PAGE, 'identified.urdf': '<robot/>'}, None),
        ({'report.html': 'precious'}, 'report.html.*--force'),
        ({**OWN, 'report.html': 'precious'}, 'report.html'),
        ({'identified.urdf': '<robot/>'}, 'identified.urdf'),
        ({**OWN, 'notes.txt': 'mine'}, 'notes.txt'),
    ],
)
def test_results_of_others_are_kept_unless_forced(tmp_path, files, refusal):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    if refusal:
        with pytest.raises(OutputError, match=refusal):
            with result_folder(tmp_path, SCHEMA, 'ur5'):
                pass
    with result_folder(tmp_path, SCHEMA, 'ur5', force=refusal is not None):
        pass
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == files


def test_a_page_of_somebody_else_is_no_page_of_a_fleet(tmp_path):
    (tmp_path / 'fleet.json').write_text(json.dumps({'schema': 'armid/fleet/1'}))
    (tmp_path / 'pages').mkdir()
    with result_folder(tmp_path, 'armid/fleet/1'):
        pass
    (tmp_path / 'index.html').write_text('precious')
    with pytest.raises(OutputError, match=r'index\.html'):
        with result_folder(tmp_path, 'armid/fleet/1'):
            pass


@pytest.mark.parametrize(
    ('files', 'refused'),
    [
        ({}, ''),
        ({'notes.txt': 'mine'}, ''),
        ({**OWN, 'robot.urdf': '<robot/>', 'notes.txt': 'mine'}, ''),
        ({'model.yaml': 'mine: true'}, 'model.yaml'),
        ({'robot.urdf': '<robot/>'}, 'robot.urdf'),
    ],
)
def test_what_a_service_saves_replaces_only_what_it_wrote(tmp_path, files, refused):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    if not refused:
        refuse_replacing(tmp_path, ('estimate.yaml', 'model.yaml', 'robot.urdf'))
        return
    with pytest.raises(OutputError, match=f'contains {refused}'):
        refuse_replacing(tmp_path, ('estimate.yaml', 'model.yaml', 'robot.urdf'))


def test_other_files_that_a_command_says_it_writes_are_no_strangers(tmp_path):
    for name in ('model.yaml', 'story.png'):
        (tmp_path / name).write_text(OWN['model.yaml'])
    with result_folder(tmp_path, SCHEMA, 'ur5', also=['*.png']):
        pass


def test_what_fails_before_it_writes_leaves_no_folder(tmp_path):
    with pytest.raises(RuntimeError):
        with result_folder(tmp_path / 'a' / 'b', SCHEMA):
            raise RuntimeError
    assert not (tmp_path / 'a').exists()


def test_a_folder_that_cannot_be_written_is_said_before_the_work(tmp_path, monkeypatch):
    def read_only(*_):
        raise OSError(errno.EROFS, 'Read-only file system')

    monkeypatch.setattr('armid_ros.files.output.os.fdopen', read_only)
    with pytest.raises(OutputError, match='Read-only'):
        with result_folder(tmp_path, SCHEMA):
            pytest.fail('the work began')
    (tmp_path / 'file').touch()
    with pytest.raises(OutputError, match=f'{tmp_path / "file" / "out"}: '):
        with result_folder(tmp_path / 'file' / 'out', SCHEMA):
            pytest.fail('the work began')
    assert os.listdir(tmp_path) == ['file']
