# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Speed and accuracy, measured side by side with the peers in one run."""
