#include "common/model/checksums.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <sstream>

#include "common/base/whole_file.h"
#include "common/model/onnx_file.h"

namespace gatefield::model {
namespace {

constexpr std::size_t kDigits = 64;
constexpr std::size_t kMaxLines = 1000;

std::string next_step(const std::filesystem::path& folder) {
  return "; copy the bundle anew, or after a change of yours: " + checksums_command(folder);
}

/// One line, "<hash>  <name>" or "<hash> *<name>". @return false when it is none
bool parse_line(const std::string& line, std::string* hash, std::string* name) {
  if (line.size() < kDigits + 3 || line[kDigits] != ' ') return false;
  if (line[kDigits + 1] != ' ' && line[kDigits + 1] != '*') return false;
  *hash = line.substr(0, kDigits);
  *name = line.substr(kDigits + 2);
  for (char& c : *hash) {
    if (std::isxdigit(static_cast<unsigned char>(c)) == 0) return false;
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return true;
}

}  // namespace

std::string checksums_command(const std::filesystem::path& folder) {
  return "(cd " + folder.string() + " && sha256sum manifest.txt *.onnx* > " + kChecksumsFile + ")";
}

Result<std::string> sha256(const std::string& bytes) {
  std::array<unsigned char, kDigits / 2> digest{};
  unsigned int size = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr) != 1 || size != digest.size())
    return Error("OpenSSL offers no SHA-256", ErrorCode::kUnsupported);
  std::string text;
  for (const unsigned char byte : digest) {
    constexpr const char* kHex = "0123456789abcdef";
    text += {kHex[byte / 16], kHex[byte % 16]};
  }
  return text;
}

Result<std::string> checksums_text(const std::map<std::string, std::string>& files) {
  std::string text;
  for (const auto& [name, bytes] : files) {
    const Result<std::string> hash = sha256(bytes);
    if (!hash) return hash.failure();
    text += *hash + "  " + name + "\n";
  }
  return text;
}

Status write_checksums(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name != "manifest.txt" && name.find(".onnx") == std::string::npos) continue;
    Result<std::string> bytes = read_file(entry.path(), kMaxFileBytes);
    if (!bytes) return bytes.failure();
    files[name] = std::move(bytes).value();
  }
  const Result<std::string> text = checksums_text(files);
  if (!text) return text.failure();
  return write_file(folder / kChecksumsFile, *text);
}

Result<Checksums> Checksums::parse(const std::filesystem::path& folder, const std::string& text) {
  const std::filesystem::path sums = folder / kChecksumsFile;
  Checksums checksums;
  checksums.folder_ = folder;
  std::istringstream lines(text);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (number > kMaxLines) return file_error(sums, "has more than " + std::to_string(kMaxLines) + " lines");
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    std::string hash, name;
    if (!parse_line(line, &hash, &name))
      return file_error(sums, "line " + std::to_string(number) + " is " + in_quotes(line) +
                                  ", expected 64 hexadecimal digits, two spaces and a file's name" + next_step(folder));
    checksums.listed_[name] = hash;
  }
  return checksums;
}

Status Checksums::hold(const std::string& name, const std::string& bytes) const {
  const auto found = listed_.find(name);
  if (found == listed_.end()) return file_error(folder_ / kChecksumsFile, "does not list " + name + next_step(folder_));
  const Result<std::string> hash = sha256(bytes);
  if (!hash) return hash.failure();
  if (*hash != found->second)
    return file_error(folder_ / name, "is not the file that " + std::string(kChecksumsFile) +
                                          " tells of: its SHA-256 is " + *hash + ", expected " + found->second +
                                          next_step(folder_));
  return {};
}

}  // namespace gatefield::model
