# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The residual is drawn where the joints are, as large and as red as it is."""

from __future__ import annotations

from armid_msgs.msg import Diagnosis
from armid_ros.nodes.qos import LATCHED
from armid_ros.robots import load_robot
from armid_ros.view.nodes.residual_markers import ResidualMarkersNode
import numpy as np
import pinocchio as pin
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray

from tests.ros.controller import stamp_of

ROBOT = load_robot('humanoid_arm')
Q = 0.4 * np.ones(ROBOT.n_joints)


def state(t, **parts):
    message = JointState(name=list(ROBOT.joints), **parts)
    message.header.stamp = stamp_of(t)
    return message


@pytest.fixture
def drawn(bench):
    """Return what draws an arm at Q with torques of 10 N m and residuals."""
    node = bench.add(ResidualMarkersNode)
    out = bench.listen(MarkerArray, 'residual_markers/markers')
    latched = bench.matched_publisher(String, 'robot_description', LATCHED)
    states = bench.probe.create_publisher(JointState, 'joint_states', 10)
    bench.spin_until(states.get_subscription_count, 'joint_states')
    residuals = bench.matched_publisher(JointState, 'online_identifier/residual')
    latched.publish(String(data=ROBOT.urdf))
    bench.settle()

    def draw(residual):
        for k in range(15):
            states.publish(state(1.0 + 0.1 * k, position=Q.tolist(), effort=[10.0] * 6))
            residuals.publish(state(1.0 + 0.1 * k, effort=list(residual)))
            bench.settle()
        out.clear()
        node.draw()
        bench.spin_until(lambda: out, 'the markers')
        return node, out[-1].markers

    return draw


def of(markers, space):
    return [marker for marker in markers if marker.ns == space]


def array(point):
    return np.array([point.x, point.y, point.z])


def test_spheres_are_at_the_joints_and_arrows_along_their_axes_as_long_as_the_residual(drawn):
    node, markers = drawn([2.0, -1.0, 0.5, 0.0, 0.0, 0.0])
    assert {marker.header.frame_id for marker in markers} == {ROBOT.base}
    assert len({(marker.ns, marker.id) for marker in markers}) == len(markers)
    data = ROBOT.model.createData()
    jacobian = pin.computeJointJacobians(ROBOT.model, data, Q)
    lengths, reds = [], []
    for j, (ball, arrow) in enumerate(
        zip(of(markers, 'share'), of(markers, 'residual'), strict=True)
    ):
        place = data.oMi[j + 1].translation
        np.testing.assert_allclose(array(ball.pose.position), place, atol=1e-9)
        reds.append(ball.color.r)
        assert arrow.type == Marker.ARROW
        begin, end = map(array, arrow.points)
        lengths.append((end - begin) @ jacobian[3:, j])
        np.testing.assert_allclose(np.cross(end - begin, jacobian[3:, j]), 0.0, atol=1e-9)
    assert len(lengths) == ROBOT.n_joints and lengths[0] > 0.0
    np.testing.assert_allclose(np.array(lengths) / lengths[0], [1, -0.5, 0.25, 0, 0, 0], atol=0.02)
    np.testing.assert_allclose(reds[:4], [1.0, 0.5, 0.25, 0.0], atol=0.02)  # red from 20 % on
    first, *_ = (text.text for text in of(markers, 'joint'))
    assert ROBOT.joints[0] in first and '20 %' in first
    (share,) = (v for k, v in node.condition()[1].items() if k.endswith(ROBOT.joints[1]))
    assert share == pytest.approx(0.1, rel=0.02)


def test_the_diagnosis_is_text_above_the_base(bench, drawn):
    sender = bench.matched_publisher(Diagnosis, 'live_diagnosis/diagnosis', LATCHED)
    sender.publish(Diagnosis(verdict='not_repeatable', summary='the torque differs ' * 8))
    _, markers = drawn([0.0] * 6)
    (text,) = of(markers, 'diagnosis')
    assert 'not repeatable' in text.text and 'torque' in text.text
    assert '\n' in text.text
    assert text.pose.position.z > 0.0
