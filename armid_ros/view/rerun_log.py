# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A scene in rerun: curves and arm on one time line, in a window or in a file.

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

from armid_ros.errors import ArmidError
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
from armid_ros.view.bodies import Body
from armid_ros.view.scene import Scene
import numpy as np
from scipy.spatial.transform import Rotation

TIMELINE = 'time'
#: Where a viewer listens: rerun's own way to start one binds it to all interfaces.
_HOST, _PORT = '127.0.0.1', 9876
#: How long a viewer may take to listen, and how often is tried [s].
_PATIENCE, _TRY_EVERY = 20.0, 0.1
#: Colours: of what was measured, predicted, left, of links, and of what is marked.
_MEASURED, _PREDICTED, _RESIDUAL = (140, 145, 150), (213, 94, 0), (0, 114, 178)
#: Later than any recording begins that counts from its own start [s].
_SINCE_1970 = 1e8
_LINK, _MARKED = (175, 182, 190), (230, 60, 40)


def rerun() -> ModuleType:
    """
    Return the module rerun.

    Raises
    ------
    ArmidError
        If it is not installed.

    """
    try:
        import rerun
    except ImportError:
        raise ArmidError(
            'looking at recordings needs rerun-sdk, which is not installed; it comes with the '
            "extra 'view': pip install 'armid_ros[view]', or pip install rerun-sdk"
        ) from None
    module: ModuleType = rerun
    return module


def _has_screen() -> bool:
    """Return whether a window can be opened: on Linux a display server has to be named."""
    if not sys.platform.startswith('linux'):
        return True
    return bool(os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY'))


def open_stream(name: str, out: Path | None = None) -> Any:
    """
    Open a window, or a file, for what is logged.

    Parameters
    ----------
    name : str
        Of the recording.
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
    if out is None and not _has_screen():
        raise ArmidError('there is no screen for a window; --out run.rrd writes a file instead')
    stream = rr.RecordingStream('armid', recording_id=None)
    stream.send_recording_name(name)
    if out is None:
        stream.connect_grpc(_started_viewer())
    else:
        stream.save(out)
    return stream


def _started_viewer() -> str:
    """Start a viewer that this machine alone can reach, unless one listens; return its URL."""
    command = [sys.executable, '-P', '-m', 'rerun_cli', '--expect-data-soon']
    deadline, viewer = time.monotonic() + _PATIENCE, None
    while True:
        try:
            socket.create_connection((_HOST, _PORT), timeout=1.0).close()
            return f'rerun+http://{_HOST}:{_PORT}/proxy'
        except OSError as error:
            ended = viewer is not None and viewer.poll() is not None
            if ended or time.monotonic() > deadline:
                raise ArmidError(f'the viewer of rerun does not start: {error}') from error
        if viewer is None:
            viewer = subprocess.Popen(
                [*command, '--bind', _HOST, '--port', str(_PORT)], start_new_session=True
            )
        time.sleep(_TRY_EVERY)


def log_scene(scene: Scene, stream: Any) -> None:
    """Log arm and curves, and the layout of the window."""
    rr = rerun()
    joints = scene.robot.joints
    log_arm(scene.robot, scene.bodies, scene.marked, stream)
    for j, joint in enumerate(joints):
        poses = rr.Transform3D.columns(
            translation=scene.translations[:, j],
            quaternion=Rotation.from_matrix(scene.rotations[:, j]).as_quat(),
        )
        stream.send_columns(f'arm/{part(joint)}', [_times(rr, scene.pose_t)], poses)
        for name, values in (('position', scene.recording.q), ('velocity', scene.recording.dq)):
            if values is not None:
                _curve(rr, stream, f'{name}/{part(joint)}', scene.recording.t, values[:, j])
        for entity, values in (
            (f'torque/{part(joint)}/measured', scene.measured),
            (f'torque/{part(joint)}/predicted', scene.predicted),
            (f'residual/{part(joint)}', scene.residual),
        ):
            _curve(rr, stream, entity, scene.t, values[:, j])
    style_curves(joints, stream)
    stream.send_blueprint(shown(joints, scene.marked))
    stream.flush()


def log_arm(robot: Robot, pieces: Sequence[Body], marked: Sequence[str], stream: Any) -> None:
    """Log what the arm looks like, each piece below the joint that carries it."""
    rr = rerun()
    stream.log('arm', rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for number, piece in enumerate(pieces):
        joint = robot.joints[piece.joint] if piece.joint >= 0 else ''
        corners = piece.corners.reshape(-1, 3)
        mesh = rr.Mesh3D(
            vertex_positions=corners,
            triangle_indices=np.arange(len(corners)).reshape(-1, 3),
            vertex_normals=np.repeat(_normals(piece.corners), 3, axis=0),
            albedo_factor=_MARKED if joint in marked else _LINK,
        )
        where = f'arm/{part(joint)}' if joint else 'arm/base'
        stream.log(f'{where}/{part(piece.link)}_{number}', mesh, static=True)


def style_curves(joints: Sequence[str], stream: Any) -> None:
    """Give curves their names and colours, the same in every plot."""
    rr = rerun()
    for joint in joints:
        for entity, name, colour in (
            (f'torque/{part(joint)}/measured', 'measured', _MEASURED),
            (f'torque/{part(joint)}/predicted', 'predicted', _PREDICTED),
            (f'residual/{part(joint)}', f'residual {joint}', _RESIDUAL),
        ):
            stream.log(entity, rr.SeriesLines(colors=colour, names=name), static=True)


def shown(joints: Sequence[str], marked: Sequence[str] = ()) -> Any:
    """Return the layout of the window: the arm, torques of each joint, residuals, positions."""
    rerun()
    import rerun.blueprint as layout

    def plots(kind: str, names: Sequence[str]) -> list[Any]:
        return [
            layout.TimeSeriesView(
                origin=f'{kind}/{part(joint)}',
                name=joint,
                plot_legend=layout.PlotLegend(visible=number == 0),  # the same in all
            )
            for number, joint in enumerate(names)
        ]

    first = [*marked, *(joint for joint in joints if joint not in marked)]
    tabs = layout.Tabs(
        *(
            layout.Vertical(*plots(kind, first), name=f'{kind} [{unit}]')
            for kind, unit in (
                ('torque', 'N m'),
                ('residual', 'N m'),
                ('position', 'rad'),
                ('velocity', 'rad/s'),
            )
        )
    )
    arm = layout.Spatial3DView(origin='arm', name='arm')
    return layout.Blueprint(layout.Horizontal(arm, tabs), collapse_panels=True)


def part(name: str) -> str:
    """Return a name as part of an entity's path."""
    return str(rerun().escape_entity_path_part(name))


def _curve(rr: Any, stream: Any, entity: str, t: FloatArray, values: FloatArray) -> None:
    known = np.isfinite(values)
    if known.any():
        columns = rr.Scalars.columns(scalars=values[known])
        stream.send_columns(entity, [_times(rr, t[known])], columns)


def _times(rr: Any, t: FloatArray) -> Any:
    """Return times as dates where they are seconds since 1970."""
    kind = 'timestamp' if t[0] > _SINCE_1970 else 'duration'
    return rr.TimeColumn(TIMELINE, **{kind: t})


def _normals(corners: FloatArray) -> FloatArray:
    """Return the unit normal of every triangle, shape (T, 3)."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30))
