# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every public name has a running example, and documents arguments, result and errors."""

import dataclasses
import doctest
import inspect
import re

import armid_ros as ar
import pytest

FUNCTIONS = [name for name in ar.__all__ if inspect.isfunction(getattr(ar, name))]


@pytest.mark.parametrize('name', ar.__all__)
def test_a_public_name_has_an_example_that_runs(name, at_desk):
    (found,) = doctest.DocTestFinder(recurse=False).find(getattr(ar, name), name, globs={})
    assert found.examples
    assert not any(doctest.SKIP in example.options for example in found.examples)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    failures = []
    runner.run(found, out=failures.append)
    assert not runner.failures, ''.join(failures)


@pytest.mark.parametrize('name', FUNCTIONS)
def test_a_public_function_describes_arguments_result_and_errors(name):
    function = getattr(ar, name)
    documented = ar_sections(function.__doc__)
    parameters = documented.get('Parameters', '')
    for argument in inspect.signature(function).parameters:
        assert re.search(rf'^\*{{0,2}}(\w+, )*{argument}\b', parameters, re.M)
    assert 'Returns' in documented or inspect.signature(function).return_annotation == 'None'
    assert 'Raises' in documented or name in ('shipped_robots', 'regressor')


def ar_sections(text):
    """Return the sections of a numpydoc docstring by heading."""
    parts = re.split(r'^(\w[\w ]*)\n-+\n', inspect.cleandoc(text), flags=re.MULTILINE)
    return {'summary': parts[0], **dict(zip(parts[1::2], parts[2::2], strict=True))}


@pytest.mark.parametrize(
    'name', [n for n in ar.__all__ if dataclasses.is_dataclass(getattr(ar, n))]
)
def test_a_public_dataclass_describes_each_field(name):
    kind = getattr(ar, name)
    documented = ar_sections(kind.__doc__)['Attributes']
    for field in dataclasses.fields(kind):
        assert re.search(rf'^(\w+, )*{field.name}\b', documented, re.MULTILINE), field.name
