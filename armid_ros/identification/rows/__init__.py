# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From recordings to rows that a model can be fitted to."""
