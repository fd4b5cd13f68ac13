# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Program of `python -m armid_ros.cli`, which is the command `armid`."""

from armid_ros.cli import main

main()
