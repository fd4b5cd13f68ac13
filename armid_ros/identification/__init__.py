# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Identification of models with uncertainties from recordings.

``identify`` works offline on whole recordings; ``online`` updates an estimate sample by sample.

"""

from armid_ros.identification.assess.grade import Grade, grade
from armid_ros.identification.assess.verification import Verification, verify
from armid_ros.identification.identify import Identification, IdentificationSettings, identify
from armid_ros.identification.output import identification_document, write_document
from armid_ros.identification.physical.fit_among_bodies import (
    PhysicalCertificate,
    PhysicalSettings,
)
from armid_ros.identification.rows.regression import Fit, Score
from armid_ros.identification.rows.signals import Conditioning, SignalSettings

__all__ = [
    'Conditioning',
    'Fit',
    'Grade',
    'Identification',
    'IdentificationSettings',
    'PhysicalCertificate',
    'PhysicalSettings',
    'Score',
    'SignalSettings',
    'Verification',
    'grade',
    'identification_document',
    'identify',
    'verify',
    'write_document',
]
