# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The version of the package; equal to that in package.xml."""

__version__ = '0.1.0'
