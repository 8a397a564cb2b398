#include "server/kernels/isa.h"

#include <gmock/gmock.h>

#include <set>

namespace gatefield::kernels {
namespace {

using testing::Contains;
using testing::HasSubstr;

TEST(Isa, ListsAtLeastThePortableOneAndNoneTwice) {
  const std::vector<std::string> isas = available_isas();
  ASSERT_FALSE(isas.empty());
  EXPECT_EQ(std::set<std::string>(isas.begin(), isas.end()).size(), isas.size());
#if defined(__x86_64__)
  EXPECT_THAT(isas, Contains("sse4"));
  EXPECT_THAT(isas.back(), testing::AnyOf("scalar", "emu128"));
#elif defined(__aarch64__)
  EXPECT_EQ(isas.front(), "neon");  // which every such machine has
#endif
}

TEST(Isa, AutoTakesTheBest) {
  ASSERT_TRUE(select_isa("auto").ok());
  EXPECT_EQ(active_isa(), available_isas().front());
}

TEST(Isa, ForcingOneLeavesTheListAsItIs) {
  const std::vector<std::string> before = available_isas();
  for (const std::string& name : before) {
    ASSERT_TRUE(select_isa(name).ok());
    EXPECT_EQ(active_isa(), name);
    EXPECT_EQ(available_isas(), before);
  }
  ASSERT_TRUE(select_isa("auto").ok());
}

TEST(Isa, UnknownNameIsRefusedWithTheListAndChangesNothing) {
  const std::string worst = available_isas().back();
  ASSERT_TRUE(select_isa(worst).ok());
  const Status status = select_isa("avx9000");
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(status.error(), HasSubstr("'avx9000'"));
  for (const std::string& name : available_isas()) EXPECT_THAT(status.error(), HasSubstr(name));
  EXPECT_EQ(active_isa(), worst);
  ASSERT_TRUE(select_isa("auto").ok());
}

}  // namespace
}  // namespace gatefield::kernels
