// The files of render/film/page, compiled in: file name -> text.
#pragma once

#include <map>
#include <string>

namespace flexframe::film {

const std::map<std::string, std::string>& page_texts();

}  // namespace flexframe::film
