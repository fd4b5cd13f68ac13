# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Springs of the pair: online, with slack, and the poses that show them best."""
