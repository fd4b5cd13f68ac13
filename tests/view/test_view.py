# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A recording in rerun: what the file holds is what was recorded, predicted, and drawn."""

from importlib.metadata import files
import json
import os
from pathlib import Path
import signal
import socket
import subprocess
import sys

import armid_ros as ar
from armid_ros.cli import main
from armid_ros.view import rerun_log
from armid_ros.view.bodies import bodies
from armid_ros.view.live import LiveLog
from armid_ros.view.rerun_log import log_scene, open_stream
from armid_ros.view.scene import make_scene
from click.testing import CliRunner
import numpy as np
import pinocchio as pin
import pytest
import rerun.chunk

TRUE = ('viscous_friction:viscous_coefficient=0.3', 'torque_offset@elbow:torque_offset=1.5')


@pytest.fixture(scope='module')
def urdf(request):
    return request.config.rootpath / 'examples' / 'arm.urdf'


@pytest.fixture(scope='module')
def recording(urdf):
    return ar.simulate(ar.ArmModel.of(urdf, effects=TRUE), torque_noise=0.01, rng=1)


@pytest.fixture(scope='module')
def scene(urdf, recording):
    return make_scene(ar.ArmModel.of(urdf, effects=TRUE[:1]), recording, ('elbow',))


def held(path):
    """Return what a file holds: entity to columns, static ones and those over time together."""
    found = {}
    for chunk in rerun.chunk.RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        columns = found.setdefault(chunk.entity_path, {})
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            columns.setdefault(name, []).extend(column.to_pylist())
    return found


def scalars(columns):
    (name,) = (name for name in columns if name.startswith('Scalars'))
    return np.ravel([value for value in columns[name] if value is not None])


def test_the_file_holds_arm_curves_and_residual(scene, tmp_path):
    log_scene(scene, open_stream('a run', tmp_path / 'run.rrd'))
    found = held(tmp_path / 'run.rrd')
    for joint in scene.robot.joints:
        assert f'/arm/{joint}' in found
        for entity in ('torque/{}/measured', 'torque/{}/predicted', 'residual/{}', 'position/{}'):
            assert f'/{entity.format(joint)}' in found
    np.testing.assert_allclose(scalars(found['/residual/elbow']), scene.residual[:, 2])
    np.testing.assert_allclose(scalars(found['/position/elbow']), scene.recording.q[:, 2])
    assert np.mean(scene.residual, axis=0) == pytest.approx([0.0, 0.0, 1.5], abs=0.05)


def test_the_marked_joint_has_another_colour(scene, tmp_path):
    log_scene(scene, open_stream('a run', tmp_path / 'run.rrd'))
    colours = {}
    for entity, columns in held(tmp_path / 'run.rrd').items():
        for name, values in columns.items():
            if 'albedo_factor' in name:
                colours[entity.split('/')[2]] = values[0]
    assert colours['elbow'] != colours['shoulder'] == colours['waist']


def test_poses_are_those_of_the_arm(scene):
    q = [np.interp(scene.pose_t, scene.recording.t, column) for column in scene.recording.q.T]
    robot = scene.robot
    data = robot.model.createData()
    k = len(scene.pose_t) // 2
    pin.forwardKinematics(robot.model, data, np.array(q)[:, k])
    np.testing.assert_allclose(scene.translations[k, 2], data.oMi[3].translation, atol=1e-12)
    np.testing.assert_allclose(scene.rotations[k, 2], data.oMi[3].rotation, atol=1e-12)


def test_bodies_have_the_size_of_the_description():
    text = """<robot name="r"><link name="base"/><link name="l">
        <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
        </inertial><visual><origin xyz="0 0 1"/><geometry><box size="0.2 0.4 0.6"/></geometry>
        </visual><visual><geometry><cylinder radius="0.1" length="2"/></geometry></visual>
        <visual><geometry><sphere radius="0.3"/></geometry></visual>
        <visual><geometry><mesh filename="nowhere.stl"/></geometry></visual></link>
        <joint name="j" type="revolute"><parent link="base"/><child link="l"/><axis xyz="0 0 1"/>
        <limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""
    (box, cylinder, sphere), notes = bodies(ar.load_robot(text))
    np.testing.assert_allclose(np.ptp(box.corners, axis=(0, 1)), [0.2, 0.4, 0.6])
    np.testing.assert_allclose(box.corners.mean(axis=(0, 1))[2], 1.0)
    np.testing.assert_allclose(np.ptp(cylinder.corners, axis=(0, 1)), [0.2, 0.2, 2.0], atol=0.01)
    np.testing.assert_allclose(np.linalg.norm(sphere.corners, axis=2), 0.3)
    (note,) = notes
    assert "'l'" in note and 'not found' in note
    for body in (box, cylinder, sphere):
        assert volume(body.corners) > 0.0


def volume(corners):
    """Return the volume that triangles enclose; negative where they are inside out."""
    return np.einsum('ti,ti->', corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0


def test_meshes_are_drawn_as_they_are():
    """Those of a shipped description, from their files, in the frames of their joints."""
    paths = [entry for entry in files('example-robot-data') or [] if entry.name == 'panda.urdf']
    robot = ar.load_robot(paths[0].locate())
    found, notes = bodies(robot)
    assert not notes
    assert {body.joint for body in found} == set(range(-1, robot.n_joints))
    for body in found:
        assert len(body.corners) > 500
        assert 0.03 < np.ptp(body.corners, axis=(0, 1)).max() < 0.5


def test_an_arm_without_bodies_is_drawn_as_bars():
    robot = ar.load_robot('human_legs')
    found, _ = bodies(robot)
    assert {body.joint for body in found} >= set(range(robot.n_joints - 1))


def test_an_arm_is_shown_while_it_moves(scene, tmp_path):
    log = LiveLog(scene.robot, open_stream('live', tmp_path / 'live.rrd'), ('elbow',))
    for k in range(50):
        log.measured(0.01 * k, np.full(3, 0.01 * k), None, np.arange(3.0))
        log.predicted(0.01 * k, np.arange(3.0))
        log.residual(0.01 * k, np.full(3, np.nan) if k == 3 else np.zeros(3))
    log.close()
    found = held(tmp_path / 'live.rrd')
    np.testing.assert_allclose(scalars(found['/position/elbow']), 0.01 * np.arange(50))
    assert len(scalars(found['/residual/waist'])) == 49
    poses = [v for name, v in found['/arm/elbow'].items() if name.startswith('Transform3D')]
    assert 10 < len(poses[0]) < 20


def test_the_command_writes_a_file_and_marks_what_the_diagnosis_named(
    urdf, recording, scene, tmp_path
):
    ar.write_recording(tmp_path / 'run', recording)
    found = tmp_path / 'found'
    found.mkdir()
    ar.save_model(found / 'model.yaml', ar.ArmModel.of(urdf, effects=TRUE[:1]), str(urdf))
    effects = [{'name': 'torque_offset', 'joints': ['elbow']}]
    (found / 'diagnosis.json').write_text(json.dumps({'effects': effects}))
    out = tmp_path / 'run.rrd'
    arguments = ['view', str(tmp_path / 'run'), '--model', str(found), '--out', str(out)]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 0, done.output
    assert 'coloured: elbow' in done.output
    np.testing.assert_allclose(scalars(held(out)['/residual/elbow']), scene.residual[:, 2])


@pytest.mark.parametrize('arguments', [[], ['run', '--live']])
def test_it_asks_for_a_bag_or_topics(arguments):
    done = CliRunner().invoke(main, ['view', *arguments])
    assert done.exit_code == 2
    assert 'a BAG' in done.output and '--live' in done.output


def test_without_rerun_one_line_says_what_to_install(monkeypatch, urdf, recording, tmp_path):
    ar.write_recording(tmp_path / 'run', recording)
    monkeypatch.setitem(sys.modules, 'rerun', None)
    done = CliRunner().invoke(main, ['view', str(tmp_path / 'run'), '--robot', str(urdf)])
    assert done.exit_code == 2
    assert 'armid_ros[view]' in done.output
    assert done.output.count('\n') == 1


def test_a_window_without_a_screen_is_refused(monkeypatch):
    for name in ('DISPLAY', 'WAYLAND_DISPLAY'):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, 'platform', 'linux')
    with pytest.raises(ar.ArmidError, match='--out'):
        open_stream('a run')


def test_a_window_is_reached_from_this_machine_alone(monkeypatch, tmp_path):
    """The viewer that is started is the real one, without its window."""
    started = []

    def start(command, **kwargs):
        started.append(popen([*command, '--serve-grpc'], **kwargs))
        return started[0]

    with socket.socket() as free:
        free.bind(('127.0.0.1', 0))
        port = free.getsockname()[1]
    popen = subprocess.Popen
    monkeypatch.setattr(rerun_log, '_has_screen', lambda: True)
    monkeypatch.setattr(rerun_log, '_PORT', port)
    monkeypatch.setattr(subprocess, 'Popen', start)
    try:
        open_stream('a run')
        bound = Path('/proc/net/tcp').read_text() + Path('/proc/net/tcp6').read_text()
        sockets = [line.split() for line in bound.splitlines()]
        listening = [one[1] for one in sockets if one[3] == '0A' and one[1][-4:] == f'{port:04X}']
        assert listening == [f'0100007F:{port:04X}']
    finally:
        os.killpg(started[0].pid, signal.SIGTERM)
        started[0].wait(10)
