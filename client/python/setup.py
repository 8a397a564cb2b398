"""pip install --no-build-isolation client/python: CMake builds the extension for the Python that runs this.

It needs what CMake needs (deploy/install build python), and the sources around this folder: the extension is made of
the SDK's. CMAKE_ARGS has further arguments.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

HERE = Path(__file__).resolve().parent
SOURCE = HERE.parent.parent
VERSION = re.search(r"project\(gatefield VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text())[1]


class CMakeBuild(build_ext):
    """Builds the extension and lays the package's own courses and vehicles beside it."""

    def run(self):
        package = Path(self.get_ext_fullpath("gatefield._gatefield")).resolve().parent
        build = Path(self.build_temp).resolve()
        build.mkdir(parents=True, exist_ok=True)
        off = [f"-DGATEFIELD_BUILD_{part}=OFF" for part in ("SERVER", "SIMULATOR", "TRAINING", "TESTS")]
        subprocess.run(["cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                        "-DGATEFIELD_BUILD_PYTHON=ON", f"-DPython3_EXECUTABLE={sys.executable}", *off,
                        *shlex.split(os.environ.get("CMAKE_ARGS", ""))], check=True)
        subprocess.run(["cmake", "--build", build, "--target", "gatefield_python"], check=True)
        package.mkdir(parents=True, exist_ok=True)
        for built in (build / "python/gatefield").glob("_gatefield*.so"):
            shutil.copy2(built, package)
        if not self.inplace:
            for kind in ("courses", "vehicles"):
                shutil.copytree(SOURCE / "deploy/config" / kind, package / "config" / kind, dirs_exist_ok=True)


setup(
    version=VERSION,
    packages=["gatefield", "gatefield.importing"],
    package_data={"gatefield": ["py.typed", "*.pyi"]},
    ext_modules=[Extension("gatefield._gatefield", sources=[])],
    cmdclass={"build_ext": CMakeBuild},
)
