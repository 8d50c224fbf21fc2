# Headers of libraries that most files include, compiled once instead of some five hundred times: a third of the time
# that building everything takes. No file may rely on it: -DCOMAP_PRECOMPILE=OFF shows whether each includes what it
# uses.
option(COMAP_PRECOMPILE "Compile common headers once" ON)
if(NOT COMAP_PRECOMPILE)
  return()
endif()

set(comap_common_headers <algorithm> <array> <chrono> <cmath> <cstdint> <cstring> <filesystem> <fstream> <functional>
  <map> <memory> <optional> <set> <span> <sstream> <string> <vector> <Eigen/Dense>)
set(comap_no_code ${PROJECT_BINARY_DIR}/no_code.cc)
file(GENERATE OUTPUT ${comap_no_code} CONTENT "int main() { return 0; }\n")

add_library(comap_headers OBJECT ${comap_no_code})
target_link_libraries(comap_headers PRIVATE Eigen3::Eigen)
# A program, as tests are: code of libraries is compiled with other options.
add_executable(comap_test_headers ${comap_no_code})
target_link_libraries(comap_test_headers PRIVATE Eigen3::Eigen GTest::gtest)
target_precompile_headers(comap_headers PRIVATE ${comap_common_headers})
target_precompile_headers(comap_test_headers PRIVATE ${comap_common_headers} <gmock/gmock.h> <gtest/gtest.h>)
foreach(target comap_headers comap_test_headers)
  comap_warnings(${target})
endforeach()
