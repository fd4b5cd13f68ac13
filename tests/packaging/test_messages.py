# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The compiled messages travel between processes."""

from importlib import metadata
import importlib.util
from pathlib import Path
import subprocess
import sys
import time

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile

armid_msgs = pytest.importorskip('armid_msgs.msg', reason='armid_msgs is not compiled: run make')

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PUBLISHER = """
import sys
from armid_msgs.msg import ParameterEstimate
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
rclpy.init()
node = rclpy.create_node('publisher')
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
estimate = ParameterEstimate(
    name=['Izz1 + Iyy2', 'viscous_coefficient'],
    joint=['shoulder', 'elbow'],
    unit=['kg m^2', 'N m s/rad'],
    value=[0.25, -1e-300],
    std_dev=[0.5, float('inf')],
    samples=2**63,
    condition_number=112.9,
)
estimate.header.stamp.sec = 7
node.create_publisher(ParameterEstimate, 'estimate', latched).publish(estimate)
sys.stdin.read()
"""


def test_estimate_arrives_from_another_process():
    """Every field, over DDS, to a subscriber that came late."""
    command = [sys.executable, '-c', PUBLISHER]
    publisher = subprocess.Popen(command, stdin=subprocess.PIPE)
    received = []
    context = rclpy.Context()
    rclpy.init(context=context)
    with publisher:
        node = rclpy.create_node('subscriber', context=context)
        node.create_subscription(
            armid_msgs.ParameterEstimate, 'estimate', received.append, LATCHED
        )
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        deadline = time.monotonic() + 30.0
        while not received and publisher.poll() is None and time.monotonic() < deadline:
            executor.spin_once(timeout_sec=0.1)
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)
        publisher.stdin.close()
    (estimate,) = received
    assert estimate.header.stamp.sec == 7
    assert estimate.name == ['Izz1 + Iyy2', 'viscous_coefficient']
    assert estimate.joint == ['shoulder', 'elbow']
    assert estimate.unit == ['kg m^2', 'N m s/rad']
    assert list(estimate.value) == [0.25, -1e-300]
    assert list(estimate.std_dev) == [0.5, float('inf')]
    assert estimate.samples == 2**63
    assert estimate.condition_number == 112.9


def test_pip_put_them_where_python_and_ros_look():
    """And knows which files they are, so that it can take them away."""
    files = {path.locate().resolve() for path in metadata.files('armid_msgs')}
    prefix = Path(sys.prefix).resolve()
    index = prefix / 'share' / 'ament_index' / 'resource_index'
    assert index / 'packages' / 'armid_msgs' in files
    assert index / 'rosidl_interfaces' / 'armid_msgs' in files
    assert prefix / 'lib' / 'libarmid_msgs__rosidl_typesupport_c.so' in files
    assert Path(armid_msgs.__file__).resolve() in files


def test_without_ros_it_is_said_what_comes_first(root, tmp_path, monkeypatch):
    path = root / 'msg_schemas' / 'wheel_of_messages.py'
    spec = importlib.util.spec_from_file_location('wheel_of_messages', path)
    backend = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(backend)
    monkeypatch.setattr(sys, 'prefix', str(tmp_path))
    with pytest.raises(SystemExit, match=r'armid_ros\[ros\]'):
        backend.build_wheel(str(tmp_path))
    assert not list(tmp_path.iterdir())
