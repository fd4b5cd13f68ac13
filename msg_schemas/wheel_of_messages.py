# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Build backend that compiles the messages with the ROS 2 of the environment into a wheel."""

import os
from pathlib import Path
import subprocess
import sys
import sysconfig
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

HERE = Path(__file__).resolve().parent
NAME = 'armid_msgs'


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Build the wheel (hook of PEP 517) and return its file name."""
    from wheel.wheelfile import WheelFile

    version = ElementTree.parse(HERE / 'package.xml').findtext('version')
    python = f'cp{sys.version_info.major}{sys.version_info.minor}'
    platform = sysconfig.get_platform().replace('-', '_').replace('.', '_')
    tag = f'{python}-{python}-{platform}'
    stem = f'{NAME}-{version}'
    facts = {
        'METADATA': f'Metadata-Version: 2.1\nName: {NAME}\nVersion: {version}\n'
        'Summary: Messages of armid_ros, compiled for one environment.\nLicense: Apache-2.0\n',
        'WHEEL': f'Wheel-Version: 1.0\nGenerator: {NAME}\nRoot-Is-Purelib: false\nTag: {tag}\n',
    }
    name = f'{stem}-{tag}.whl'
    with TemporaryDirectory() as folder:
        prefix = compiled(Path(folder))
        with WheelFile(Path(wheel_directory, name), 'w') as wheel:
            for path in sorted(prefix.rglob('*')):
                if path.is_file() and '.egg-info' not in path.as_posix():
                    wheel.write(path, placed(path.relative_to(prefix), f'{stem}.data/data'))
            for part, text in facts.items():
                wheel.writestr(f'{stem}.dist-info/{part}', text)
    return name


def placed(path, data):
    """Return the path in the wheel of an installed file."""
    _, found, inside = path.as_posix().partition('/site-packages/')
    return inside if found else f'{data}/{path.as_posix()}'


def compiled(folder):
    """Compile the messages and install them below a folder; return the prefix."""
    if not Path(sys.prefix, 'share', 'rosidl_default_generators').is_dir():
        raise SystemExit(
            f"{NAME}: there is no ROS 2 in {sys.prefix}: first pip install 'armid_ros[ros]', "
            f'then pip install --no-build-isolation {HERE}'
        )
    build, prefix = folder / 'build', folder / 'prefix'
    environment = {
        **{k: v for k, v in os.environ.items() if k not in ('CMAKE_PREFIX_PATH', 'PYTHONHOME')},
        'PATH': os.pathsep.join([str(Path(sys.prefix, 'bin')), os.environ.get('PATH', '')]),
        'AMENT_PREFIX_PATH': sys.prefix,
    }
    configure = [
        *('cmake', '-S', HERE, '-B', build, '-G', 'Ninja'),
        '-DCMAKE_BUILD_TYPE=Release',
        '-DBUILD_TESTING=OFF',
        f'-DCMAKE_INSTALL_PREFIX={prefix}',
        f'-DCMAKE_PREFIX_PATH={sys.prefix}',
        f'-DPython3_EXECUTABLE={sys.executable}',
    ]
    for command in (configure, ['cmake', '--build', build], ['cmake', '--install', build]):
        subprocess.run(command, env=environment, check=True)
    return prefix
