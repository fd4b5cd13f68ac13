# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The motion that separates a named effect from its rivals."""
