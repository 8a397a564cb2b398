#include "server/planner/profile_file.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/text_format.h>

#include <memory>

#include "common/config/text_file.h"

namespace gatefield::planner {
namespace {

using google::protobuf::DescriptorProto;
using google::protobuf::FieldDescriptorProto;

/// The schema of a profile's file, made of the tables in profile.h: text needs names and types only.
class Schema {
 public:
  Schema() : factory_(&pool_) {
    google::protobuf::FileDescriptorProto file;
    file.set_name("profile");
    file.set_package("gatefield.planner");
    file.set_syntax("proto2");
    auto* metrics = file.add_enum_type();
    metrics->set_name("ProgressMetric");
    for (const MetricName& metric : kProgressMetrics) {
      auto* word = metrics->add_value();
      word->set_name(metric.name);
      word->set_number(static_cast<int>(metric.value));
    }
    DescriptorProto* message = file.add_message_type();
    message->set_name("Profile");
    const auto add = [message](const char* name, FieldDescriptorProto::Type type, FieldDescriptorProto::Label label) {
      FieldDescriptorProto* field = message->add_field();
      field->set_name(name);
      field->set_number(message->field_size());
      field->set_type(type);
      field->set_label(label);
      return field;
    };
    add("name", FieldDescriptorProto::TYPE_STRING, FieldDescriptorProto::LABEL_REQUIRED);
    add("progress_metric", FieldDescriptorProto::TYPE_ENUM, FieldDescriptorProto::LABEL_OPTIONAL)
        ->set_type_name(".gatefield.planner.ProgressMetric");
    for (const IntegerField& field : kIntegerFields)
      add(field.name, FieldDescriptorProto::TYPE_INT32, FieldDescriptorProto::LABEL_OPTIONAL);
    for (const NumberField& field : kNumberFields)
      add(field.name, FieldDescriptorProto::TYPE_DOUBLE, FieldDescriptorProto::LABEL_OPTIONAL);
    for (const SwitchField& field : kSwitchFields)
      add(field.name, FieldDescriptorProto::TYPE_BOOL, FieldDescriptorProto::LABEL_OPTIONAL);
    prototype_ = factory_.GetPrototype(pool_.BuildFile(file)->FindMessageTypeByName("Profile"));
  }

  std::unique_ptr<google::protobuf::Message> make() const {
    return std::unique_ptr<google::protobuf::Message>(prototype_->New());
  }

 private:
  google::protobuf::DescriptorPool pool_;
  google::protobuf::DynamicMessageFactory factory_;
  const google::protobuf::Message* prototype_ = nullptr;
};

}  // namespace

Result<Profile> load_profile(const std::filesystem::path& file) {
  static const Schema schema;
  const std::unique_ptr<google::protobuf::Message> config = schema.make();
  if (Status status = config::load_text(file, config.get()); !status) return status.failure();

  Profile profile;
  const auto* reflection = config->GetReflection();
  const auto field = [&](const char* name) { return config->GetDescriptor()->FindFieldByName(name); };
  const auto has = [&](const char* name) { return reflection->HasField(*config, field(name)); };
  profile.name = reflection->GetString(*config, field("name"));
  for (const IntegerField& entry : kIntegerFields)
    if (has(entry.name)) profile.*entry.member = reflection->GetInt32(*config, field(entry.name));
  for (const NumberField& entry : kNumberFields)
    if (has(entry.name)) profile.*entry.member = reflection->GetDouble(*config, field(entry.name));
  for (const SwitchField& entry : kSwitchFields)
    if (has(entry.name)) profile.*entry.member = reflection->GetBool(*config, field(entry.name));
  if (has("progress_metric"))
    profile.progress_metric = static_cast<ProgressMetric>(reflection->GetEnumValue(*config, field("progress_metric")));
  if (Status status = validate(profile); !status) return status.failure().within(file.string() + ": ");
  return profile;
}

std::string to_text(const Profile& profile) {
  std::string out =
      fmt::format("name: {}\n", google::protobuf::TextFormat::FieldValuePrinter().PrintString(profile.name));
  const auto number = [&out](const char* name, auto value, auto min, auto max) {
    out += fmt::format("{}: {}  # {} to {}\n", name, value, min, max);
  };
  for (const IntegerField& field : kIntegerFields) number(field.name, profile.*field.member, field.min, field.max);
  for (const NumberField& field : kNumberFields) number(field.name, profile.*field.member, field.min, field.max);
  for (const SwitchField& field : kSwitchFields) out += fmt::format("{}: {}\n", field.name, profile.*field.member);
  for (const MetricName& metric : kProgressMetrics)
    if (metric.value == profile.progress_metric) out += fmt::format("progress_metric: {}\n", metric.name);
  return out;
}

}  // namespace gatefield::planner
