// The files of render/base/house, compiled in: file name -> text.
#pragma once

#include <map>
#include <string>

namespace flexframe::render {

const std::map<std::string, std::string>& house_texts();

}  // namespace flexframe::render
