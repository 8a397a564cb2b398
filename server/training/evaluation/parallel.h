#pragma once

#include <cstdint>
#include <functional>

namespace gatefield::training {

/// Calls work(thread, index) once for every index below `count`, in any order, on `threads` threads (thread = 0 ..
/// threads - 1). The calling thread waits and calls progress(done) about four times a second; when that returns false,
/// no more indices are begun.
/// @return false when it was stopped.   Exceptions in `work` end the program: it must not throw.
bool for_each_index(std::uint64_t count, int threads, const std::function<void(int, std::uint64_t)>& work,
                    const std::function<bool(std::uint64_t)>& progress = {});

}  // namespace gatefield::training
