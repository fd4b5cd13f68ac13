# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Diagnosis of an arm while it moves.

A `SampleWindow` keeps what came, `LiveDiagnosis` decides when to ask and which model of the
arm holds, `Assistant` answers in a process of its own. Nothing here knows ROS.

"""

from armid_ros.live.assistant import Assistant, InProcess
from armid_ros.live.belief import Belief, LiveDiagnosis, LiveSettings
from armid_ros.live.request import Answer, DiagnosisRequest
from armid_ros.live.stream_watch import StreamWatch
from armid_ros.live.window import SampleWindow

__all__ = [
    'Answer',
    'Assistant',
    'Belief',
    'InProcess',
    'LiveDiagnosis',
    'LiveSettings',
    'DiagnosisRequest',
    'SampleWindow',
    'StreamWatch',
]
