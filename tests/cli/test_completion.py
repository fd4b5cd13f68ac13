# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Shells complete commands and options, without waiting for all of the package."""

from armid_ros.cli import main
from click.shell_completion import ShellComplete
import pytest


def completed(*words):
    """Return what completes the last word."""
    shell = ShellComplete(main, {}, 'armid', '_ARMID_COMPLETE')
    return [item.value for item in shell.get_completions(list(words[:-1]), words[-1])]


def test_commands_and_options_are_completed():
    assert completed('id') == ['identify']
    assert {'robots', 'recover'} <= set(completed('r'))
    assert completed('identify', '--effects') == ['--effects']
    assert '--version' in completed('--v')


def test_values_are_completed():
    assert 'humanoid_arm' in completed('identify', '--robot', 'hum')
    assert completed('identify', '--effects', 'viscous_friction,stribeck') == [
        'viscous_friction,stribeck_friction'
    ]


@pytest.mark.parametrize(
    ('words', 'found'),
    [
        (['simulate', '--effect', 'stri'], ['stribeck_friction']),
        (['excite', '--effect', 'stri'], ['stribeck_friction']),
        (['demo', '--hide', 'stri'], ['stribeck_friction']),
        (['diagnose', '--prior', 'stri'], ['stribeck_friction']),
        (['diagnose', '--prior', 'stribeck_friction=o'], ['stribeck_friction=often']),
        (['excite', '--speed', 'm'], ['medium']),
        (['identify', '--gravity', ''], ['earth', 'moon']),
    ],
)
def test_values_of_an_option_are_completed(words, found):
    assert completed(*words) == found
