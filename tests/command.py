# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Commands that are called in the process of a test."""

from armid_ros.errors import ArmidError
from click.testing import CliRunner


def run_command(command, *arguments):
    """Run a command; return its output, or raise the error that it reports."""
    done = CliRunner().invoke(command, [str(part) for part in arguments])
    if isinstance(done.exception, ArmidError):
        raise done.exception
    assert done.exit_code == 0, done.output
    return done.stdout
