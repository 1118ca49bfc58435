# The library for vcpkg, as an overlay port of this checkout:
#   vcpkg install ballot --overlay-ports=tools/recipes/vcpkg
# It is a shared library, whatever the triplet says of others. vcpkg's stb has headers alone, and its spirv-cross has
# its C interface as a static library of another name: both are bridged here.
set(VCPKG_LIBRARY_LINKAGE dynamic)
get_filename_component(source ${CMAKE_CURRENT_LIST_DIR}/../../.. ABSOLUTE)
set(bridge ${CURRENT_BUILDTREES_DIR}/bridge)
file(COPY ${CURRENT_INSTALLED_DIR}/include/stb_image.h DESTINATION ${bridge}/stb)
vcpkg_execute_required_process(WORKING_DIRECTORY ${bridge} LOGNAME stb
  COMMAND c++ -x c++ -DSTB_IMAGE_IMPLEMENTATION -fPIC -O2 -c stb/stb_image.h -o stb.o)
vcpkg_execute_required_process(WORKING_DIRECTORY ${bridge} LOGNAME stb COMMAND ar rc libstb.a stb.o)
file(WRITE ${bridge}/spirv_cross_c_shared-config.cmake "include(CMakeFindDependencyMacro)
find_dependency(spirv_cross_c)
add_library(spirv-cross-c-shared ALIAS spirv-cross-c)\n")
vcpkg_cmake_configure(SOURCE_PATH ${source} OPTIONS -DBALLOT_TESTS=OFF -DBALLOT_TOOLS=OFF -DBALLOT_SOURCE_SHADERS=
  -DSTB_LIBRARY=${bridge}/libstb.a -DCMAKE_CXX_FLAGS=-I${bridge} -Dspirv_cross_c_shared_DIR=${bridge})
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME Ballot CONFIG_PATH lib/cmake/Ballot)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE ${CURRENT_PACKAGES_DIR}/debug/include ${CURRENT_PACKAGES_DIR}/debug/share)
vcpkg_install_copyright(FILE_LIST ${source}/LICENSE ${source}/engine/api/python/NOTICE)
