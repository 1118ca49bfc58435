# The library for Spack: `spack repo add tools/recipes/spack; spack install ballot`. A release fills in
# url and sha256 of the source package.
from spack.package import *


class Ballot(CMakePackage):
    """Fast, correct ray queries by Vulkan compute, on GPUs without ray tracing hardware and on CPUs."""

    url = "https://pypi.org/packages/source/b/ballot/ballot-1.0.0.tar.gz"
    version("1.0.0", sha256="0" * 64)
    license("Apache-2.0")
    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("python@3.10:", type="build")
    for name in ("boost@1.74:", "draco", "embree", "fmt", "glm", "glslang", "libpng", "libwebp", "meshoptimizer",
                 "nlohmann-json", "openexr@3:", "spirv-cross", "spirv-tools", "stb", "tinygltf", "vulkan-headers",
                 "vulkan-loader", "xxhash", "zlib-api"):  # fmt: skip
        depends_on(name)

    @run_before("cmake")
    def make_stb(self):
        """Makes the library and the folder that Ballot looks for: stb has headers alone."""
        with working_dir(self.stage.source_path):
            mkdirp("stb")
            copy(find(self.spec["stb"].prefix, "stb_image.h")[0], "stb")
            options = ("-x", "c++", "-DSTB_IMAGE_IMPLEMENTATION", "-fPIC", "-O2")
            Executable(self.compiler.cxx)(*options, "-c", "stb/stb_image.h", "-o", "stb.o")
            Executable("ar")("rc", "libstb.a", "stb.o")

    def cmake_args(self):
        library = join_path(self.stage.source_path, "libstb.a")
        return ["-DBALLOT_TESTS=OFF", "-DBALLOT_TOOLS=OFF", "-DBALLOT_SOURCE_SHADERS=", f"-DSTB_LIBRARY={library}"]
