// Tests on the synthetic flat that one fixture of ctest makes.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "tests/end_to_end/program.h"
#include "tests/files/temporary_folder.h"

namespace comap {

class FlatTest : public testing::Test {
 protected:
  void SetUp() override {
    const char* flat = std::getenv("COMAP_FLAT_DIR");
    if (flat == nullptr) GTEST_SKIP() << "COMAP_FLAT_DIR names no synthetic flat; run by ctest, which makes one";
    flat_ = flat;
  }

  TemporaryFolder folder_;
  std::string flat_;  ///< holds a folder for each of the robots a and b
};

}  // namespace comap
