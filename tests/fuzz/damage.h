// Damage to a text, as disks, editors and other programs do it: bytes changed, pieces cut, doubled or moved, numbers replaced by awkward
// ones, lines exchanged, the end missing.
#pragma once

#include <iterator>
#include <random>
#include <string>
#include <string_view>

namespace flexframe {

inline std::string damaged(std::string text, std::mt19937& random) {
  static constexpr const char* awkward[] = {
      "0", "-1", "1e308", "-1e308", "nan", "inf", "1e-308", "2147483648", "99999999999999999999", "4294967295", "", "x", "1,2", "0.5"};
  static constexpr std::string_view spice = "0123456789()*$=,.-+DEen \n\t\r\"%";
  const int hits = 1 + static_cast<int>(random() % 5);
  for (int h = 0; h < hits && !text.empty(); ++h) {
    const std::size_t at = random() % text.size(), size = 1 + random() % (random() % 8 == 0 ? 4000 : 40);
    switch (random() % 7) {
      case 0:
        text[at] = spice[random() % spice.size()];
        break;
      case 1:
        text.erase(at, size);
        break;
      case 2:
        text.insert(at, text.substr(random() % text.size(), size));
        break;
      case 3:
        if (random() % 4 == 0) text.resize(at);
        break;
      case 4: {
        // A number as a whole.
        const std::size_t begin = text.find_first_of("0123456789", at);
        if (begin == std::string::npos) break;
        const std::size_t end = text.find_first_not_of("0123456789.eE+-", begin);
        text.replace(begin, end == std::string::npos ? end : end - begin, awkward[random() % std::size(awkward)]);
        break;
      }
      case 5: {
        // Two lines change places, or one is lost.
        const std::size_t first = text.find('\n', at), second = first == std::string::npos ? first : text.find('\n', first + 1);
        if (second == std::string::npos) break;
        const std::string line = text.substr(first, second - first);
        text.erase(first, second - first);
        if (random() % 2) text.insert(random() % (text.size() + 1), line);
        break;
      }
      default:
        text[at] = static_cast<char>(random() % 256);
    }
  }
  return text;
}

}  // namespace flexframe
