# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Completion of commands and options in a shell."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class


@click.command(epilog='Example: armid completion bash >> ~/.bashrc')
@click.argument('shell', type=click.Choice(['bash', 'zsh', 'fish']))
def completion(shell: str) -> None:
    """
    Print what makes a shell complete commands and options.

    For one shell: eval "$(armid completion bash)", the same with zsh; armid completion fish |
    source. To keep it, append what is printed to ~/.bashrc or ~/.zshrc, or write it to
    ~/.config/fish/completions/armid.fish.

    """
    kind = get_completion_class(shell)
    root = click.get_current_context().find_root().command
    assert kind is not None
    click.echo(kind(root, {}, 'armid', '_ARMID_COMPLETE').source())
