# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Display of a recording in rerun: curves and moving arm on one timeline, in a window or a file.

Entities are ``arm/<joint>``, ``torque/<joint>/measured`` and ``predicted``, ``residual/<joint>``,
``position/<joint>`` and ``velocity/<joint>``.

"""

from __future__ import annotations

from collections.abc import Sequence
import os
from pathlib import Path
import socket
import subprocess
import sys
import time
from types import ModuleType
from typing import Any

from armid_ros import ArmModel, Recording
from armid_ros.errors import ArmidError, RobotError
from armid_ros.identification import SignalSettings
from armid_ros.identification.rows.regression import predictions
from armid_ros.identification.rows.signals import conditioning
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
from armid_ros.robots.geometry import combined_mesh_note, LinkShape, shapes_of, sticks
from armid_ros.robots.meshes import load_mesh
import numpy as np
from scipy.spatial.transform import Rotation

TIMELINE = 'time'
#: Address of the viewer; by default, rerun would listen on all interfaces.
_HOST, _PORT = '127.0.0.1', 9876


def rerun() -> ModuleType:
    """Import and return the module `rerun`; ArmidError if this viewer is not installed."""
    try:
        import rerun
    except ImportError:
        raise ArmidError(
            'the view of recordings needs rerun-sdk, which is not installed; it comes with the '
            "extra 'view': pip install 'armid_ros[view]', or pip install rerun-sdk"
        ) from None
    module: ModuleType = rerun
    return module


def open_stream(name: str, out: Path | None = None) -> Any:
    """
    Open a rerun window or a file that accepts the data of a recording.

    Parameters
    ----------
    name : str
        Name of the recording.
    out : Path, optional
        File to write, .rrd; a window by default.

    Returns
    -------
    rerun.RecordingStream

    Raises
    ------
    ArmidError
        If there is no screen for a window.

    """
    rr = rerun()
    # a window needs a display server on Linux
    screen = os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')
    if out is None and sys.platform.startswith('linux') and not screen:
        raise ArmidError('no screen for a window was found; write a file with --out run.rrd')
    stream = rr.RecordingStream('armid', recording_id=None)
    stream.send_recording_name(name)
    if out is None:
        stream.connect_grpc(_started_viewer())
    else:
        stream.save(out)
    return stream


def _started_viewer() -> str:
    """Return the URL of a rerun viewer on this machine; start the viewer if none is running."""
    command = [sys.executable, '-P', '-m', 'rerun_cli', '--expect-data-soon']
    deadline, viewer = time.monotonic() + 20.0, None
    while True:
        try:
            socket.create_connection((_HOST, _PORT), timeout=1.0).close()
            return f'rerun+http://{_HOST}:{_PORT}/proxy'
        except OSError as error:
            ended = viewer is not None and viewer.poll() is not None
            if ended or time.monotonic() > deadline:
                raise ArmidError(f'the rerun viewer does not start: {error}') from error
        if viewer is None:
            viewer = subprocess.Popen(
                [*command, '--bind', _HOST, '--port', str(_PORT)], start_new_session=True
            )
        time.sleep(0.1)


def log_recording(
    stream: Any, arm: ArmModel, recording: Recording, marked: Sequence[str] = ()
) -> list[str]:
    """
    Send the moving arm and curves to rerun; return notes on links that are not drawn.

    Parameters
    ----------
    stream : rerun.RecordingStream
        Stream to which the recording is logged.
    arm : ArmModel
        The model.
    recording : Recording
        The recording; torque is predicted if the recording has torque.
    marked : sequence of str
        Joints to colour.

    """
    rr, robot = rerun(), arm.robot
    notes = _log_bodies(stream, robot, marked)
    wanted = max(1, int(30.0 * recording.duration))  # poses, 30 in a second
    poses = recording.select(slice(None, None, max(1, len(recording) // wanted)))
    frames = ArmModel(robot).link_frames(Motion.of_states(robot.joints, poses.q, 0.0, 0.0)).frames
    curves = [('position/{}', recording.t, recording.q)]
    if recording.dq is not None:
        curves.append(('velocity/{}', recording.t, recording.dq))
    if recording.tau is not None:  # measured and predicted torque with the same filter
        fits = predictions(arm, [recording], conditioning([recording], SignalSettings()))
        times = np.concatenate([fit.motion.t for fit in fits])
        for entity, name in (
            ('torque/{}/measured', 'tau'),
            ('torque/{}/predicted', 'predicted'),
            ('residual/{}', 'residual'),
        ):
            curves.append((entity, times, np.concatenate([getattr(fit, name) for fit in fits])))
    for j, joint in enumerate(robot.moving):
        turns = Rotation.from_matrix(frames[j].rotation.transpose(2, 0, 1)).as_quat()
        moved = rr.Transform3D.columns(translation=frames[j].origin.T, quaternion=turns)
        stream.send_columns(f'arm/{_escaped(joint)}', [_times(poses.t)], moved)
    for j, joint in enumerate(robot.joints):
        for entity, at, values in curves:
            column = rr.Scalars.columns(scalars=values[:, j])
            stream.send_columns(entity.format(_escaped(joint)), [_times(at)], column)
        for entity, name, colour in (
            ('torque/{}/measured', 'measured', (140, 145, 150)),
            ('torque/{}/predicted', 'predicted', (213, 94, 0)),
            ('residual/{}', f'residual {joint}', (0, 114, 178)),
        ):
            style = rr.SeriesLines(colors=colour, names=name)
            stream.log(entity.format(_escaped(joint)), style, static=True)
    stream.send_blueprint(_layout(robot.joints, marked))
    stream.flush()
    return notes


def _log_bodies(stream: Any, robot: Robot, marked: Sequence[str]) -> list[str]:
    """Send link shapes to rerun, or bars if there are none; return notes on links not drawn."""
    rr, drawn = rerun(), 0
    notes: list[str] = []
    absent: list[str] = []
    grey, red = (175, 182, 190), (230, 60, 40)
    stream.log('arm', rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def place(joint: int) -> tuple[str, tuple[int, int, int]]:
        if joint == 0:
            return 'arm/base', grey
        name = robot.moving[joint - 1]
        return f'arm/{_escaped(name)}', red if name in marked else grey

    for shape in shapes_of(robot, 'visual', 'collision'):
        where, colour = place(int(robot.model.frames[shape.frame].parentJoint))
        if shape.kind == 'mesh' and shape.path is None:
            absent.append(f"link '{shape.link}': mesh {shape.mesh} not found; not drawn")
            continue
        try:
            drawing = _entity(shape, colour)
        except RobotError as error:
            notes.append(f"link '{shape.link}': {error}; not drawn")
            continue
        entity = f'{where}/{_escaped(shape.link)}_{shape.number}'
        turn = Rotation.from_matrix(np.array(shape.placement.rotation)).as_quat()
        pose = rr.Transform3D(
            translation=np.array(shape.placement.translation),
            quaternion=rr.Quaternion(xyzw=turn),
            scale=shape.size if shape.kind == 'mesh' else None,
        )
        stream.log(entity, pose, static=True)
        stream.log(entity, drawing, static=True)
        drawn += 1
    for joint, end in [] if drawn else sticks(robot.model):
        where, colour = place(joint)
        bar = rr.LineStrips3D([[np.zeros(3), end]], radii=0.02, colors=colour)
        stream.log(f'{where}/bar', bar, static=True)
    return [*combined_mesh_note(absent), *notes]


def _entity(shape: LinkShape, colour: tuple[int, int, int]) -> Any:
    """Convert the shape of a link to an entity of rerun; RobotError if the mesh is invalid."""
    rr = rerun()
    if shape.path is not None:
        load_mesh(shape.path, np.ones(3))  # the viewer ignores invalid meshes without a message
        return rr.Asset3D(path=shape.path, albedo_factor=colour)
    look = {'colors': colour, 'fill_mode': 'solid'}
    if shape.kind == 'box':
        return rr.Boxes3D(sizes=[shape.size], **look)
    if shape.kind == 'sphere':
        return rr.Ellipsoids3D(radii=shape.size, **look)
    radius, length = shape.size
    if shape.kind == 'cylinder':
        return rr.Cylinders3D(lengths=length, radii=radius, **look)
    begin = [[0.0, 0.0, -0.5 * length]]
    return rr.Capsules3D(lengths=length, radii=radius, translations=begin, **look)


def _layout(joints: Sequence[str], marked: Sequence[str]) -> Any:
    """Return the layout of the rerun window: the arm, and a tab of curves for each joint."""
    import rerun.blueprint as layout

    def plots(kind: str, names: Sequence[str]) -> list[Any]:
        return [
            layout.TimeSeriesView(
                origin=f'{kind}/{_escaped(joint)}',
                name=joint,
                plot_legend=layout.PlotLegend(visible=number == 0),  # the same in all views
            )
            for number, joint in enumerate(names)
        ]

    first = [*marked, *(joint for joint in joints if joint not in marked)]
    units = {'torque': 'N m', 'residual': 'N m', 'position': 'rad', 'velocity': 'rad/s'}
    tabs = layout.Tabs(
        *(
            layout.Vertical(*plots(kind, first), name=f'{kind} [{unit}]')
            for kind, unit in units.items()
        )
    )
    arm = layout.Spatial3DView(origin='arm', name='arm')
    return layout.Blueprint(layout.Horizontal(arm, tabs), collapse_panels=True)


def _escaped(name: str) -> str:
    """Escape the name of a joint or link for use in the path of a rerun entity."""
    return str(rerun().escape_entity_path_part(name))


def _times(t: FloatArray) -> Any:
    """Return the time column for rerun: dates if times count from 1970, else durations."""
    kind = 'timestamp' if t[0] > 1e8 else 'duration'  # 1e8 s after 1970 is 1973
    return rerun().TimeColumn(TIMELINE, **{kind: t})
