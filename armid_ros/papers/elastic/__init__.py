# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arms with elastic joints: simulated, identified and reported."""
