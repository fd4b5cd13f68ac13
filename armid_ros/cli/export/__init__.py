# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Export of an identified arm to formats of other programs: ``armid export``.

Formats are code of the joint torque, load data, ranges of parameters, and simulator models.

"""
