# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Search for the causes of a gap: comparison of all candidates, with priors and rivals."""
