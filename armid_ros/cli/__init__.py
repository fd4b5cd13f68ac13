# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid`: one file a job, one function a command; what computes is in the packages."""

from armid_ros.cli.commands import main

__all__ = ['main']
