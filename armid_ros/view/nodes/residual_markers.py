# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The residual markers node: draws the residual of each joint on the arm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
import textwrap
from typing import Any

from armid_msgs.msg import Diagnosis
from armid_ros import ArmModel, load_robot, Robot
from armid_ros.motion import FloatArray, Motion
from armid_ros.nodes.listening import ListeningNode
from armid_ros.nodes.messages.joint_states import JointSample
from armid_ros.nodes.parameters.table import NodeParameter
from armid_ros.nodes.qos import DEPTH, LATCHED, STREAM
from armid_ros.nodes.running.process import run
from armid_ros.robots import robot_from_urdf
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point
import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

#: Sizes of shafts and letters, as shares of the reach of the arm.
_SHAFT, _LETTER = 0.015, 0.05


class ResidualMarkersNode(ListeningNode):
    """
    Node that draws the online residual torque at each joint, for RViz and Foxglove.

    At each joint, the length of an arrow along the axis shows the present residual. The colour of
    a sphere shows the ratio of residual to torque, as root mean squares over two seconds. The
    sphere is green for zero, and red from `full` on. A text shows residual and ratio. A text above
    the base shows the diagnosis of live_diagnosis. Positions are computed from joint_states; no
    transforms are needed.

    """

    table = (
        NodeParameter('robot', '', 'Name or path; empty: robot_description.'),
        NodeParameter('joints', [''], 'Driven joints; without names, all but those of grippers.'),
        NodeParameter(
            'frame', '', 'Frame of the markers; empty: the base link of the description.'
        ),
        NodeParameter('rate', 20.0, 'Publishing rate of ~/markers.', 'Hz', limits=(0.1, 100.0)),
        NodeParameter(
            'full',
            0.2,
            'Ratio of residual to torque (root mean squares) from which a joint is red.',
            limits=(0.001, 10.0),
            read_only=False,
        ),
    )

    def __init__(self, **kwargs: Any) -> None:
        """Create the node; keyword arguments are those of rclpy's Node."""
        super().__init__('residual_markers', **kwargs)
        self._summary = ''
        self._markers = self.create_publisher(MarkerArray, '~/markers', STREAM)
        if self.value('robot'):
            self._draw_on(load_robot(self.value('robot'), joints=self.value('joints') or None))
        self.listen()
        self.create_subscription(
            JointState, 'online_identifier/residual', self._on_residual, DEPTH
        )
        self.create_subscription(
            Diagnosis, 'live_diagnosis/diagnosis', self._on_diagnosis, LATCHED
        )
        self.create_steady_timer(1.0 / self.value('rate'), self.draw)

    def condition(self) -> tuple[str, Mapping[str, object]]:
        """Return missing inputs, and the ratio of residual to measured torque of each joint."""
        if self.robot is None:
            return self.awaited, {}
        if not np.isfinite(self._q).all():
            return 'no joint states so far', {}
        shares = zip(self.robot.joints, self._shares(), strict=True)
        return '', {f'residual share {joint}': float(share) for joint, share in shares}

    def draw(self) -> None:
        """Publish the markers of all joints at the present pose of the arm."""
        if self.robot is None or not np.isfinite(self._q).all():
            return
        stamp = self.get_clock().now().to_msg()
        markers = [*self._of_joints(self.robot)]
        if self._summary:
            lines = '\n'.join(textwrap.wrap(self._summary, 60))
            above = np.array([0.0, 0.0, 1.3 * self._reach])
            markers.append(self._text('diagnosis', lines, above, 1.4))
        for number, marker in enumerate(markers):
            marker.header.frame_id, marker.header.stamp = self._frame, stamp
            marker.id = number
            marker.lifetime = Duration(sec=2)  # then markers disappear
        self._markers.publish(MarkerArray(markers=markers))

    def _of_joints(self, robot: Robot) -> Sequence[Marker]:
        pose = Motion.of_states(robot.joints, self._q, 0.0, 0.0)
        frames = ArmModel(robot).link_frames(pose).frames
        # the longest arrow, a quarter of the reach, shows twice the largest residual (rms)
        largest = max(2.0 * float(np.sqrt(self._residual.max())), 1e-9)
        lengths = 0.25 * self._reach * np.clip(self._now / largest, -1.0, 1.0)
        markers = []
        for j, (joint, share) in enumerate(zip(robot.joints, self._shares(), strict=True)):
            body = robot.body_of(joint)
            place, geometry = frames[body].origin[:, 0], robot.geometry[body]
            axis = frames[body].turned(geometry.slide + geometry.turn)[:, 0]
            red = float(np.clip(share / self.value('full'), 0.0, 1.0))
            colour = ColorRGBA(r=red, g=1.0 - red, b=0.1, a=0.9)
            arrow = _marker('residual', Marker.ARROW, colour)
            arrow.points = [_point(place), _point(place + lengths[j] * axis)]
            arrow.scale.x, arrow.scale.y = self._reach * _SHAFT, 2.0 * self._reach * _SHAFT
            ball = _marker('share', Marker.SPHERE, colour)
            ball.pose.position = _point(place)
            size = self._reach * _SHAFT * (3.0 + 3.0 * red)
            ball.scale.x = ball.scale.y = ball.scale.z = size
            unit = robot.torque_units[j]
            rms = float(np.sqrt(self._residual[j]))
            words = f'{joint} {rms:.3g} {unit}, {100.0 * share:.0f} %'
            markers += [arrow, ball, self._text('joint', words, place, 1.0)]
        return markers

    def _text(self, space: str, words: str, place: FloatArray, size: float) -> Marker:
        text = _marker(space, Marker.TEXT_VIEW_FACING, ColorRGBA(r=0.5, g=0.5, b=0.5, a=1.0))
        text.text = words
        text.pose.position = _point(place + np.array([0.0, 0.0, 1.5 * _LETTER * self._reach]))
        text.scale.z = size * _LETTER * self._reach
        return text

    def _shares(self) -> FloatArray:
        """Return the ratio of residual to measured torque of each joint, both as RMS."""
        return np.asarray(np.sqrt(self._residual / np.maximum(self._torque, 1e-12)))

    def take_description(self, urdf: str) -> None:
        """Set up the markers for the robot of a URDF text from the topic robot_description."""
        self._draw_on(robot_from_urdf(urdf, joints=self.value('joints') or None))

    def _draw_on(self, robot: Robot) -> None:
        n = robot.n_joints
        self.adopt(robot)
        self._frame = self.value('frame') or robot.base
        self._q, self._now = np.full(n, np.nan), np.zeros(n)
        self._residual, self._torque = np.zeros(n), np.zeros(n)
        self._seen = {'residual': 0.0, 'torque': 0.0}
        pose = Motion.of_states(robot.joints, np.zeros(n), 0.0, 0.0)
        frames = ArmModel(robot).link_frames(pose).frames
        places = [frames[j].origin[:, 0] for j in range(n)]
        steps = np.diff(np.vstack([np.zeros(3), *places]), axis=0)
        self._reach = max(float(np.linalg.norm(steps, axis=1).sum()), 0.1)

    def take_sample(self, sample: JointSample) -> None:
        """Store the positions of a joint state, and update the mean squares of the torques."""
        self._q = sample.q
        self._torque = self._mean_square('torque', sample.t, self._torque, sample.tau)

    def _on_residual(self, message: JointState) -> None:
        if self.robot is None or tuple(message.name) != self.robot.joints:
            return
        stamp = message.header.stamp
        self._now = np.array(message.effort)
        t = stamp.sec + 1e-9 * stamp.nanosec
        self._residual = self._mean_square('residual', t, self._residual, self._now)

    def _on_diagnosis(self, message: Diagnosis) -> None:
        self._summary = f'{message.verdict.replace("_", " ")}: {message.summary}'

    def _mean_square(
        self, signal: str, t: float, before: FloatArray, values: FloatArray
    ) -> FloatArray:
        """Return the running mean square (over 2 s) of a signal, with new values at t [s]."""
        step, self._seen[signal] = t - self._seen[signal], t
        share = 1.0 if not before.any() else float(np.clip(step / 2.0, 0.0, 1.0))
        return np.asarray(before + share * (values**2 - before))


def _marker(space: str, kind: int, colour: ColorRGBA) -> Marker:
    marker = Marker(ns=space, type=kind, action=Marker.ADD, color=colour)
    marker.pose.orientation.w = 1.0
    return marker


def _point(place: FloatArray) -> Point:
    return Point(x=float(place[0]), y=float(place[1]), z=float(place[2]))


main = partial(run, ResidualMarkersNode)
