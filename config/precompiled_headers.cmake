# Headers that most sources include, compiled once for all of them: half of a cold build was spent on reading the
# same ones again. A source still includes what it uses: presets dev, tsan, tidy and fuzz do without (CMakePresets.json),
# so that a forgotten #include is found there.
#
#   selfcal_precompiled(TARGET std|math|test)
#     std: the standard library, fmt, expected; math: Eigen and JSON besides; test: GoogleTest besides
# Kind test is made in tests/, where GoogleTest is at hand.
set(selfcal_std_headers <algorithm> <array> <charconv> <chrono> <cmath> <cstdint> <cstring> <filesystem> <fstream>
    <functional> <iostream> <map> <memory> <numeric> <optional> <set> <span> <string> <string_view> <variant> <vector>
    <fmt/format.h> <tl/expected.hpp>)
set(selfcal_math_headers ${selfcal_std_headers} <Eigen/Cholesky> <Eigen/Core> <Eigen/Eigenvalues> <Eigen/Geometry>
    <Eigen/LU> <Eigen/QR> <random> <nlohmann/json.hpp>)
set(selfcal_test_headers ${selfcal_math_headers} <gmock/gmock.h> <gtest/gtest.h>)

function(selfcal_precompile kind)
  if(CMAKE_DISABLE_PRECOMPILE_HEADERS )
    return()
  endif()
  # A precompiled header belongs to a target, and a target needs a source.
  set(source ${PROJECT_BINARY_DIR}/precompiled/${kind}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "// Owner of the precompiled headers \"${kind}\".\n")
  add_library(selfcal_${kind}_headers OBJECT ${source})
  target_link_libraries(selfcal_${kind}_headers PRIVATE selfcal_flags Eigen3::Eigen nlohmann_json::nlohmann_json)
  if(kind STREQUAL test)
    target_link_libraries(selfcal_${kind}_headers PRIVATE GTest::gmock)
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(selfcal_${kind}_headers PRIVATE -fpch-preprocess)
  endif()
  target_precompile_headers(selfcal_${kind}_headers PRIVATE ${selfcal_${kind}_headers})
endfunction()

selfcal_precompile(std)
selfcal_precompile(math)

function(selfcal_precompiled target kind)
  if(CMAKE_DISABLE_PRECOMPILE_HEADERS)
    return()
  endif()
  target_precompile_headers(${target} REUSE_FROM selfcal_${kind}_headers)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(${target} PRIVATE -fpch-preprocess)  # ccache then need not read the headers either
  endif()
endfunction()
