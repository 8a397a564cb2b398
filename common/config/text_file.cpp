#include "common/config/text_file.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

#include "common/base/whole_file.h"

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

/// Protobuf says what it stumbled over, in words only; people also want to hear what would have been right. What it
/// says is looked into for the sake of a better sentence and the field's name, and nothing is decided by it.
Error explain(const std::string& message, const google::protobuf::DescriptorPool& pool) {
  const auto names = quoted(message);
  // built with +=, since g++ 12 warns wrongly of overlap (-Wrestrict) at "literal" + temporary
  std::string sentence;
  if (names.size() >= 2 && message.find("has no field named") != std::string::npos) {
    const auto* type = pool.FindMessageTypeByName(names[0]);
    if (type != nullptr) {
      sentence += "unknown field '" + names[1] + "', expected one of: " + field_names(*type);
      return Error{sentence, ErrorCode::kInvalid, names[1]};
    }
  }
  if (names.size() >= 2 && message.starts_with("Unknown enumeration value")) {
    sentence += "'" + names[0] + "' is no value of field '" + names[1] + "', expected one of the names in its schema";
    return Error{sentence, ErrorCode::kInvalid, names[1]};
  }
  constexpr std::string_view kExpected = "Expected ", kGot = ", got: ";
  const std::size_t got = message.find(kGot);
  if (message.starts_with(kExpected) && got != std::string::npos) {
    sentence += "found " + message.substr(got + kGot.size()) + ", expected ";
    sentence += message.substr(kExpected.size(), got - kExpected.size());
    return Error{sentence, ErrorCode::kUnreadable};
  }
  sentence += message;
  sentence += message.ends_with('.') ? "" : ".";
  sentence += " Expected protobuf text format: name: value or name { ... }";
  return Error{sentence, ErrorCode::kUnreadable};
}

class Collector final : public google::protobuf::io::ErrorCollector {
 public:
  Collector(const std::string& name, const google::protobuf::DescriptorPool& pool) : name_(name), pool_(pool) {}

  void AddError(int line, google::protobuf::io::ColumnNumber column, const std::string& message) override {
    if (first_) return;  // what follows the first error is mostly its echo
    first_ = explain(message, pool_).at(name_, line + 1, column + 1);
  }
  void AddWarning(int, google::protobuf::io::ColumnNumber, const std::string&) override {}

  const std::optional<Error>& first() const { return first_; }

 private:
  const std::string& name_;
  const google::protobuf::DescriptorPool& pool_;
  std::optional<Error> first_;
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
    return collector.first().value_or(
        Error{"is no protobuf text, expected name: value or name { ... }", ErrorCode::kUnreadable}.at(name));

  std::vector<std::string> missing;
  message->FindInitializationErrors(&missing);
  if (missing.empty()) return {};
  std::string sentence = "required field '" + missing.front() + "' is missing, expected a value";
  if (missing.size() > 1) sentence += " (and " + std::to_string(missing.size() - 1) + " more are missing)";
  return Error{sentence, ErrorCode::kInvalid, missing.front()}.at(name);
}

Status load_text(const std::filesystem::path& file, google::protobuf::Message* message,
                 google::protobuf::TextFormat::ParseInfoTree* lines) {
  const auto unreadable = [&](const char* why) { return Error{why, ErrorCode::kUnreadable}.at(file.string()); };
  std::error_code failure;
  const auto status = std::filesystem::status(file, failure);
  if (!std::filesystem::exists(status)) return unreadable("does not exist, expected a text file");
  if (std::filesystem::is_directory(status)) return unreadable("is a folder, expected a text file");
  const auto text = read_file(file, kMaxBytes);
  if (!text) return text.failure();
  return parse_text(*text, file.string(), message, lines);
}

Error in_file(const std::filesystem::path& file, const Error& error) {
  return error.file == file.string() ? error : error.at(file.string());
}

}  // namespace gatefield::config
