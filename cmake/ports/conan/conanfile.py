"""npt for Conan 2, from a clone of npt: conan create cmake/ports/conan"""
import os
import re

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy


class Npt(ConanFile):
    name = "npt"
    license = "MIT"
    description = "Neural pose transfer for meshes: a header-only C++20 library"
    package_type = "header-library"
    settings = "os", "compiler", "build_type", "arch"
    options = {"with_tbb": [True, False], "with_io": [True, False], "with_eigen": [True, False]}
    default_options = {"with_tbb": True, "with_io": True, "with_eigen": False}
    no_copy_source = True

    def set_version(self):
        with open(os.path.join(self.recipe_folder, "..", "..", "..", "include", "npt", "config.hpp")) as header:
            self.version = ".".join(re.findall(r"#define NPT_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", header.read()))

    def export_sources(self):
        root = os.path.join(self.recipe_folder, "..", "..", "..")
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "include/*", "examples/weights/*"):
            copy(self, pattern, root, self.export_sources_folder)

    def requirements(self):
        self.requires("xsimd/[>=8.1]", transitive_headers=True)
        self.requires("xtl/[>=0.7]", transitive_headers=True)
        if self.options.with_tbb:
            self.requires("onetbb/[>=2021]", transitive_headers=True, transitive_libs=True)
        if self.options.with_io:
            self.requires("tinyobjloader/[>=2.0.0-rc10]", transitive_headers=True, transitive_libs=True)
        if self.options.with_eigen:
            self.requires("eigen/[>=3.4]", transitive_headers=True)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.variables["NPT_WITH_TBB"] = bool(self.options.with_tbb)
        toolchain.variables["NPT_BUILD_PROGRAMS"] = False
        toolchain.variables["NPT_BUILD_TESTS"] = False
        toolchain.generate()

    def package(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.install()

    def package_id(self):
        self.info.clear()

    def package_info(self):
        self.cpp_info.set_property("cmake_find_mode", "none")  # npt's own files define the targets
        self.cpp_info.builddirs = [os.path.join("share", "cmake", "npt")]
