# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which causes explain a gap: comparison of all candidates, with priors and rivals."""
