# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Planning of a motion that separates a named effect from its rivals, and other advice."""
