# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Style and saving of figure files: matplotlib, without a display and without global state."""
