# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`python -m armid_ros.cli` is `armid`."""

from armid_ros.cli import main

main()
