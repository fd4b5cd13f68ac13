# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the bodies of an arm are, and how far from each other and from obstacles."""
