# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Reading of the commanded positions that were recorded together with measured positions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from armid_ros import Robot
from armid_ros.errors import RecordingError
from armid_ros.positions.loop import CommandedMotion
from armid_ros.recording import ReadSettings, Recording
from armid_ros.recording.bag import Bag
from armid_ros.recording.columns import ColumnSettings
from armid_ros.recording.message_types import JOINT_STATE
from armid_ros.recording.reader import is_table, read_recording
from armid_ros.recording.source import DEFAULT, listed, Topic
import numpy as np

#: Ending of the message types of a joint_trajectory_controller. Their fields are joint_names,
#: and the JointTrajectoryPoint reference (desired before Jazzy).
_STATE = 'JointTrajectoryControllerState'


def read_commands(
    path: Path,
    robot: Robot,
    recording: Recording,
    name: str | None = None,
    columns: ColumnSettings | None = None,
    settings: ReadSettings = DEFAULT,
) -> CommandedMotion:
    """
    Read the commanded positions that were recorded together with measured positions.

    Parameters
    ----------
    path : Path
        A bag or a table.
    robot : Robot
        The robot.
    recording : Recording
        Positions that were read from the same path.
    name : str, optional
        Topic of the commands: sensor_msgs/JointState, or the state of a
        joint_trajectory_controller. By default the only such topic, which for JointState has
        'command' in its name. For a table the columns, as in `ColumnSettings`.
    columns : ColumnSettings, optional
        Columns and units of the positions.
    settings : ReadSettings
        Settings for checksums and memory when bags are read.

    Raises
    ------
    RecordingError
        If there are no commands, or several topics of them.

    """
    columns = columns or ColumnSettings()
    if is_table(path):
        if name is None:
            raise RecordingError(f'{path}: name the columns of the commands with --commands')
        columns = replace(columns, position=name, velocity='none', effort='none')
        topic = None
    else:
        topic = _topic(path, recording, name, settings)
        if topic.type_name.endswith(_STATE):
            return CommandedMotion.of(_controller_state(path, robot, topic, settings), recording)
        name = topic.name
    commanded = read_recording(
        path,
        joints=robot.joints,
        slides=list(robot.prismatic),
        topic=None if topic is None else name,
        columns=columns,
        settings=settings,
    )
    return CommandedMotion.of(commanded, recording)


def _topic(path: Path, recording: Recording, name: str | None, settings: ReadSettings) -> Topic:
    """Find the topic of commanded positions in a bag: topic `name`, or else the only candidate."""
    with Bag(path, settings) as bag:
        topics = bag.topics()
    if name is None:
        found = [
            one
            for one in topics
            if one.type_name.endswith(_STATE)
            or (
                one.type_name == JOINT_STATE and 'command' in one.name.replace(recording.topic, '')
            )
        ]
    else:
        found = [one for one in topics if one.name.strip('/') == name.strip('/')]
    if len(found) != 1:
        raise RecordingError(
            f'{path}: {"several topics" if found else "no topic"} of commanded positions; name a '
            f'topic of type {JOINT_STATE} or {_STATE} with --commands: {listed(topics)}'
        )
    return found[0]


def _controller_state(path: Path, robot: Robot, topic: Topic, settings: ReadSettings) -> Recording:
    """Read the reference positions from the state messages of a joint_trajectory_controller."""
    source, rows = f'{path}: {topic.name}', []
    with Bag(path, settings) as bag:
        for block in bag.blocks(topic.name):
            for k in range(len(block)):
                state = bag.decoded(topic, block.message(k))
                point = state.reference if hasattr(state, 'reference') else state.desired
                stamp, names = state.header.stamp, list(state.joint_names)
                missing = sorted(set(robot.joints) - set(names))
                if missing:
                    raise RecordingError(f'{source}: a message lacks joints {", ".join(missing)}')
                order = [names.index(joint) for joint in robot.joints]
                q, dq = (np.array(x) for x in (point.positions, point.velocities))
                if len(q) == len(names):
                    speed = dq[order] if len(dq) == len(q) else np.zeros(len(order))
                    rows.append((stamp.sec * 10**9 + stamp.nanosec, q[order], speed))
    if not rows:
        raise RecordingError(f'{source}: no positions; name another topic with --commands')
    stamps, *both = (np.array(column) for column in zip(*rows, strict=True))
    stamps, index = np.unique(stamps, return_index=True)
    sampled = 1e-9 * (stamps - stamps[0])
    t = np.arange(0.0, sampled[-1], 1e-3)  # the controller interpolates, too
    q, dq = (np.column_stack([np.interp(t, sampled, x) for x in y[index].T]) for y in both)
    return Recording(
        joints=robot.joints, t=t, q=q, dq=dq, start_ns=int(stamps[0]), source=str(path)
    )
