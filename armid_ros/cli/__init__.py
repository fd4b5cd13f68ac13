# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid`: one file per job, one function per command; the packages compute."""

from armid_ros.cli.commands import main

__all__ = ['main']
