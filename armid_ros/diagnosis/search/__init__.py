# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which causes explain a gap: every cause alone on held-out data, the best first."""
