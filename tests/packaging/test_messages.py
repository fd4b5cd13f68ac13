# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The wheel of messages states what it needs."""

import importlib.util
import sys

import pytest


def test_without_ros_it_is_said_what_comes_first(root, tmp_path, monkeypatch):
    path = root / 'msg_schemas' / 'wheel_of_messages.py'
    spec = importlib.util.spec_from_file_location('wheel_of_messages', path)
    backend = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(backend)
    monkeypatch.setattr(sys, 'prefix', str(tmp_path))
    with pytest.raises(SystemExit, match=r'armid_ros\[ros\]'):
        backend.build_wheel(str(tmp_path))
    assert not list(tmp_path.iterdir())
