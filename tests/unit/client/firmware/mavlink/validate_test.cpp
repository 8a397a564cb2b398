#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "client/firmware/mavlink/messages.h"
#include "tests/support/mavlink_words.h"

namespace gatefield::firmware::mavlink {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Calls test(message, field's full name, the field's number number `index`) for every number that is checked, with a
/// good message each time.
template <typename Test>
void for_each_checked_number(Test&& test) {
  for (std::size_t kind = 0; kind < definitions().size(); ++kind) {
    std::visit(
        [&]<typename Kind>(const Kind& good) {
          for_each_field<Kind>([&]<typename Value>(const Field<Kind, Value>& field) {
            using Number = typename Element<Value>::Type;
            if (field.allowed.kind == Allowed::Kind::kAnything) return;
            if constexpr (!std::same_as<Number, char>) {
              for (std::size_t i = 0; i < Element<Value>::kCount; ++i) {
                Kind message = good;
                Number* number = nullptr;
                if constexpr (Element<Value>::kArray)
                  number = &(message.*field.member)[i];
                else
                  number = &(message.*field.member);
                test(std::string(Kind::kName) + "." + std::string(field.name), field.allowed, number,
                     [&message] { return validate(message); });
              }
            }
          });
        },
        test::empty_message(kind));
  }
}

TEST(Validate, TakesEveryMessageWithItsDefaults) {
  for (std::size_t kind = 0; kind < definitions().size(); ++kind) {
    const Status status = validate(test::empty_message(kind));
    EXPECT_TRUE(status.ok()) << status.error();
  }
}

TEST(Validate, EveryNumberWithAFractionIsCheckedButThoseThatMayBeAnything) {
  const std::set<std::string> anything{
      "PARAM_VALUE.param_value",  // the bits of a whole number, where the sender has it so
      "PARAM_SET.param_value",    //
      "ATTITUDE_QUATERNION.repr_offset_q",
      "ODOMETRY.pose_covariance",
      "ODOMETRY.velocity_covariance",  // not read
  };
  std::set<std::string> unchecked;
  for (std::size_t kind = 0; kind < definitions().size(); ++kind) {
    std::visit(
        [&]<typename Kind>(const Kind&) {
          for_each_field<Kind>([&]<typename Value>(const Field<Kind, Value>& field) {
            if (std::same_as<typename Element<Value>::Type, float> && field.allowed.kind == Allowed::Kind::kAnything)
              unchecked.insert(std::string(Kind::kName) + "." + std::string(field.name));
          });
        },
        test::empty_message(kind));
  }
  EXPECT_EQ(unchecked, anything);
}

TEST(Validate, RefusesEveryFieldThatIsOutOfRange) {
  int refused = 0;
  for_each_checked_number([&](const std::string& name, const Allowed& allowed, auto* number, const auto& verdict) {
    using Number = std::remove_reference_t<decltype(*number)>;
    const auto expect_refused = [&](double value) {
      const Number before = *number;
      *number = static_cast<Number>(value);
      const Status status = verdict();
      ASSERT_FALSE(status.ok()) << name << " of " << value;
      EXPECT_EQ(status.failure().code, ErrorCode::kInvalid);
      EXPECT_EQ(status.failure().field.rfind(name, 0), 0U) << status.error();
      EXPECT_FALSE(status.failure().value.empty());
      EXPECT_FALSE(status.failure().expected.empty());
      *number = before;
      ++refused;
    };
    const auto expect_taken = [&](double value) {
      const Number before = *number;
      *number = static_cast<Number>(value);
      EXPECT_TRUE(verdict().ok()) << name << " of " << value << ": " << verdict().error();
      *number = before;
    };
    const bool quaternion = name.find("ATTITUDE_QUATERNION.q") == 0;  // held by their length, too
    if constexpr (std::same_as<Number, float>) {
      expect_refused(kInfinity);
      expect_refused(-kInfinity);
      if (allowed.kind == Allowed::Kind::kWithinOrUnknown)
        expect_taken(kNan);
      else
        expect_refused(kNan);
      if (allowed.kind == Allowed::Kind::kUnitQuaternion) {
        expect_refused(1.2);
      } else if (allowed.most < std::numeric_limits<float>::max()) {
        const double beyond = 1e-3 * (allowed.most - allowed.least);
        expect_refused(allowed.most + beyond);
        expect_refused(allowed.least - beyond);
        if (!quaternion) {
          expect_taken(allowed.most - beyond);
          expect_taken(allowed.least + beyond);
        }
      }
    } else {
      expect_taken(allowed.most);
      expect_taken(allowed.least);
      if (allowed.most < static_cast<double>(std::numeric_limits<Number>::max())) expect_refused(allowed.most + 1);
      if (allowed.least > static_cast<double>(std::numeric_limits<Number>::min())) expect_refused(allowed.least - 1);
    }
  });
  EXPECT_GT(refused, 400);
}

TEST(Validate, SaysWhatIsWrongAndWhatWouldBeRight) {
  Odometry odometry;
  odometry.vx = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(validate(odometry).error(), "ODOMETRY.vx is nan, expected -1000 to 1000 m/s");
  odometry = {};
  odometry.q = {0, 0, 0, 0};
  EXPECT_EQ(validate(odometry).error(), "ODOMETRY.q is (0, 0, 0, 0), expected a quaternion of length 1 (w, x, y, z)");
  HilActuatorControls controls;
  controls.controls[3] = 2;
  EXPECT_EQ(validate(controls).error(),
            "HIL_ACTUATOR_CONTROLS.controls[3] is 2, expected -1.001 to 1.001, or NaN for not known");
  CommandLong command;
  command.param2 = std::numeric_limits<float>::infinity();
  EXPECT_EQ(validate(command).error(), "COMMAND_LONG.param2 is inf, expected a finite number, or NaN for not known");
}

TEST(Validate, HoldsTheFourNumbersOfAnAttitudeToLengthOne) {
  AttitudeQuaternion attitude;
  attitude.q1 = 0.5F;
  EXPECT_EQ(validate(attitude).failure().field, "ATTITUDE_QUATERNION.q1 to q4");
  attitude.q2 = attitude.q3 = attitude.q4 = 0.5F;
  EXPECT_TRUE(validate(attitude).ok());
}

TEST(Validate, RefusesTextThatCouldForgeALine) {
  StatusText words;
  words.text = {'o', 'k', '\n', 'x'};
  EXPECT_EQ(validate(words).failure().field, "STATUSTEXT.text");
  words.text = {'o', 'k', '\0', '\n'};
  EXPECT_TRUE(validate(words).ok()) << "what lies behind the end is nobody's";
  words.text.fill('a');
  EXPECT_TRUE(validate(words).ok()) << "a text without an end";
  ParamValue parameter;
  parameter.param_id = {'\x1b', '['};
  EXPECT_EQ(validate(parameter).failure().field, "PARAM_VALUE.param_id");
}

}  // namespace
}  // namespace gatefield::firmware::mavlink
