# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid positions`: what it reads, writes and refuses."""

from dataclasses import replace
from functools import partial
import json

import armid_ros as ar
from armid_ros.errors import RecordingError, RobotError
from armid_ros.positions.command import gains_of, positions
from armid_ros.positions.commands import read_commands
from armid_ros.positions.loop import CommandedMotion
from armid_ros.positions.text import limit_hints
from armid_ros.recording import read_recording
from armid_ros.recording.columns import ColumnSettings
from armid_ros.recording.joint_state.encoder import write_joint_states
from armid_ros.recording.writer import atomic_bag
import numpy as np
import pytest
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from docsite.schemas import faults
from tests.command import run_command
from tests.positions.machine import play, random_chain, Secret

#: Part of the message that a joint_trajectory_controller publishes.
STATE = 'control_msgs/msg/JointTrajectoryControllerState'
DEFINITION = """std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint reference
"""


run = partial(run_command, positions)


@pytest.fixture(scope='module')
def robot():
    return random_chain(np.random.default_rng(8), links=2)


@pytest.fixture(scope='module')
def secret(robot):
    return Secret.draw(robot, np.random.default_rng(9))


@pytest.fixture(scope='module')
def played(robot, secret):
    return play(robot, secret, np.random.default_rng(10), duration=6.0)


@pytest.fixture(scope='module')
def folder(robot, played, tmp_path_factory):
    """Return a folder with a description, a bag and a table of the same run."""
    place = tmp_path_factory.mktemp('positions')
    measured, commanded = played
    (place / 'arm.urdf').write_text(robot.urdf)
    with atomic_bag(place / 'run') as writer:
        for topic, one in (('/joint_states', measured), ('/joint_commands', commanded)):
            stamps = 10**9 + np.rint(1e9 * one.t).astype(np.int64)
            write_joint_states(writer, topic, robot.joints, stamps, one.q, one.dq)
    every = np.searchsorted(commanded.t, measured.t + 1e-9) - 1
    np.savez(place / 'run.npz', t=measured.t, q=measured.q, q_des=commanded.q[every])
    return place


def test_the_command_writes_model_and_document(folder, robot, secret):
    gains = ','.join(map(str, [*secret.kp, *secret.kd]))
    out = folder / 'drives'
    text = run(folder / 'run', '--robot', folder / 'arm.urdf', '--gains', gains, '--out', out)
    assert 'command delay' in text and 'given position gains agree' in text
    document = json.loads((out / 'positions.json').read_text())
    assert faults('positions', document) == []
    arm = ar.load_model(out / 'model.yaml')
    values = {effect.name: value for effect, value in zip(arm.effects, arm.values, strict=True)}
    np.testing.assert_allclose(values['coulomb_friction'], secret.coulomb, rtol=0.1)
    np.testing.assert_allclose(values['viscous_friction'], secret.viscous, rtol=0.1)
    torque = read_recording(out / 'torque' / '1_run', joints=robot.joints).tau
    assert torque is not None and np.all(np.ptp(torque, axis=0) > 0.0)
    gains = gains_of(str(out / 'positions.json'), robot)
    np.testing.assert_allclose(gains, [secret.kp, secret.kd])


def test_commands_beyond_limits_and_torques_at_limits_are_hints(robot, played):
    measured, commanded = played
    commands = CommandedMotion.of(commanded, measured)
    still = replace(measured, tau=np.zeros_like(measured.q))
    assert limit_hints([(measured, commands)], [still], robot) == []
    far = replace(commands, q=commands.q + 10.0)
    most = replace(measured, tau=still.tau + robot.torque_limit)
    hints = limit_hints([(measured, far)], [most], robot)
    assert len(hints) == 2 * robot.n_joints
    assert hints[0].startswith('joint0: 100 % of the commands')


def test_a_table_has_positions_and_commands_in_columns_and_what_has_none_is_refused(
    folder, robot, played
):
    columns = ColumnSettings(time='t', position='q', velocity='none', effort='none')
    measured = read_recording(folder / 'run.npz', joints=robot.joints, columns=columns)
    found = read_commands(folder / 'run.npz', robot, measured, 'q_des', columns)
    np.testing.assert_allclose(found.q[::2], played[1].q, atol=1e-9)
    with pytest.raises(RecordingError, match='--commands'):
        read_commands(folder / 'run.npz', robot, measured, None, columns)
    ar.write_recording(folder / 'bare', played[0])
    with pytest.raises(RecordingError, match=r'no topic of commanded positions.*/joint_states'):
        read_commands(folder / 'bare', robot, played[0])


def test_the_reference_of_a_trajectory_controller_is_read(tmp_path, robot, played):
    measured, commanded = played
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(DEFINITION, STATE))
    types = store.types
    with atomic_bag(tmp_path / 'run') as writer:
        stamps = 10**9 + np.rint(1e9 * measured.t).astype(np.int64)
        write_joint_states(writer, '/joint_states', robot.joints, stamps, measured.q)
        writer.add_topic('/controller/controller_state', STATE, definition=DEFINITION)
        for t, q in zip(commanded.t, commanded.q, strict=True):
            stamp = round(1e9 * t) + 10**9
            header = types['std_msgs/msg/Header'](
                types['builtin_interfaces/msg/Time'](*divmod(stamp, 10**9)), ''
            )
            point = types['trajectory_msgs/msg/JointTrajectoryPoint'](
                q[::-1].copy(), np.empty(0), np.empty(0), np.empty(0),
                types['builtin_interfaces/msg/Duration'](0, 0),
            )  # fmt: skip
            message = types[STATE](header, list(robot.joints[::-1]), point)
            writer.write(
                '/controller/controller_state', store.serialize_cdr(message, STATE), stamp
            )
    read = read_recording(tmp_path / 'run', joints=robot.joints)
    found = read_commands(tmp_path / 'run', robot, read)
    at = np.searchsorted(found.t, commanded.t[5])
    np.testing.assert_allclose(found.q[at], commanded.q[5], atol=1e-3)


def test_gains_are_of_all_joints_or_of_each(robot):
    n = robot.n_joints
    np.testing.assert_array_equal(gains_of('800,40', robot), [n * [800.0], n * [40.0]])
    each = ','.join(str(k + 1) for k in range(2 * n))
    assert gains_of(each, robot)[1, 0] == n + 1
    for text in ('800', '800,-1', '0,1', 'a,b'):
        with pytest.raises(RobotError, match='--gains'):
            gains_of(text, robot)
