# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From an explanation to shares of the gap, a verdict, a sentence and a document."""
