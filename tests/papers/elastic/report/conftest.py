# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The browser that looks at pages."""

from tests.report.conftest import browser, charts_drawn

__all__ = ['browser', 'charts_drawn']
