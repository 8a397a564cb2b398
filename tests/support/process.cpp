#include "tests/support/process.h"

#include <stdexcept>
#include <utility>

namespace gatefield::test {

Process::Process(const std::string& program, const std::vector<std::string>& arguments,
                 const std::filesystem::path& output) {
  ChildOptions options;
  options.arguments = arguments;
  options.arguments.insert(options.arguments.begin(), program);
  options.log = output;
  options.append = false;
  auto child = ChildProcess::start(options);
  if (!child) throw std::runtime_error(child.error());
  child_ = std::move(child).value();
}

std::optional<int> Process::wait(std::chrono::milliseconds timeout) {
  const auto end = child_->wait(timeout);
  if (!end) return std::nullopt;
  return end->exited ? end->code : 128 + end->signal;
}

}  // namespace gatefield::test
