"""Conan 2 recipe of this checkout: conan create cmake/packages/conan"""
import os

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy


class LlmtConan(ConanFile):
    name = "llmt"
    version = "0.1.0"
    license = "MIT"
    description = "Local linear model trees, and a robot calibration layer on top of them"
    topics = ("regression", "local linear models", "robot calibration")
    package_type = "library"
    settings = "os", "compiler", "build_type", "arch"
    options = {"shared": [True, False], "fPIC": [True, False], "robotics": [True, False], "programs": [True, False]}
    default_options = {"shared": False, "fPIC": True, "robotics": True, "programs": False}
    implements = ["auto_shared_fpic"]

    def export_sources(self):
        root = os.path.join(self.recipe_folder, "..", "..", "..")
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "llmt/*", "robotics/*", "apps/*"):
            copy(self, pattern, root, self.export_sources_folder)

    def requirements(self):
        self.requires("eigen/3.4.0", transitive_headers=True)
        self.requires("onetbb/2021.12.0")
        self.requires("fmt/10.2.1")
        self.requires("fast_float/6.1.0", visible=False)
        self.requires("nlohmann_json/3.11.3", visible=False)
        self.requires("boost/1.84.0", visible=False, options={"header_only": True})
        if self.options.robotics or self.options.programs:
            self.requires("muparser/2.3.4")
        if self.options.robotics:
            self.requires("yaml-cpp/0.8.0")
            self.requires("expat/2.5.0")
            self.requires("urdfdom/4.0.0")
            self.requires("tinyxml/2.6.2")
        if self.options.programs:
            self.requires("cli11/2.4.1", visible=False)

    def validate(self):
        check_min_cppstd(self, 20)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.variables["LLMT_BUILD_ROBOTICS"] = bool(self.options.robotics)
        toolchain.variables["LLMT_BUILD_APPS"] = bool(self.options.programs)
        toolchain.variables["LLMT_BUILD_TESTING"] = False
        toolchain.variables["LLMT_BUILD_BENCHMARKS"] = "OFF"
        toolchain.variables["LLMT_UNITY_BUILD"] = True
        toolchain.generate()
        CMakeDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))

    def package_info(self):
        self.cpp_info.set_property("cmake_find_mode", "none")  # the package's own llmtConfig.cmake is used
        self.cpp_info.builddirs = [os.path.join("lib", "cmake", "llmt")]
