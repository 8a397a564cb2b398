#include "common/config/text_file.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

namespace gatefield::config {
namespace {

constexpr std::uintmax_t kMaxBytes = 16u << 20;

std::string field_names(const google::protobuf::Descriptor& type) {
  std::string names;
  for (int i = 0; i < type.field_count(); ++i) names += (i == 0 ? "" : ", ") + type.field(i)->name();
  return names;
}

/// What stands between quotation marks, in order.
std::vector<std::string> quoted(const std::string& message) {
  std::vector<std::string> parts;
  for (std::size_t open = message.find('"'); open != std::string::npos;) {
    const std::size_t close = message.find('"', open + 1);
    if (close == std::string::npos) break;
    parts.push_back(message.substr(open + 1, close - open - 1));
    open = message.find('"', close + 1);
  }
  return parts;
}

/// Protobuf says what it stumbled over; people also want to hear what would have been right.
std::string explain(const std::string& message, const google::protobuf::DescriptorPool& pool) {
  const auto names = quoted(message);
  // built with +=, since g++ 12 warns wrongly of overlap (-Wrestrict) at "literal" + temporary
  std::string sentence;
  if (names.size() >= 2 && message.find("has no field named") != std::string::npos) {
    const auto* type = pool.FindMessageTypeByName(names[0]);
    if (type != nullptr) {
      sentence += "unknown field '" + names[1] + "', expected one of: " + field_names(*type);
      return sentence;
    }
  }
  if (names.size() >= 2 && message.starts_with("Unknown enumeration value")) {
    sentence += "'" + names[0] + "' is no value of field '" + names[1] + "', expected one of the names in its schema";
    return sentence;
  }
  constexpr std::string_view kExpected = "Expected ", kGot = ", got: ";
  const std::size_t got = message.find(kGot);
  if (message.starts_with(kExpected) && got != std::string::npos) {
    sentence += "found " + message.substr(got + kGot.size()) + ", expected ";
    sentence += message.substr(kExpected.size(), got - kExpected.size());
    return sentence;
  }
  sentence += message;
  sentence += message.ends_with('.') ? "" : ".";
  sentence += " Expected protobuf text format: name: value or name { ... }";
  return sentence;
}

class Collector final : public google::protobuf::io::ErrorCollector {
 public:
  Collector(const std::string& name, const google::protobuf::DescriptorPool& pool) : name_(name), pool_(pool) {}

  void AddError(int line, google::protobuf::io::ColumnNumber column, const std::string& message) override {
    if (first_) return;  // what follows the first error is mostly its echo
    first_ = line < 0 ? name_ + ": " + explain(message, pool_)
                      : name_ + ":" + std::to_string(line + 1) + ":" + std::to_string(column + 1) + ": " +
                            explain(message, pool_);
  }
  void AddWarning(int, google::protobuf::io::ColumnNumber, const std::string&) override {}

  const std::optional<std::string>& first() const { return first_; }

 private:
  const std::string& name_;
  const google::protobuf::DescriptorPool& pool_;
  std::optional<std::string> first_;
};

}  // namespace

Status parse_text(const std::string& text, const std::string& name, google::protobuf::Message* message,
                  google::protobuf::TextFormat::ParseInfoTree* lines) {
  message->Clear();
  Collector collector(name, *message->GetDescriptor()->file()->pool());
  google::protobuf::TextFormat::Parser parser;
  parser.RecordErrorsTo(&collector);
  parser.AllowPartialMessage(true);  // missing fields get a sentence of ours below
  parser.SetRecursionLimit(32);
  if (lines != nullptr) parser.WriteLocationsTo(lines);
  google::protobuf::io::ArrayInputStream stream(text.data(), static_cast<int>(text.size()));
  if (!parser.Parse(&stream, message))
    return Error{collector.first().value_or(name + ": is no protobuf text, expected name: value or name { ... }")};

  std::vector<std::string> missing;
  message->FindInitializationErrors(&missing);
  if (!missing.empty())
    return Error{name + ": required field '" + missing.front() + "' is missing, expected a value" +
                 (missing.size() > 1 ? " (and " + std::to_string(missing.size() - 1) + " more are missing)" : "")};
  return {};
}

Status load_text(const std::filesystem::path& file, google::protobuf::Message* message,
                 google::protobuf::TextFormat::ParseInfoTree* lines) {
  const std::string name = file.string();
  std::error_code failure;
  const auto status = std::filesystem::status(file, failure);
  if (!std::filesystem::exists(status)) return Error{name + ": does not exist, expected a text file"};
  if (std::filesystem::is_directory(status)) return Error{name + ": is a folder, expected a text file"};
  std::ifstream in(file, std::ios::binary);
  if (!in) return Error{name + ": can't be opened, expected a file that this user may read"};
  std::string text;
  std::vector<char> block(1u << 16);
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())), in.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > kMaxBytes) return Error{name + ": is larger than 16 MiB, expected a configuration file"};
  }
  if (in.bad()) return Error{name + ": reading failed, expected a readable text file"};
  return parse_text(text, name, message, lines);
}

Error in_file(const std::filesystem::path& file, const std::string& sentence) {
  return Error{file.string() + ": " + sentence};
}

}  // namespace gatefield::config
