# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Springs between two machines, identified from the torques of one."""
