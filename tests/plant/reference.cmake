# The independent solver, its own proof, and what it proves about the plant.
add_library(shiftrig_reference STATIC plant/reference/system.cpp plant/reference/fields.cpp plant/reference/piston.cpp plant/reference/wet_plates.cpp plant/reference/modes.cpp plant/reference/solver.cpp plant/reference/run.cpp
            plant/reference/linear_program.cpp plant/reference/cases.cpp plant/reference/curves.cpp plant/reference/tractor.cpp)
target_link_libraries(shiftrig_reference PUBLIC shiftrig_options Eigen3::Eigen)

add_executable(reference_solver_test plant/reference/solver_test.cpp)
target_link_libraries(reference_solver_test PRIVATE shiftrig_reference GTest::gtest_main)
target_compile_definitions(reference_solver_test PRIVATE SHIFTRIG_DATA="${CMAKE_SOURCE_DIR}/tests/data")
gtest_discover_tests(reference_solver_test)

add_library(shiftrig_comparison STATIC plant/random_systems.cpp plant/random_forests.cpp plant/random_vehicles.cpp plant/random_wet_vehicles.cpp plant/random_pistons.cpp plant/comparison.cpp plant/tractor_comparison.cpp)
target_link_libraries(shiftrig_comparison PUBLIC shiftrig_reference shiftrig_plant)

# Thousands by hand: shiftrig_random_systems --count 10000 --seed 1 --seconds 0.2 --jobs 2
add_executable(shiftrig_random_systems plant/random_systems_main.cpp)
target_link_libraries(shiftrig_random_systems PRIVATE shiftrig_comparison Threads::Threads)

add_executable(tractor_shift_test plant/tractor_shift_test.cpp)
target_link_libraries(tractor_shift_test PRIVATE shiftrig_comparison GTest::gtest_main)
# One process: its cases share the reference runs.
add_test(NAME tractor_shift_test COMMAND tractor_shift_test)

add_executable(agreement_test plant/agreement_test.cpp)
target_link_libraries(agreement_test PRIVATE shiftrig_comparison GTest::gtest_main)
target_compile_definitions(agreement_test PRIVATE SHIFTRIG_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data")
gtest_discover_tests(agreement_test)

add_executable(random_pistons_test plant/random_pistons_test.cpp)
target_link_libraries(random_pistons_test PRIVATE shiftrig_comparison GTest::gtest_main)
gtest_discover_tests(random_pistons_test)

add_executable(library_examples_test plant/library_examples_test.cpp)
target_link_libraries(library_examples_test PRIVATE shiftrig_comparison GTest::gtest_main)
target_compile_definitions(library_examples_test PRIVATE SHIFTRIG_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data")
gtest_discover_tests(library_examples_test)

if(SHIFTRIG_PLANT_ONLY)
  return()
endif()
# Very many steps by hand: shiftrig_long_run --steps 100000000 --parked 10000000
add_executable(shiftrig_long_run plant/long_run_main.cpp)
target_link_libraries(shiftrig_long_run PRIVATE shiftrig_plant shiftrig_model)
target_compile_definitions(shiftrig_long_run PRIVATE SHIFTRIG_CONFIG="${PROJECT_SOURCE_DIR}/config")
set_target_properties(shiftrig_long_run PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})
add_test(NAME long_run COMMAND shiftrig_long_run)
