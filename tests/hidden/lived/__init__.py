# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arms that have lived: two days, clutter on both, and one cause or none between them."""
