# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What armid inspect prints and shows of bags and tables."""

from armid_ros.recording import Recording, write_recording
from armid_ros.recording.mcap.records import map_file
from armid_ros.robots import load_robot
import numpy as np
import pytest

from .conftest import armid, DURATION, RATE, ROBOT


def test_a_bag_is_shown_within_80_columns_and_on_a_page(bags, tmp_path):
    text = armid('inspect', bags[0], '--robot', ROBOT, '--out', tmp_path / 'o').stdout
    assert max(len(line) for line in text.splitlines() if line.startswith('  ')) <= 80
    for said in (f'/joint_states: {DURATION * RATE}', 'elbow_pitch', 'armid identify'):
        assert said in text
    page = (tmp_path / 'o' / 'inspection.html').read_text()
    assert page.count('<figure') == 3 * 6 + 1
    assert '<script src' not in page


def test_a_table_is_inspected_as_a_bag_is(tmp_path):
    t = np.arange(0, 10, 0.01)
    table = np.column_stack([t, 100 * np.sin(t), 3 * np.sin(t)])
    path = tmp_path / 'run.csv'
    np.savetxt(path, table, delimiter=',', header='time,q1,tau1', comments='')
    result = armid('inspect', path)
    assert 'in degrees' in result.stdout
    assert '(guessed)' in result.stderr
    assert 'in degrees' not in armid('inspect', path, '--degrees').stdout


@pytest.fixture(scope='module')
def damaged(tmp_path_factory):
    """Return a bag with one bit of a chunk turned round, which makes another number of one."""
    robot = load_robot(ROBOT)
    t = np.arange(4000) / 250.0
    wave = np.outer(t, np.linspace(0.5, 2.0, 6))
    bag = tmp_path_factory.mktemp('rot') / 'bag'
    q, dq = 0.3 * np.sin(wave), 0.3 * np.cos(wave)
    recording = Recording(joints=robot.joints, t=t, q=q, dq=dq, tau=q, start_ns=10**18)
    write_recording(bag, recording, compression='none', chunk_size=20_000)
    path = next(bag.glob('*.mcap'))
    content = bytearray(path.read_bytes())
    chunk = map_file(bytes(content), path).chunks[0]
    content[content.index(q[600, 3].tobytes(), chunk.begin) + 6] ^= 1  # not of a length or name
    path.write_bytes(content)
    return bag


def test_inspect_reads_with_and_without(damaged):
    said = ' '.join(armid('inspect', damaged).output.split())
    assert '3940 messages' in said and 'checksum' in said
    assert 'checksum' not in armid('inspect', damaged, '--no-crc').output
