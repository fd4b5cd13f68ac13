# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Version of the package, as in package.xml, and the HTML element that marks its pages."""

__version__ = '0.1.0'

#: Element in the head of each HTML page that this package writes.
GENERATOR = '<meta name="generator" content="armid_ros">'
