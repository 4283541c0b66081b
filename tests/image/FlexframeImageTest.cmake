# Image regression of a scene in CTest, for this project and any other that draws with flexframe:
#
#   include(.../tests/image/FlexframeImageTest.cmake)
#   flexframe_add_image_test(NAME crane SCENE crane.toml BASELINE baselines/crane)
#
# The test simulates and draws the scene and compares its pictures with the PNG files below BASELINE (flexframe compare: equal, or few
# enough pixels differ; vertices and colour range as numbers). It fails where a picture differs or either side lacks one. The new pictures,
# report.html that shows what differs, junit.xml and summary.md stay in <build>/image-tests/NAME; a baseline that is missing is written
# there as every new picture is.
#
#   NAME name            of the test
#   SCENE file.toml      relative to the current source folder
#   BASELINE folder      likewise
#   FRAMES A:B           only these pictures of the sequence
#   SIZE WxH             in place of the scene's
#   LEVELS n, PERCENT p  of flexframe compare: at most p percent of the pixels differ by more than n of 255 (2, 0.005)
#   ALSO folder ...      further baselines, of another renderer: a picture agrees if it agrees with any
#   IGNORE box ...       "[NAMES:]X,Y,WxH" as in flexframe compare: not looked at
#   MASK file or folder  white is not looked at
#   ARGS ...             further options of flexframe run
#   LABELS ...           of the test, beside `image`
#
# New pictures become the baseline, with the reason in CHANGES.md beside them, by
#
#   FLEXFRAME_UPDATE="thicker shaft" ctest -R crane
#
# The program is the target flexframe where the project has it, else FLEXFRAME_PROGRAM or what find_program finds.

set(FLEXFRAME_IMAGE_TEST_SCRIPT "${CMAKE_CURRENT_LIST_DIR}/run_image_test.cmake")

function(flexframe_add_image_test)
  cmake_parse_arguments(PARSE_ARGV 0 test "" "NAME;SCENE;BASELINE;FRAMES;SIZE;LEVELS;PERCENT;MASK" "ARGS;LABELS;ALSO;IGNORE")
  foreach(word NAME SCENE BASELINE)
    if(NOT test_${word})
      message(FATAL_ERROR "flexframe_add_image_test: ${word} is missing")
    endif()
  endforeach()
  if(test_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "flexframe_add_image_test: unknown words ${test_UNPARSED_ARGUMENTS}")
  endif()
  get_filename_component(scene "${test_SCENE}" ABSOLUTE BASE_DIR "${CMAKE_CURRENT_SOURCE_DIR}")
  get_filename_component(baseline "${test_BASELINE}" ABSOLUTE BASE_DIR "${CMAKE_CURRENT_SOURCE_DIR}")
  if(NOT EXISTS "${scene}")
    message(FATAL_ERROR "flexframe_add_image_test: ${test_NAME}: there is no scene ${scene}")
  endif()
  if(TARGET flexframe)
    set(program "$<TARGET_FILE:flexframe>")
  else()
    find_program(FLEXFRAME_PROGRAM flexframe REQUIRED)
    set(program "${FLEXFRAME_PROGRAM}")
  endif()
  set(run_words ${test_ARGS})
  if(test_FRAMES)
    list(APPEND run_words --frames ${test_FRAMES})
  endif()
  if(test_SIZE)
    list(APPEND run_words --size ${test_SIZE})
  endif()
  set(compare_words "")
  if(DEFINED test_LEVELS)
    list(APPEND compare_words --levels ${test_LEVELS})
  endif()
  if(DEFINED test_PERCENT)
    list(APPEND compare_words --percent ${test_PERCENT})
  endif()
  foreach(folder ${test_ALSO})
    get_filename_component(also "${folder}" ABSOLUTE BASE_DIR "${CMAKE_CURRENT_SOURCE_DIR}")
    list(APPEND compare_words --also "${also}")
  endforeach()
  foreach(box ${test_IGNORE})
    list(APPEND compare_words --ignore "${box}")
  endforeach()
  if(test_MASK)
    get_filename_component(mask "${test_MASK}" ABSOLUTE BASE_DIR "${CMAKE_CURRENT_SOURCE_DIR}")
    list(APPEND compare_words --mask "${mask}")
  endif()
  # A list in a test's command line would fall apart.
  string(REPLACE ";" "|" run_words "${run_words}")
  string(REPLACE ";" "|" compare_words "${compare_words}")
  add_test(NAME ${test_NAME}
    COMMAND ${CMAKE_COMMAND} "-Dprogram=${program}" "-Dscene=${scene}" "-Dbaseline=${baseline}"
    "-Dout=${CMAKE_BINARY_DIR}/image-tests/${test_NAME}"
            "-Drun_words=${run_words}" "-Dcompare_words=${compare_words}" -P "${FLEXFRAME_IMAGE_TEST_SCRIPT}")
  set_tests_properties(${test_NAME} PROPERTIES LABELS "image;${test_LABELS}" TIMEOUT 600)
endfunction()
