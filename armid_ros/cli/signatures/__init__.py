# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What each command can be asked, and its help: none of it imports what computes."""
