# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The version of the package, equal to that in package.xml, and the mark of its pages."""

__version__ = '0.1.0'

#: Element in the head of each page of this package.
GENERATOR = '<meta name="generator" content="armid_ros">'
