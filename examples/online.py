# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identify friction from /joint_states while the arm moves, in a node of your own."""

from pathlib import Path
import sys

import armid_ros as ar
import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState

URDF = Path(__file__).with_name('arm.urdf')


class Identifier(Node):
    """Node that logs the estimated friction of each joint every second."""

    def __init__(self, urdf=URDF, **settings):
        super().__init__('identifier', **settings)
        self.arm = ar.ArmModel.of(urdf, effects='viscous_friction,coulomb_friction')
        self.online = ar.OnlineIdentifier(self.arm, rng=np.random.default_rng(0))
        self.create_subscription(JointState, 'joint_states', self.on_joint_states, 100)
        self.create_timer(1.0, self.tell)

    def on_joint_states(self, message):
        """Update the estimate by a joint state, whose joints may have any order."""
        order = [message.name.index(joint) for joint in self.arm.robot.joints]
        q, tau = np.array(message.position)[order], np.array(message.effort)[order]
        stamp = message.header.stamp
        self.online.update(stamp.sec + 1e-9 * stamp.nanosec, q, None, tau)

    def tell(self):
        """Log the present estimate of the friction."""
        estimate = self.online.estimate()
        for name, value, std in zip(
            estimate.parameters, estimate.values, estimate.std, strict=True
        ):
            if not name.rigid:
                self.get_logger().info(f'{name.name} {name.joint} {value:.3f} ± {std:.3f}')


if __name__ == '__main__':
    rclpy.init(args=sys.argv)
    rclpy.spin(Identifier())
