# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command line `armid`: one file per job, and one function per command."""

from armid_ros.cli.commands import main

__all__ = ['main']
