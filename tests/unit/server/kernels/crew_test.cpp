#include "server/kernels/crew.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "tests/support/crew_threads.h"

namespace gatefield::kernels {
namespace {

TEST(Crew, DoesEachBlockOnce) {
  Crew crew(1);
  const test::CrewThreads others(&crew, 2);
  for (const int count : {0, 1, 2, 7, 500}) {
    for (int turn = 0; turn < 50; ++turn) {
      std::vector<int> done(static_cast<std::size_t>(count), 0);
      crew.run(count, [&](int i) { ++done[static_cast<std::size_t>(i)]; });
      EXPECT_EQ(done, std::vector<int>(static_cast<std::size_t>(count), 1));
    }
  }
}

TEST(Crew, SeveralCallersAtOnceAndMoreThanThereArePlaces) {
  Crew crew(2);
  const test::CrewThreads others(&crew, 1);
  std::vector<std::thread> callers;
  std::vector<int> sums(4, 0);
  for (int& sum : sums) {
    callers.emplace_back([&crew, &sum] {
      for (int turn = 0; turn < 200; ++turn) {
        std::vector<int> part(16, 0);
        crew.run(16, [&](int i) { part[static_cast<std::size_t>(i)] = i; });
        for (const int value : part) sum += value;
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(sums, std::vector<int>(4, 200 * 120));
}

TEST(Crew, WithoutOneTheBlocksAreDoneInTheirOrder) {
  std::vector<int> done;
  share(nullptr, 4, [&](int i) { done.push_back(i); });
  EXPECT_EQ(done, (std::vector<int>{0, 1, 2, 3}));
}

TEST(Crew, NobodyIsNeededAndNothingIsLeftToHelpWith) {
  Crew crew(1);
  int sum = 0;
  crew.run(10, [&](int i) { sum += i; });
  EXPECT_EQ(sum, 45);
  EXPECT_FALSE(crew.help());
}

}  // namespace
}  // namespace gatefield::kernels
