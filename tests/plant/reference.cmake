# The independent solver, its own proof, and what it proves about the plant.
add_library(shiftrig_reference STATIC plant/reference/system.cpp plant/reference/modes.cpp plant/reference/solver.cpp
            plant/reference/cases.cpp plant/reference/curves.cpp)
target_link_libraries(shiftrig_reference PUBLIC shiftrig_options Eigen3::Eigen)

add_executable(reference_solver_test plant/reference/solver_test.cpp)
target_link_libraries(reference_solver_test PRIVATE shiftrig_reference GTest::gtest_main)
target_compile_definitions(reference_solver_test PRIVATE SHIFTRIG_DATA="${CMAKE_SOURCE_DIR}/tests/data")
gtest_discover_tests(reference_solver_test)
