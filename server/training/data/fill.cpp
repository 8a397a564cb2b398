#include "server/training/data/fill.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

namespace gatefield::training {

Status fill_dataset(const std::filesystem::path& file, const FillPlan& plan,
                    const std::function<bool(const Progress&)>& progress) {
  auto opened = DatasetWriter::open(file, plan.info, plan.columns);
  if (!opened) return opened.failure();
  DatasetWriter& writer = opened.value();
  if (writer.info().note != plan.info.note) {
    return Error{"data set " + file.string() + " has the note '" + writer.info().note + "', expected '" +
                 plan.info.note + "': delete it to have it made again"};
  }
  if (writer.count() >= plan.count) return {};
  if (Status room = writer.reserve(plan.count); !room) return room;

  std::vector<std::vector<Sample>> jobs(plan.jobs_per_block);
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t done_before = writer.count();
  while (writer.count() < plan.count) {
    const std::uint64_t done = writer.count();
    std::atomic<std::uint64_t> next{0};
    const auto work = [&] {
      for (std::uint64_t job = next++; job < jobs.size(); job = next++) {
        jobs[job].clear();
        plan.make(done, job, &jobs[job]);
      }
    };
    {
      std::vector<std::jthread> others;
      for (int i = 1; i < plan.threads; ++i) others.emplace_back(work);
      work();
    }
    for (const std::vector<Sample>& samples : jobs) {
      for (const Sample& sample : samples) {
        if (Status added = writer.append(sample); !added) return added;
      }
    }
    if (Status flushed = writer.flush(); !flushed) return flushed;

    if (!progress) continue;
    const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const double rate_hz = static_cast<double>(writer.count() - done_before) / std::max(elapsed_s, 1e-9);
    const double left_n = static_cast<double>(plan.count - writer.count());
    if (!progress({writer.count(), plan.count, rate_hz, left_n / rate_hz}) && left_n > 0) return {};
  }
  return writer.close();
}

}  // namespace gatefield::training
