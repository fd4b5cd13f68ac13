# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What an identification is worth, and what differs between two."""
