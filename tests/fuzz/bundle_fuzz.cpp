// libFuzzer over model bundles: whatever the bytes, reading comes back with a bundle or a sentence; a bundle that came
// through folds and decodes to finite numbers, and its networks are ONNX files still.

#include <google/protobuf/message.h>
#include <onnx/onnx_pb.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>

#include "common/base/random.h"
#include "common/model/bundle.h"
#include "server/kernels/backend.h"
#include "tests/fuzz/bundle_input.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

namespace pb = google::protobuf;
using gatefield::Random;

[[noreturn]] void bug(const std::string& what) {
  std::cerr << what << '\n';
  std::abort();
}

/// Every message below and including `message`.
void collect(pb::Message* message, std::vector<pb::Message*>* all) {
  all->push_back(message);
  const pb::Reflection* reflection = message->GetReflection();
  std::vector<const pb::FieldDescriptor*> fields;
  reflection->ListFields(*message, &fields);
  for (const pb::FieldDescriptor* field : fields) {
    if (field->cpp_type() != pb::FieldDescriptor::CPPTYPE_MESSAGE) continue;
    const int count = field->is_repeated() ? reflection->FieldSize(*message, field) : 1;
    for (int i = 0; i < count; ++i) {
      collect(field->is_repeated() ? reflection->MutableRepeatedMessage(message, field, i)
                                   : reflection->MutableMessage(message, field),
              all);
    }
  }
}

std::int64_t interesting(Random* random, std::int64_t old) {
  constexpr std::int64_t kFar = std::numeric_limits<std::int64_t>::max();
  const std::int64_t values[] = {0, 1, -1, 2, 3, 4, 7, 8, 16, 64, 1 << 20, std::int64_t{1} << 40, kFar, -kFar - 1};
  const auto pick = random->below(16);
  if (pick == 14) return static_cast<std::int64_t>(static_cast<std::uint64_t>(old) + 1);  // may wrap
  if (pick == 15) return static_cast<std::int64_t>(static_cast<std::uint64_t>(old) - 1);
  return values[pick];
}

/// Names of the graph, so that edges get tied to other nodes.
std::vector<std::string> names_in(const onnx::ModelProto& model) {
  std::vector<std::string> names{"", "latent", "points", "sdf", "code"};
  for (const auto& node : model.graph().node()) names.insert(names.end(), node.output().begin(), node.output().end());
  for (const auto& tensor : model.graph().initializer()) names.push_back(tensor.name());
  for (const char* type : {"Relu",
                           "Sin",
                           "Cos",
                           "Conv",
                           "Gemm",
                           "MatMul",
                           "Slice",
                           "Reshape",
                           "Concat",
                           "Gather",
                           "Resize",
                           "Pad",
                           "Tile",
                           "Expand",
                           "Split",
                           "Softmax",
                           "ReduceMean",
                           "Transpose",
                           "Shape",
                           "Where",
                           "ConstantOfShape",
                           "MaxPool",
                           "AveragePool",
                           "Squeeze",
                           "Unsqueeze",
                           "Flatten",
                           "Clip",
                           "Cast",
                           "InstanceNormalization",
                           "BatchNormalization",
                           "GlobalMaxPool",
                           "Div",
                           "Pow",
                           "Max",
                           "CastLike",
                           "Gelu",
                           "LayerNormalization",
                           "GroupNormalization"}) {
    names.emplace_back(type);
  }
  return names;
}

/// Changes one field somewhere in the model.
void mutate(onnx::ModelProto* model, Random* random) {
  std::vector<pb::Message*> all;
  collect(model, &all);
  const auto names = names_in(*model);
  const auto name = [&] { return names[random->below(static_cast<std::uint32_t>(names.size()))]; };
  for (int attempt = 0; attempt < 20; ++attempt) {
    pb::Message* const message = all[random->below(static_cast<std::uint32_t>(all.size()))];
    const pb::Descriptor* const type = message->GetDescriptor();
    const pb::Reflection* const reflection = message->GetReflection();
    const pb::FieldDescriptor* const field =
        type->field(static_cast<int>(random->below(static_cast<std::uint32_t>(type->field_count()))));
    if (field->is_repeated()) {
      const int size = reflection->FieldSize(*message, field);
      const auto any = [&] { return static_cast<int>(random->below(static_cast<std::uint32_t>(size))); };
      const auto what = random->below(4);
      if (what == 0 && size > 0) {
        reflection->SwapElements(message, field, any(), size - 1);
        reflection->RemoveLast(message, field);
        return;
      }
      if (what == 1 && size > 1) return reflection->SwapElements(message, field, any(), any());
      switch (field->cpp_type()) {
        case pb::FieldDescriptor::CPPTYPE_INT64:
          if (size > 0 && what == 2) {
            const int i = any();
            return reflection->SetRepeatedInt64(message, field, i,
                                                interesting(random, reflection->GetRepeatedInt64(*message, field, i)));
          }
          return reflection->AddInt64(message, field, interesting(random, 0));
        case pb::FieldDescriptor::CPPTYPE_STRING:
          if (size > 0 && what == 2) return reflection->SetRepeatedString(message, field, any(), name());
          if (field->type() == pb::FieldDescriptor::TYPE_STRING) return reflection->AddString(message, field, name());
          break;
        case pb::FieldDescriptor::CPPTYPE_MESSAGE:
          if (size > 0) {
            const int i = any();
            reflection->AddMessage(message, field)->CopyFrom(reflection->GetRepeatedMessage(*message, field, i));
            return;
          }
          break;
        default:
          break;
      }
      continue;
    }
    switch (field->cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_INT64:
        return reflection->SetInt64(message, field, interesting(random, reflection->GetInt64(*message, field)));
      case pb::FieldDescriptor::CPPTYPE_INT32:
        return reflection->SetInt32(message, field, static_cast<int>(random->below(18)));
      case pb::FieldDescriptor::CPPTYPE_FLOAT: {
        const float values[] = {0.0f, 1.0f, -1.0f, 0.5f, 1e30f, -1e-30f, std::numeric_limits<float>::quiet_NaN(), 3.7f};
        return reflection->SetFloat(message, field, values[random->below(8)]);
      }
      case pb::FieldDescriptor::CPPTYPE_STRING:
        if (field->name() == "raw_data") {
          std::string bytes = reflection->GetString(*message, field);
          if (bytes.empty()) break;
          bytes[random->below(static_cast<std::uint32_t>(bytes.size()))] = static_cast<char>(random->bits());
          return reflection->SetString(message, field, bytes);
        }
        return reflection->SetString(message, field, name());
      default:
        break;
    }
  }
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned int seed) {
  Random random(seed);
  auto pieces = gatefield::fuzz::split({reinterpret_cast<const char*>(data), size});
  std::vector<std::size_t> there;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    if (!pieces[i].empty()) there.push_back(i);
  if (there.empty() || random.chance(0.02)) return LLVMFuzzerMutate(data, size, max_size);
  std::string& piece = pieces[there[random.below(static_cast<std::uint32_t>(there.size()))]];
  onnx::ModelProto model;
  if (&piece != &pieces[0] && random.chance(0.9) && model.ParseFromString(piece)) {
    for (std::uint32_t i = 0; i <= random.below(3); ++i) mutate(&model, &random);
    piece = model.SerializeAsString();
  } else {
    std::vector<std::uint8_t> bytes(piece.begin(), piece.end());
    const std::size_t old = bytes.size();
    bytes.resize(old + 64);
    bytes.resize(LLVMFuzzerMutate(bytes.data(), old, bytes.size()));
    piece.assign(bytes.begin(), bytes.end());
  }
  const std::string joined = gatefield::fuzz::join(gatefield::fuzz::files_of(pieces));
  if (joined.size() > max_size) return size;
  std::copy(joined.begin(), joined.end(), data);
  return joined.size();
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gatefield;
  const auto files = fuzz::files_of(fuzz::split({reinterpret_cast<const char*>(data), size}));
  const Result<model::Bundle> bundle = model::Bundle::parse("fuzz", files);
  if (!bundle) {
    if (bundle.error().empty() || bundle.error().size() > 4000) bug("a refusal without or with too many words");
    if (bundle.error().starts_with("fuzz: ") && bundle.error().find("bad_alloc") == std::string::npos)
      bug("an exception came through: " + bundle.error());
    return 0;
  }
  kernels::FoldedDecoder folded;
  const auto latent_n = static_cast<std::size_t>(bundle->decoder().latent_size);
  std::vector<float> latent(latent_n, 0.25f), x{0.0f, 1.0f, -3.0f}, y{0.5f, -1.0f, 2.0f}, z{1.0f, 2.0f, 8.0f}, sdf(3),
      same(3);
  kernels::fold(kernels::best_backend().prepare(bundle->decoder()), latent, Eigen::Isometry3d::Identity(), &folded);
  kernels::decode_reference(folded, x, y, z, same);
  folded.decode(x, y, z, sdf);
  for (const model::Network& network : bundle->networks()) {
    onnx::ModelProto model;
    if (!model.ParseFromString(*network.bytes) || model.graph().output_size() != 1) bug("no ONNX file any more");
    for (const float value : network.output.values)
      if (!std::isfinite(value)) bug("a test case without numbers");
  }
  return 0;
}
