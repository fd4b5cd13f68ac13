# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Identification: recordings in, models with uncertainties out.

``identify`` works offline on whole recordings; ``online`` learns sample by sample.

"""

from armid_ros.identification.identify import (
    Fit,
    Identification,
    IdentificationSettings,
    identify,
    Score,
)
from armid_ros.identification.output import identification_document
from armid_ros.identification.physical import PhysicalCertificate, PhysicalSettings
from armid_ros.identification.signals import Conditioning, SignalSettings

__all__ = [
    'Conditioning',
    'Fit',
    'Identification',
    'IdentificationSettings',
    'PhysicalCertificate',
    'PhysicalSettings',
    'Score',
    'SignalSettings',
    'identification_document',
    'identify',
]
