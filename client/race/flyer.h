#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include "client/race/server_process.h"
#include "client/race/trial_result.h"
#include "common/dds/network.h"

namespace gatefield::race {

/// What became of one attempt to fly a trial.
struct Flight {
  enum class End {
    kFlown,      ///< to its end, every state answered
    kLost,       ///< the server died or did not answer; worth another attempt
    kCancelled,  ///< nobody wants it any more
  };
  End end = End::kLost;
  TrialResult result;              ///< of a flown one
  simulator::Report report;        ///< of a flown one
  std::vector<trace::Step> trace;  ///< what its planner believed; empty: not recorded
  std::string why;                 ///< lost: a sentence
};

/// Flies trials one after the other: what a worker of the runner has. Tests put their own in.
class Flyer {
 public:
  virtual ~Flyer() = default;
  /// @param cancel  becomes true when the flight shall end at once
  /// Errors: what another attempt or another trial would not cure (a bad model, an unknown profile).
  virtual Result<Flight> fly(const Trial& trial, const std::atomic<bool>& cancel) = 0;
  /// True when the flight in progress has lost its server and should be cancelled. Thread-safe: called from another
  /// thread than fly().
  virtual bool lost() = 0;
};

struct ServerOptions {
  std::string program = "gatefield-server";
  /// gatefield-baseline-server, for cells whose perception is not the learned field.
  std::string baseline_program = "gatefield-baseline-server";
  std::filesystem::path profiles;          ///< folder
  std::filesystem::path cells;             ///< folder of <cell>.txt scenarios, as save_campaign() leaves it
  std::filesystem::path traces;            ///< folder for what planners believe, while they fly; empty: not recorded
  std::filesystem::path logs;              ///< folder
  std::string name;                        ///< of a server on the network; empty: each worker starts its own
  std::uint32_t domain = 0;                ///< where that one is
  dds::NetworkOptions network;             ///< of the clients
  std::vector<std::string> network_words;  ///< the same for servers of our own: words of their command line
  std::string isa;                         ///< told to servers of our own; empty: theirs to choose
  std::chrono::seconds answer_limit{20};   ///< wall clock, for one control step
};

/// The folder of a model: as given when it is one, else the shipped one of that name.
/// Errors: kUnknownName, the sentence names both places.
Result<std::filesystem::path> find_model(const std::string& name);

/// Flies through a gatefield-server over DDS in lockstep. One server of its own per worker, in a DDS domain of 10 to
/// 99, restarted when it died or another model is asked for (or, for true poses, another world); or one on the network,
/// by its name. Only that server is listened to, so that others in the domain do no harm.
class ServerFlyer final : public Flyer {
 public:
  /// @param worker  from 0; distinct within this process
  ServerFlyer(ServerOptions options, int worker);

  Result<Flight> fly(const Trial& trial, const std::atomic<bool>& cancel) override;
  bool lost() override;

 private:
  Result<std::vector<std::string>> server_arguments(const Trial& trial) const;
  Status ensure_server(const Trial& trial, const std::atomic<bool>& cancel, std::string* lost);
  std::vector<trace::Step> take_trace(const std::string& vehicle) const;
  void set_server(std::shared_ptr<ChildProcess> server);

  ServerOptions options_;
  int worker_;
  std::uint32_t domain_;
  std::string server_name_;
  std::string key_;  ///< server_key() of the server that runs
  unsigned starts_ = 0, flights_ = 0;
  std::mutex mutex_;  // guards the pointer
  std::shared_ptr<ChildProcess> server_;
};

}  // namespace gatefield::race
