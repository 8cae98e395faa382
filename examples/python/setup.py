"""The wheel is of one system, but of every Python 3. build_wheel.sh puts the library, the weights and the version beside this."""

import platform
from pathlib import Path

from setuptools import Distribution, setup
from wheel.bdist_wheel import bdist_wheel


class Wheel(bdist_wheel):
    def get_tag(self):
        system = super().get_tag()[2]
        name, version = platform.libc_ver()
        if system.startswith("linux_") and name == "glibc":  # PEP 600: runs where the C library is this one or newer
            system = "manylinux_" + version.replace(".", "_") + system.removeprefix("linux")
        return "py3", "none", system


class WithLibrary(Distribution):
    def has_ext_modules(self):
        return True


setup(
    version=Path(__file__).with_name("version.txt").read_text().strip(),
    cmdclass={"bdist_wheel": Wheel},
    distclass=WithLibrary,
)
