// Where a motion capture's program hands its poses to a gatefield-bridge: a body that stands at the origin, 100 times a
// second.
//   gatefield-motion-capture [DDS domain, 0 unless told] [seconds, 10 unless told]
#include <gatefield/sdk/publisher.h>

#include <cstdio>
#include <cstdlib>
#include <thread>

int main(int argc, char** argv) {
  using namespace gatefield;
  using namespace std::chrono_literals;
  sdk::PublisherOptions options;
  options.domain = argc > 1 ? static_cast<std::uint32_t>(std::atoi(argv[1])) : 0;
  options.pose = "/mocap/racer/pose";  // states { pose: "/mocap/racer/pose" } in the bridge's file
  auto created = sdk::Publisher::create(options);
  if (!created.ok()) {
    std::fprintf(stderr, "%s\n", created.error().c_str());
    return 1;
  }
  sdk::Publisher& publisher = **created;

  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(argc > 2 ? std::atoi(argv[2]) : 10);
  while (std::chrono::steady_clock::now() < end) {
    const sdk::Pose pose;                                    // what the cameras say
    const auto measured = std::chrono::system_clock::now();  // when they saw it
    if (const Status sent = publisher.publish_pose(measured, "map", pose); !sent.ok())
      std::fprintf(stderr, "%s\n", sent.error().c_str());
    std::this_thread::sleep_for(10ms);
  }
  std::printf("%zu bridges listen\n", publisher.listeners(options.pose));
}
