# SPDX-License-Identifier: MIT
"""Version and tag of the wheel, which build_wheel.sh gives: the package contains a C library, and no Python extension."""
import os

from setuptools import Distribution, setup
from wheel.bdist_wheel import bdist_wheel


class Wheel(bdist_wheel):
    def finalize_options(self):
        super().finalize_options()
        self.root_is_pure = False

    def get_tag(self):
        return "py3", "none", os.environ["CLOTHSTREAM_PLATFORM"]


class WithLibrary(Distribution):
    def has_ext_modules(self):
        return True


setup(version=os.environ["CLOTHSTREAM_VERSION"], cmdclass={"bdist_wheel": Wheel}, distclass=WithLibrary)
