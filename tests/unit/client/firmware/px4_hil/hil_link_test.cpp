#include "client/firmware/px4_hil/hil_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "client/firmware/mavlink/constants.h"
#include "tests/support/borrowed_clock.h"
#include "tests/support/link_pair.h"

namespace gatefield::firmware {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// The other side: answers each HIL_SENSOR as PX4 in lockstep does, once it has booted.
class HilLinkTest : public testing::Test {
 protected:
  void SetUp() override {
    cable_->on_wait = [this](std::chrono::nanoseconds timeout) {
      clock_.advance(timeout);
      serve();
    };
    options_.answer_timeout = 200ms;
    open();
  }
  void open() {
    link_ = std::make_unique<HilLink>(options_, std::make_unique<test::CableEnd>(cable_, true),
                                      std::make_unique<test::BorrowedClock>(clock_));
  }

  void serve() {
    std::array<std::uint8_t, 2048> buffer{};
    while (const auto bytes = firmware_.receive(buffer).bytes)
      reader_.read(std::span(buffer).first(bytes), false, [&](const mavlink::Frame& frame) {
        const auto message = mavlink::unpack(frame);
        if (std::holds_alternative<mavlink::HilGps>(message.value())) ++fixes_;
        if (const auto* sensor = std::get_if<mavlink::HilSensor>(&message.value())) {
          ++samples_;
          controls_.time_usec = sensor->time_usec;
          if (booted_) firmware_.send(mavlink::pack(controls_, {1, 1}, 0).bytes());
        }
      });
  }

  Result<HilMotors> exchange() {
    time_ += 4ms;
    return link_->exchange(sensors_.sample(time_, {}), sensors_.satellites(time_, {}));
  }

  HilOptions options_;
  ManualClock clock_;
  std::shared_ptr<test::Cable> cable_ = std::make_shared<test::Cable>();
  test::CableEnd firmware_{cable_, false};
  mavlink::FrameReader reader_;
  std::unique_ptr<HilLink> link_;
  Sensors sensors_{{}, {}};
  Stamp time_{0};
  mavlink::HilActuatorControls controls_{0, mavlink::kHilLockstep, {0.1F, 0.2F, 0.3F, 0.4F}, mavlink::kModeArmed};
  bool booted_ = true;
  int samples_ = 0, fixes_ = 0;
};

TEST_F(HilLinkTest, EachSampleIsAnsweredByMotors) {
  ASSERT_TRUE(exchange().ok());  // nobody has answered yet: it does not wait
  serve();
  for (int i = 0; i < 100; ++i) {
    const auto motors = exchange();
    ASSERT_TRUE(motors.ok()) << motors.error();
    EXPECT_NEAR(motors->outputs[3], 0.4, 1e-6);
    EXPECT_TRUE(motors->armed);
    EXPECT_EQ(motors->answers, static_cast<std::uint64_t>(samples_)) << "in lockstep";
  }
  EXPECT_EQ(fixes_, 5) << "404 ms at 10 Hz";
}

TEST_F(HilLinkTest, MotorsAreOffUntilItHasBooted) {
  booted_ = false;
  for (int i = 0; i < 50; ++i) {
    const auto motors = exchange();
    ASSERT_TRUE(motors.ok());
    EXPECT_EQ(motors->outputs, (std::array<double, 4>{}));
    clock_.advance(4ms);
    serve();
  }
  EXPECT_FALSE(link_->answered());
  booted_ = true;
  ASSERT_TRUE(exchange().ok());
  serve();
  ASSERT_TRUE(exchange().ok());
  EXPECT_TRUE(link_->answered());
}

TEST_F(HilLinkTest, OneThatNeverBootsIsTold) {
  booted_ = false;
  clock_.advance(61s);
  const auto motors = exchange();
  ASSERT_FALSE(motors.ok());
  EXPECT_EQ(motors.failure().code, ErrorCode::kNotAnswering);
  EXPECT_THAT(motors.error(), HasSubstr("it has not booted"));
}

TEST_F(HilLinkTest, OneThatHangsIsTold) {
  (void)exchange();
  serve();
  ASSERT_TRUE(exchange().ok());
  booted_ = false;
  const Stamp begin = clock_.now();
  const auto motors = exchange();
  ASSERT_FALSE(motors.ok());
  EXPECT_EQ(motors.failure().code, ErrorCode::kNotAnswering);
  EXPECT_THAT(motors.error(), HasSubstr("sent no motor outputs for 0.2 s; it hangs"));
  EXPECT_EQ(clock_.now() - begin, 200ms);
}

TEST_F(HilLinkTest, OneThatHangsUpIsTold) {
  (void)exchange();
  cable_->broken = Transfer::kHungUp;
  const auto motors = exchange();
  ASSERT_FALSE(motors.ok());
  EXPECT_EQ(motors.failure().code, ErrorCode::kNotAnswering);
}

TEST_F(HilLinkTest, OneThatDoesNotReadIsTold) {
  cable_->full = true;
  const auto motors = exchange();
  ASSERT_FALSE(motors.ok());
  EXPECT_EQ(motors.failure().code, ErrorCode::kNotAnswering);
}

TEST_F(HilLinkTest, OutputsOutOfRangeAreRefused) {
  (void)exchange();
  serve();
  for (const float wrong : {-0.5F, 1.5F, INFINITY}) {
    open();
    controls_.controls = {0.1F, 0.2F, wrong, 0.4F};
    (void)exchange();
    serve();
    const auto motors = exchange();
    ASSERT_FALSE(motors.ok()) << wrong;
    EXPECT_EQ(motors.failure().field, "HIL_ACTUATOR_CONTROLS.controls[2]");
    cable_->to_us.clear();
  }
}

TEST_F(HilLinkTest, MotorsThatAreOffStandStill) {
  (void)exchange();
  serve();
  controls_.controls[1] = NAN;
  EXPECT_EQ(exchange()->outputs[1], 0.0);
  controls_.controls = {0.5F, 0.5F, 0.5F, 0.5F};
  controls_.mode = 0;
  const auto motors = exchange();
  EXPECT_FALSE(motors->armed);
  EXPECT_EQ(motors->outputs, (std::array<double, 4>{}));
}

TEST(HilLinkOpen, NobodyThatConnectsIsTold) {
  HilOptions options;
  options.address = "tcp-listen:127.0.0.1:0";
  options.connect_timeout = 150ms;
  const auto link = HilLink::open(options);
  ASSERT_FALSE(link.ok());
  EXPECT_EQ(link.failure().code, ErrorCode::kNoAnswer);
  EXPECT_THAT(link.error(), HasSubstr("no firmware connected to tcp-listen:127.0.0.1:0 within 0.15 s"));
}

}  // namespace
}  // namespace gatefield::firmware
