// The files of render/image/compare_page, compiled in: file name -> text.
#pragma once

#include <map>
#include <string>

namespace flexframe::render {

const std::map<std::string, std::string>& compare_page_texts();

}  // namespace flexframe::render
