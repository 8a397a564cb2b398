#include "common/base/rate_limiter.h"

#include <gtest/gtest.h>

namespace gatefield {
namespace {

using namespace std::chrono_literals;

TEST(RateLimiter, LetsOneThroughAPeriodAndCountsTheOthers) {
  RateLimiter limiter(100ms);
  unsigned held = 7;
  EXPECT_TRUE(limiter.admit(Stamp{0}, &held)) << "the first one, whenever it comes";
  EXPECT_EQ(held, 0u);
  EXPECT_FALSE(limiter.admit(50ms, &held));
  EXPECT_FALSE(limiter.admit(99ms, &held));
  EXPECT_TRUE(limiter.admit(100ms, &held));
  EXPECT_EQ(held, 2u);
  EXPECT_TRUE(limiter.admit(300ms, &held));
  EXPECT_EQ(held, 0u);
}

}  // namespace
}  // namespace gatefield
