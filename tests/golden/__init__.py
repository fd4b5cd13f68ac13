# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What each command answers, kept as facts; `python -m tests.golden` writes them anew."""
