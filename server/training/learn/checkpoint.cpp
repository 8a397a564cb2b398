#include "server/training/learn/checkpoint.h"

#include <torch/serialize.h>

namespace gatefield::training {
namespace {

Error unreadable(const std::filesystem::path& file, const std::exception& error) {
  return Error{"checkpoint " + file.string() + " can't be read: " + first_line(error), ErrorCode::kUnreadable};
}

}  // namespace

std::string first_line(const std::exception& error) {
  const std::string text = error.what();
  return text.substr(0, text.find('\n'));
}

Status save_checkpoint(const std::filesystem::path& file, const Design& design, std::uint64_t step,
                       const CheckpointParts& parts) {
  const std::filesystem::path part = file.string() + ".part";
  try {
    torch::serialize::OutputArchive archive;
    torch::serialize::OutputArchive live;
    torch::serialize::OutputArchive averaged;
    torch::serialize::OutputArchive optimizer;
    parts.live->save(live);
    parts.averaged->save(averaged);
    parts.optimizer.save(optimizer);
    archive.write("live", live);
    archive.write("averaged", averaged);
    archive.write("optimizer", optimizer);
    archive.write("step", torch::tensor(static_cast<std::int64_t>(step)));
    archive.write("design", c10::IValue(std::string(design.name)));
    archive.save_to(part.string());
    std::filesystem::rename(part, file);
    return {};
  } catch (const std::exception& error) {
    return Error{"checkpoint " + file.string() + " could not be written: " + first_line(error)};
  }
}

Result<Design> checkpoint_design(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file))
    return Error{"checkpoint " + file.string() + " does not exist", ErrorCode::kUnreadable};
  try {
    torch::serialize::InputArchive archive;
    archive.load_from(file.string());
    c10::IValue name;
    archive.read("design", name);
    auto design = find_design(name.toStringRef());
    if (!design) return design.failure().within("checkpoint " + file.string() + ": ");
    return design;
  } catch (const std::exception& error) {
    return unreadable(file, error);
  }
}

Result<std::uint64_t> load_checkpoint(const std::filesystem::path& file, const Design& design,
                                      const CheckpointParts& parts) {
  const auto found = checkpoint_design(file);
  if (!found) return found.failure();
  if (found->name != design.name) {
    return Error{"checkpoint " + file.string() + " belongs to the design '" + std::string(found->name) +
                 "', expected '" + std::string(design.name) + "'"};
  }
  try {
    torch::serialize::InputArchive archive;
    archive.load_from(file.string());
    torch::Tensor number;
    torch::serialize::InputArchive live;
    torch::serialize::InputArchive averaged;
    torch::serialize::InputArchive optimizer;
    archive.read("live", live);
    archive.read("averaged", averaged);
    archive.read("optimizer", optimizer);
    parts.live->load(live);
    parts.averaged->load(averaged);
    parts.optimizer.load(optimizer);
    lay_out(parts.live.get());
    archive.read("step", number);
    return static_cast<std::uint64_t>(number.item<std::int64_t>());
  } catch (const std::exception& error) {
    return unreadable(file, error);
  }
}

Result<Model> averaged_in(const std::filesystem::path& file, const Design& design) {
  try {
    torch::serialize::InputArchive archive;
    archive.load_from(file.string());
    torch::serialize::InputArchive averaged;
    archive.read("averaged", averaged);
    Model model(design);
    model->load(averaged);
    return model;
  } catch (const std::exception& error) {
    return unreadable(file, error);
  }
}

}  // namespace gatefield::training
