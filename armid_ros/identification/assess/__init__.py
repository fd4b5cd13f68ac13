# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Assessment of an identification, and comparison of two."""
