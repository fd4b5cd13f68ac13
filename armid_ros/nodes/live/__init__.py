# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Diagnosis of a moving arm, without ROS: window, schedule, requests and process."""

from armid_ros.nodes.live.assistant import Assistant, Worker
from armid_ros.nodes.live.request import Answer, DiagnosisRequest, LiveSettings
from armid_ros.nodes.live.schedule import LiveDiagnosis
from armid_ros.nodes.live.window import SampleWindow

__all__ = [
    'Answer',
    'Assistant',
    'LiveDiagnosis',
    'LiveSettings',
    'DiagnosisRequest',
    'SampleWindow',
    'Worker',
]
