find_package(Python3 REQUIRED COMPONENTS Interpreter)

add_test(NAME format COMMAND ${PROJECT_SOURCE_DIR}/scripts/check-format)
add_test(NAME architecture COMMAND Python3::Interpreter ${CMAKE_CURRENT_SOURCE_DIR}/architecture_test.py)
add_test(NAME headers COMMAND ${CMAKE_COMMAND} --build ${PROJECT_BINARY_DIR} --target kinespace_headers)
add_test(NAME install
         COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/install/install_test ${PROJECT_BINARY_DIR} ${CMAKE_CXX_COMPILER})
add_test(NAME tidy COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/scripts/check-tidy --build ${PROJECT_BINARY_DIR})
set_tests_properties(tidy PROPERTIES TIMEOUT 3000)
