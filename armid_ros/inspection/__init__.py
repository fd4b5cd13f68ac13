# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Inspection: what a recording holds, what is odd about it, and whether a model can be fitted to it.

Nothing is changed and nothing is hidden: the curves are those of the file.

"""

from armid_ros.inspection.description_check import check_links, description_remarks, LinkCheck
from armid_ros.inspection.inspect import inspect, Inspection, inspection_document, Remark
from armid_ros.inspection.sampling import Sampling

__all__ = [
    'Inspection',
    'LinkCheck',
    'Remark',
    'Sampling',
    'check_links',
    'description_remarks',
    'inspect',
    'inspection_document',
]
