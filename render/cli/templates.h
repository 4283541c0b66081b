// The files of render/cli/templates, compiled into the program: file name -> text, in which @NAME@ stands for the new scene's name.
#pragma once

#include <map>
#include <string>

namespace flexframe::cli {

const std::map<std::string, std::string>& template_texts();

}  // namespace flexframe::cli
