# One image test (FlexframeImageTest.cmake): draws the scene, compares, and with FLEXFRAME_UPDATE in the environment makes the pictures the
# baseline.
cmake_minimum_required(VERSION 3.20)
string(REPLACE "|" ";" run_words "${run_words}")
string(REPLACE "|" ";" compare_words "${compare_words}")
file(REMOVE_RECURSE "${out}")
execute_process(COMMAND "${program}" run "${scene}" -o "${out}" --no-video --no-error-estimate ${run_words} RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "the scene could not be drawn: exit ${code}")
endif()
set(update "")
if(NOT "$ENV{FLEXFRAME_UPDATE}" STREQUAL "")
  # A reason may hold what separates lists.
  string(REPLACE ";" "\\;" reason "$ENV{FLEXFRAME_UPDATE}")
  set(update --update "${reason}")
elseif(NOT EXISTS "${baseline}")
  message(FATAL_ERROR
    "there is no baseline ${baseline}; the new pictures are ${out}/frames. If they are right: FLEXFRAME_UPDATE=\"reason\" ctest ...")
endif()
execute_process(COMMAND "${program}" compare "${baseline}" "${out}/frames" --report "${out}/report.html" --junit "${out}/junit.xml"
    --markdown "${out}/summary.md" ${compare_words} ${update}
  RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR
    "the pictures are not those of ${baseline}: what differs is shown by ${out}/report.html. If they are right: "
    "FLEXFRAME_UPDATE=\"reason\" ctest ...")
endif()
