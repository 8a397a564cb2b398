#pragma once

#include <map>
#include <string>
#include <vector>

/// A bundle as one piece of bytes: the files that it has, in this order, with a mark between them.
namespace gatefield::fuzz {

inline const std::string kMark = "\n%file%\n";
inline const std::vector<std::string> kNames{"manifest.txt", "decoder.onnx",      "encoder.onnx",     "look1.onnx",
                                             "look2.onnx",   "encoder.onnx.data", "encoder.test.onnx"};

inline std::string join(const std::map<std::string, std::string>& files) {
  std::string bytes;
  for (const std::string& name : kNames) {
    if (&name != &kNames.front()) bytes += kMark;
    if (const auto found = files.find(name); found != files.end()) bytes += found->second;
  }
  return bytes;
}

/// As many pieces as there are names; what lies behind the last one is dropped.
inline std::vector<std::string> split(const std::string& bytes) {
  std::vector<std::string> pieces(kNames.size());
  std::size_t from = 0;
  for (std::string& piece : pieces) {
    const std::size_t to = bytes.find(kMark, from);
    piece = bytes.substr(from, to == std::string::npos ? to : to - from);
    if (to == std::string::npos) break;
    from = to + kMark.size();
  }
  return pieces;
}

inline std::map<std::string, std::string> files_of(const std::vector<std::string>& pieces) {
  std::map<std::string, std::string> files;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (!pieces[i].empty()) files[kNames[i]] = pieces[i];
  }
  return files;
}

}  // namespace gatefield::fuzz
