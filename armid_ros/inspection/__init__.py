# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Inspection of a recording: contents, faults, and suitability for identification.

Inspection does not change the data; curves show the unchanged signals of the file.

"""

from armid_ros.inspection.description_check import check_links, description_remarks, LinkCheck
from armid_ros.inspection.inspect import inspect, Inspection, inspection_document, Remark

__all__ = [
    'Inspection',
    'LinkCheck',
    'Remark',
    'check_links',
    'description_remarks',
    'inspect',
    'inspection_document',
]
