// A comparison for the systems that run tests: JUnit's XML, and Markdown for the summary of a job or a comment.
#pragma once

#include "render/image/compare_pairs.h"

#include <string>
#include <utility>
#include <vector>

namespace flexframe::render {

using Facts = std::vector<std::pair<std::string, std::string>>;  // name, text: machine, renderer, rule

// What is wrong with a pair in one line: numbers, measures, box; empty if it passes.
std::string failure_text(const ComparedPair& pair);

// One <testsuite> with one <testcase> a pair, in order of names, a <failure> in those that do not pass, the facts as <property>.
// Source: the format that Ant's JUnit task writes, as GitLab and Jenkins read it.
std::string junit_text(const Comparison& comparison, const std::string& suite, const Facts& facts);

// A heading with the counts, a table of the pairs that do not pass, worst first (at most 50 of them, then how many more), the facts.
std::string markdown_text(const Comparison& comparison, const std::string& title, const Facts& facts);

}  // namespace flexframe::render
