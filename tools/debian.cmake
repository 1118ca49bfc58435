# Debian packages, one for each component; `tools/dev.py deb` makes them.
set(BALLOT_DEB "" CACHE PATH "what only packages have: a folder for each component, with the one of Python")
set(CPACK_GENERATOR DEB)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL runtime development tools)
if(BALLOT_DEB)
  list(APPEND CPACK_COMPONENTS_ALL python)
  foreach(component IN LISTS CPACK_COMPONENTS_ALL)
    install(DIRECTORY ${BALLOT_DEB}/${component}/ DESTINATION . COMPONENT ${component})
  endforeach()
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${BALLOT_DEB}/triggers)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${BALLOT_DEB}/postinst ${BALLOT_DEB}/prerm)
endif()
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_PACKAGE_NAME ballot)
set(CPACK_PACKAGE_VENDOR "the authors of Ballot")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
  WORLD_READ WORLD_EXECUTE)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SOURCE ballot)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR})  # of Python's extension
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(driver "mesa-vulkan-drivers | vulkan-icd")

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME libballot${PROJECT_VERSION_MAJOR})
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS libvulkan1)  # opened at run time
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "${driver}")
set(CPACK_DEBIAN_RUNTIME_DESCRIPTION "ray queries by Vulkan compute: the library
Answers ray and point queries on meshes: nearest hits, occlusion, crossings,
closest points. It runs on any Vulkan 1.2 device, and on CPUs by lavapipe.")

set(CPACK_COMPONENT_DEVELOPMENT_DEPENDS runtime)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libballot-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "ray queries by Vulkan compute: headers
Headers for C and C++, the CMake package and the file of pkg-config.")

set(CPACK_COMPONENT_PYTHON_DEPENDS runtime)
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-ballot)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "ray queries by Vulkan compute: for Python
Answers ray and point queries on meshes in arrays of NumPy: nearest hits,
occlusion, crossings, closest points, pictures.")

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME ballot)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS libvulkan1)
set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS "${driver}")
set(CPACK_DEBIAN_TOOLS_PACKAGE_SUGGESTS "libglfw3, python3-matplotlib")
set(CPACK_DEBIAN_TOOLS_DESCRIPTION "ray queries by Vulkan compute: the program
Renders, traces, measures and checks scenes of glTF, OBJ, PLY and STL.")
include(CPack)
