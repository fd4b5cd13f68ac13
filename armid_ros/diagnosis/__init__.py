# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Diagnosis: where model and measurement disagree, and which effect is missing.

``diagnose`` looks, ``diagnosis_document`` writes down what it found, ``next_run`` says what to run
to tell two names apart.

"""

from armid_ros.diagnosis.diagnose import diagnose
from armid_ros.diagnosis.next_run.plan import EXPERIMENT_FILE, next_run, NextRun
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.verdict.document import diagnosis_document
from armid_ros.diagnosis.verdict.finding import Diagnosis, Finding

__all__ = [
    'Diagnosis',
    'DiagnosisSettings',
    'EXPERIMENT_FILE',
    'Finding',
    'NextRun',
    'diagnose',
    'diagnosis_document',
    'next_run',
]
