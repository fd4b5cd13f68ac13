# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The version of the package, as package.xml has it."""

__version__ = '0.1.0'
