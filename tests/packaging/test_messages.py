# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The compiled messages are installed, and keep their values through serialisation."""

import importlib.util
import sys

import pytest
from rclpy.serialization import deserialize_message, serialize_message

armid_msgs = pytest.importorskip('armid_msgs.msg', reason='armid_msgs is not compiled: run make')


def test_every_field_of_an_estimate_survives_the_wire():
    estimate = armid_msgs.ParameterEstimate(
        name=['Izz1 + Iyy2', 'viscous_coefficient'],
        joint=['shoulder', 'elbow'],
        unit=['kg m^2', 'N m s/rad'],
        value=[0.25, -1e-300],
        std_dev=[0.5, float('inf')],
        samples=2**63,
        condition_number=112.9,
    )
    estimate.header.stamp.sec = 7
    wire = serialize_message(estimate)
    assert deserialize_message(wire, armid_msgs.ParameterEstimate) == estimate


def test_without_ros_it_is_said_what_comes_first(root, tmp_path, monkeypatch):
    path = root / 'msg_schemas' / 'wheel_of_messages.py'
    spec = importlib.util.spec_from_file_location('wheel_of_messages', path)
    backend = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(backend)
    monkeypatch.setattr(sys, 'prefix', str(tmp_path))
    with pytest.raises(SystemExit, match=r'armid_ros\[ros\]'):
        backend.build_wheel(str(tmp_path))
    assert not list(tmp_path.iterdir())
