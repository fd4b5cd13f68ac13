# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Diagnosis of the effects that a model lacks, and of the joints with a gap.

``diagnose`` names the missing effects, ``diagnosis_document`` returns the result as a document,
``next_run`` plans the motion that separates two names, ``known_misfit`` measures the misfit of a
model for later diagnoses.

"""

from armid_ros.diagnosis.data.baseline import known_misfit
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
    'known_misfit',
    'next_run',
]
