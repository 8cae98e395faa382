"""The wheel is of one system, but of every Python 3. build_wheel.sh puts the library, the weights and the version beside this."""

import os
import re
import subprocess
from pathlib import Path

from setuptools import Distribution, setup
from wheel.bdist_wheel import bdist_wheel

LIBRARY = Path(__file__).with_name("npt") / "lib" / "libnpt_c.so"
# What PEP 600 lets a wheel take from the system, of what npt's library asks for.
SYSTEM = {"libc.so.6", "libm.so.6", "libgcc_s.so.1", "libpthread.so.0", "ld-linux-x86-64.so.2"}


def readelf(option):
    run = ["readelf", "--wide", option, str(LIBRARY)]
    return subprocess.run(run, check=True, capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"}).stdout


def system_of(system):
    """PEP 600: the wheel runs where glibc is as new as the newest version of a symbol that the library asks for. One that needs
    other libraries, such as a build's own libnpt_c.so, is for this system."""
    if not system.startswith("linux_") or not set(re.findall(r"\(NEEDED\).*\[(.*)\]", readelf("--dynamic"))) <= SYSTEM:
        return system
    major, minor = max((int(a), int(b)) for a, b in re.findall(r"Name: GLIBC_(\d+)\.(\d+)", readelf("--version-info")))
    return f"manylinux_{major}_{minor}" + system.removeprefix("linux")


class Wheel(bdist_wheel):
    def get_tag(self):
        return "py3", "none", system_of(super().get_tag()[2])


class WithLibrary(Distribution):
    def has_ext_modules(self):
        return True


setup(
    version=Path(__file__).with_name("version.txt").read_text().strip(),
    cmdclass={"bdist_wheel": Wheel},
    distclass=WithLibrary,
)
