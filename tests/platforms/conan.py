"""Runs cmake/ports/conan/conanfile.py with stand-ins for Conan's modules: conan.py FOLDER VERSION"""
import fnmatch
import importlib.util
import os
import shutil
import subprocess
import sys
import types

folder, version = sys.argv[1:]
root = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
sources, build, package = (os.path.join(folder, name) for name in ("sources", "build", "package"))


def copy(_, pattern, source, target):
    """Conan's: the pattern stands for paths below `source`; * is any text, folders included."""
    for place, _, files in os.walk(os.path.join(source, pattern.split("*")[0].rpartition("/")[0])):
        for name in files:
            path = os.path.relpath(os.path.join(place, name), source)
            if fnmatch.fnmatch(path, pattern):
                os.makedirs(os.path.dirname(os.path.join(target, path)), exist_ok=True)
                shutil.copy(os.path.join(source, path), os.path.join(target, path))


class CMakeToolchain:
    def __init__(self, recipe):
        self.recipe, self.variables = recipe, {}

    def generate(self):
        self.recipe.toolchain = [f"-D{name}={'ON' if value is True else 'OFF' if value is False else value}" for name, value in self.variables.items()]


class CMake:
    def __init__(self, recipe):
        self.recipe = recipe

    def configure(self):
        subprocess.run(["cmake", "-S", sources, "-B", build, f"-DCMAKE_INSTALL_PREFIX={package}"] + self.recipe.toolchain,
                       check=True, stdout=subprocess.DEVNULL)

    def install(self):
        subprocess.run(["cmake", "--install", build], check=True, stdout=subprocess.DEVNULL)


class Info:
    def clear(self): pass
    def set_property(self, *_): pass


class ConanFile:
    def __init__(self):
        self.recipe_folder, self.export_sources_folder = os.path.join(root, "cmake", "ports", "conan"), sources
        self.options = types.SimpleNamespace(**self.default_options)
        self.info, self.cpp_info, self.needs = Info(), Info(), []

    def requires(self, name, **_):
        self.needs.append(name)


for name, contents in {"conan": {"ConanFile": ConanFile}, "conan.tools": {},
                       "conan.tools.cmake": {"CMake": CMake, "CMakeToolchain": CMakeToolchain, "cmake_layout": lambda _: None},
                       "conan.tools.files": {"copy": copy}}.items():
    sys.modules[name] = types.ModuleType(name)
    vars(sys.modules[name]).update(contents)
sys.dont_write_bytecode = True
spec = importlib.util.spec_from_file_location("conanfile", os.path.join(root, "cmake", "ports", "conan", "conanfile.py"))
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
recipe = module.Npt()
recipe.set_version()
if recipe.version != version:
    sys.exit(f"conanfile.py: found version {recipe.version}, expected {version}")
shutil.rmtree(folder, ignore_errors=True)
for step in ("export_sources", "requirements", "layout", "generate", "package", "package_id", "package_info"):
    getattr(recipe, step)()
for path in recipe.cpp_info.builddirs:
    if not os.path.exists(os.path.join(package, path, "npt-config.cmake")):
        sys.exit(f"conanfile.py: found no npt-config.cmake in {path}")
