# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Inspection: what a recording holds, what is odd about it, and whether a model can be fitted to it.

Nothing is changed and nothing is hidden: the curves are those of the file.

"""

from armid_ros.inspection.description_check import check_links, description_remarks, LinkCheck
from armid_ros.inspection.inspect import inspect, Inspection, Remark
from armid_ros.inspection.joints import JointFacts
from armid_ros.inspection.output import inspection_document
from armid_ros.inspection.sampling import Sampling
from armid_ros.inspection.trial import TrialFit

__all__ = [
    'Inspection',
    'JointFacts',
    'LinkCheck',
    'Remark',
    'Sampling',
    'TrialFit',
    'check_links',
    'description_remarks',
    'inspect',
    'inspection_document',
]
