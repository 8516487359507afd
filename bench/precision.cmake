# Error against cost of the plant's step and of textbook methods; the data behind docs/figures.
if(NOT SHIFTRIG_TESTS)
  return()  # the reference solver lives there
endif()
add_library(shiftrig_shift_methods STATIC ${CMAKE_CURRENT_LIST_DIR}/shift_methods.cpp)
target_link_libraries(shiftrig_shift_methods PUBLIC shiftrig_comparison)
find_package(SUNDIALS QUIET COMPONENTS cvode)
if(SUNDIALS_FOUND)
  target_link_libraries(shiftrig_shift_methods PRIVATE SUNDIALS::cvode)
  target_compile_definitions(shiftrig_shift_methods PRIVATE SHIFTRIG_HAVE_CVODE)
else()
  message(STATUS "SUNDIALS not found: the comparison with CVODE is left out")
endif()

# shiftrig_figure_data NAME: the CSV behind a figure; scripts/figures draws it.
add_executable(shiftrig_figure_data ${CMAKE_CURRENT_LIST_DIR}/figure_data.cpp ${CMAKE_CURRENT_LIST_DIR}/figure_curves.cpp
               ${CMAKE_CURRENT_LIST_DIR}/figure_shift.cpp)
target_link_libraries(shiftrig_figure_data PRIVATE shiftrig_shift_methods)
target_compile_definitions(shiftrig_figure_data PRIVATE SHIFTRIG_DATA="${CMAKE_SOURCE_DIR}/tests/data")
