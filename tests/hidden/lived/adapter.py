# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of arms that have lived, as the package under test takes them."""

from __future__ import annotations

from armid_ros.recording import Recording
from armid_ros.robots import load_robot, Robot

from tests.hidden.lived.cases import LivedCase, LivedRecording


def recording_of(lived: LivedRecording) -> Recording:
    """Return a recording as the package has it."""
    return Recording(
        joints=lived.joints,
        t=lived.t,
        q=lived.q,
        dq=lived.dq,
        tau=lived.tau,
        start_ns=1_700_000_000_000_000_000,
    )


def robot_of(case: LivedCase) -> Robot:
    """Return the arm as its engineer describes it, standing on the floor."""
    return load_robot(str(case.urdf), gravity='earth')
