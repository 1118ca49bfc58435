// Runs the device tests on the driver that BALLOT_TEST_DRIVER names: "system" is Debian's Mesa, "current" the Mesa of
// bookworm-backports, which tools/dev.py unpacks. If it is unset, the Vulkan loader chooses. A driver that is named but
// missing fails the run. LP_NATIVE_VECTOR_WIDTH sets the subgroup size of lavapipe.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <string>

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (const char* driver = std::getenv("BALLOT_TEST_DRIVER")) {
    const std::string variable = std::string(driver) == "system" ? "BALLOT_SYSTEM_MESA_ICD" : "BALLOT_CURRENT_MESA_ICD";
    const char* icd = std::getenv(variable.c_str());
    if (!icd || !*icd) {
      std::fprintf(stderr,
                   "BALLOT_TEST_DRIVER names the %s Mesa, but %s is not set; run the tests with tools/dev.py test\n",
                   driver, variable.c_str());
      return 1;
    }
    setenv("VK_DRIVER_FILES", icd, 1);
    setenv("VK_ICD_FILENAMES", icd, 1);
  }
  return RUN_ALL_TESTS();
}
