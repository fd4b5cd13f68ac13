# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A recording in rerun: what the file holds is what was recorded, predicted, and drawn."""

import json
import os
from pathlib import Path
import re
import signal
import socket
import subprocess
import sys

import armid_ros as ar
from armid_ros.view import rerun_log
from armid_ros.view.rerun_log import log_recording, open_stream
import numpy as np
import pinocchio as pin
import pytest
import rerun.chunk

from tests.cli.conftest import armid

TRUE = ('viscous_friction:viscous_coefficient=0.3', 'torque_offset@elbow:torque_offset=1.5')


@pytest.fixture(scope='module')
def urdf(request):
    return request.config.rootpath / 'examples' / 'arm.urdf'


@pytest.fixture(scope='module')
def recording(urdf):
    return ar.simulate(ar.ArmModel.of(urdf, effects=TRUE), torque_noise=0.01, rng=1)


@pytest.fixture(scope='module')
def model(urdf):
    return ar.ArmModel.of(urdf, effects=TRUE[:1])


@pytest.fixture(scope='module')
def found(model, recording, tmp_path_factory):
    """Return what the file of a recording holds, the elbow being marked."""
    return logged(tmp_path_factory.mktemp('view') / 'run.rrd', model, recording, ('elbow',))


def logged(path, model, recording, marked=()):
    log_recording(open_stream('a run', path), model, recording, marked)
    return held(path)


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


def test_the_file_holds_poses_curves_and_residual_and_the_marked_joint_in_another_colour(
    found, model, recording
):
    for joint in recording.joints:
        for entity in ('torque/{}/measured', 'torque/{}/predicted', 'residual/{}', 'position/{}'):
            assert f'/{entity.format(joint)}' in found
    np.testing.assert_allclose(scalars(found['/position/elbow']), recording.q[:, 2])
    means = [scalars(found[f'/residual/{joint}']).mean() for joint in recording.joints]
    assert means == pytest.approx([0.0, 0.0, 1.5], abs=0.05)
    (places,) = (v for name, v in found['/arm/elbow'].items() if name.endswith('translation'))
    assert 25.0 < len(places) / recording.duration < 45.0
    data = model.robot.model.createData()
    every, k = -(-len(recording) // len(places)), len(places) // 2
    pin.forwardKinematics(model.robot.model, data, recording.q[k * every])
    np.testing.assert_allclose(np.squeeze(places[k]), data.oMi[3].translation, atol=1e-6)
    colours = {
        entity.split('/')[2]: values[0]
        for entity, columns in found.items()
        for name, values in columns.items()
        if entity.startswith('/arm/') and 'colors' in name
    }
    assert colours['elbow'] != colours['shoulder'] == colours['waist']


def test_bodies_have_the_size_of_the_description(recording, tmp_path):
    text = """<robot name="r"><link name="base"/><link name="l">
        <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
        </inertial><visual><origin xyz="0 0 1"/><geometry><box size="0.2 0.4 0.6"/></geometry>
        </visual><visual><geometry><cylinder radius="0.1" length="2"/></geometry></visual>
        <visual><geometry><sphere radius="0.3"/></geometry></visual>
        <visual><geometry><mesh filename="nowhere.stl"/></geometry></visual>
        <visual><geometry><mesh filename="file://BROKEN"/></geometry></visual></link>
        <joint name="j" type="revolute"><parent link="base"/><child link="l"/><axis xyz="0 0 1"/>
        <limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""
    broken = tmp_path / 'broken.stl'
    broken.write_text('no mesh')
    model = ar.ArmModel(ar.load_robot(text.replace('BROKEN', str(broken))))
    run = ar.Recording(joints=('j',), t=np.arange(3.0), q=np.zeros((3, 1)))
    absent, unread = log_recording(open_stream('a run', tmp_path / 'run.rrd'), model, run)
    assert "'l'" in absent and 'not found' in absent
    assert "'l'" in unread and str(broken) in unread
    found = held(tmp_path / 'run.rrd')

    def size(number, name):
        columns = found[f'/arm/j/l_{number}']
        (values,) = (values for column, values in columns.items() if column.endswith(name))
        return np.ravel([one for one in values if one is not None])

    np.testing.assert_allclose(size(0, 'half_sizes'), [0.1, 0.2, 0.3], rtol=1e-6)
    np.testing.assert_allclose(size(0, 'translation'), [0.0, 0.0, 1.0])
    np.testing.assert_allclose([*size(1, 'radii'), *size(1, 'lengths')], [0.1, 2.0], rtol=1e-6)
    np.testing.assert_allclose(size(2, 'half_sizes'), 0.3, rtol=1e-6)


def test_meshes_are_drawn_and_links_without_any_body_as_bars(example_robot, tmp_path):
    """Meshes of a shipped description, from their files, in the frames of their joints."""
    described = ar.load_robot(example_robot('panda.urdf'))
    bare = ar.load_robot(re.sub(r'(?s)<(visual|collision)>.*?</\1>', '', described.urdf))
    for robot, drawn in ((described, 'Asset3D:blob'), (bare, 'LineStrips3D:strips')):
        still = np.zeros((3, robot.n_joints))
        run = ar.Recording(joints=robot.joints, t=np.arange(3.0), q=still)
        found = logged(tmp_path / f'{drawn[:5]}.rrd', ar.ArmModel(robot), run)
        with_body = {entity.split('/')[2] for entity, columns in found.items() if drawn in columns}
        assert with_body >= {*robot.joints[2:-2]}


def test_the_command_writes_a_file_and_marks_what_the_diagnosis_named(
    urdf, recording, found, tmp_path
):
    ar.write_recording(tmp_path / 'run', recording)
    result = tmp_path / 'found'
    result.mkdir()
    ar.save_model(result / 'model.yaml', ar.ArmModel.of(urdf, effects=TRUE[:1]), str(urdf))
    effects = [{'name': 'torque_offset', 'joints': ['elbow']}]
    (result / 'diagnosis.json').write_text(json.dumps({'effects': effects}))
    out = tmp_path / 'run.rrd'
    done = armid('view', tmp_path / 'run', '--model', result, '--out', out)
    assert 'coloured: elbow' in done.output
    np.testing.assert_allclose(
        scalars(held(out)['/residual/elbow']), scalars(found['/residual/elbow'])
    )


def test_without_rerun_one_line_says_what_to_install(monkeypatch, urdf, recording, tmp_path):
    ar.write_recording(tmp_path / 'run', recording)
    monkeypatch.setitem(sys.modules, 'rerun', None)
    done = armid('view', tmp_path / 'run', '--robot', urdf, code=2)
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
    monkeypatch.setenv('DISPLAY', ':0')
    monkeypatch.setattr(rerun_log, '_PORT', port)
    monkeypatch.setattr(subprocess, 'Popen', start)
    try:
        open_stream('a run')
        bound = Path('/proc/net/tcp').read_text() + Path('/proc/net/tcp6').read_text()
        sockets = [line.split() for line in bound.splitlines()]
        listening = [one[1] for one in sockets if one[3] == '0A' and one[1][-4:] == f'{port:04X}']
        assert listening == [f'0100007F:{port:04X}']
    finally:
        os.killpg(started[0].pid, signal.SIGKILL)
        started[0].wait(10)
