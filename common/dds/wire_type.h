#pragma once

#include <fastdds/dds/topic/TopicDataType.hpp>
#include <mutex>

/// Inside common/dds only.
namespace gatefield::dds {

/// A generated type made safe against what others send and against our own threads. Needed with fastddsgen 2.3 because
///  - generated deserialize() lets every exception but one out (std::bad_alloc, a bool that is neither 0 nor 1, a
///    missing encapsulation), and it runs on the middleware's threads, where an exception ends the program;
///  - generated getKey() shares one buffer among all readers and writers of a participant, while several control
///    threads publish at once;
///  - generated getKey() throws when a name is longer than its bound.
template <typename Generated>
class WireType : public Generated {
 public:
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    try {
      return Generated::deserialize(payload, data);
    } catch (...) {
      return false;
    }
  }

  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle, bool force_md5) override {
    const std::lock_guard lock(key_mutex_);
    try {
      return Generated::getKey(data, handle, force_md5);
    } catch (...) {
      return false;
    }
  }

 private:
  std::mutex key_mutex_;
};

}  // namespace gatefield::dds
