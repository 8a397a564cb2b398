#include "server/operations/metrics.h"

#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <limits>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/text.h"
#include "common/protocol/problems.h"

namespace gatefield::operations {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Labels = std::vector<ClientMetric::Label>;

class Page {
 public:
  void counter(const char* name, const char* help, double value) { family(name, help, MetricType::Counter, value, {}); }
  void gauge(const char* name, const char* help, double value, Labels labels = {}) {
    family(name, help, MetricType::Gauge, value, std::move(labels));
  }
  void by_code(const char* name, const char* help, const service::ByCode& counts) {
    MetricFamily family{name, help, MetricType::Counter, {}};
    for (std::size_t i = 0; i < counts.size(); ++i)
      add(&family, static_cast<double>(counts[i]), {{"code", std::string(gatefield::name(static_cast<ErrorCode>(i)))}});
    families_.push_back(std::move(family));
  }
  template <typename Value>
  void by_vehicle(const char* name, const char* help, const service::Figures& figures, Value&& value) {
    MetricFamily family{name, help, MetricType::Gauge, {}};
    for (const auto& vehicle : figures.vehicles)
      add(&family, static_cast<double>(value(vehicle)), {{"vehicle", vehicle.telemetry.vehicle}});
    families_.push_back(std::move(family));
  }
  void costs(const char* name, const char* help, const std::map<std::string, double>& by_profile) {
    MetricFamily family{name, help, MetricType::Gauge, {}};
    for (const auto& [profile, cores] : by_profile) add(&family, cores, {{"profile", profile}});
    families_.push_back(std::move(family));
  }
  void problems(const char* name, const char* help, const service::Figures& figures) {
    MetricFamily family{name, help, MetricType::Gauge, {}};
    for (const auto& vehicle : figures.vehicles)
      for (const protocol::Problem problem : protocol::list(vehicle.telemetry.health.problems))
        add(&family, 1.0, {{"vehicle", vehicle.telemetry.vehicle}, {"problem", std::string(protocol::name(problem))}});
    families_.push_back(std::move(family));
  }
  void step_times(const char* name, const char* help, const pilot::StepTimes::Counts& counts) {
    ClientMetric metric;
    metric.histogram.sample_count = counts.all();
    metric.histogram.sample_sum = counts.sum_s;
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < pilot::StepTimes::kClasses; ++i) {
      below += counts.of_class[i];
      const bool last = i == pilot::StepTimes::kBounds_s.size();
      metric.histogram.bucket.push_back(
          {below, last ? std::numeric_limits<double>::infinity() : pilot::StepTimes::kBounds_s[i]});
    }
    families_.push_back({name, help, MetricType::Histogram, {metric}});
  }
  std::string text() const { return prometheus::TextSerializer().prometheus::Serializer::Serialize(families_); }

 private:
  static void add(MetricFamily* family, double value, Labels labels) {
    ClientMetric& metric = family->metric.emplace_back();
    metric.label = std::move(labels);
    (family->type == MetricType::Counter ? metric.counter.value : metric.gauge.value) = value;
  }
  void family(const char* name, const char* help, MetricType type, double value, Labels labels) {
    MetricFamily family{name, help, type, {}};
    add(&family, value, std::move(labels));
    families_.push_back(std::move(family));
  }

  std::vector<MetricFamily> families_;
};

void tell_totals(Page* page, const service::Figures& figures) {
  const auto& totals = figures.totals;
  const auto counter = [page](const char* name, const char* help, std::uint64_t value) {
    page->counter(name, help, static_cast<double>(value));
  };
  counter("gatefield_sessions_begun_total", "Vehicles that were given a session.", figures.sessions_begun);
  page->by_code("gatefield_requests_refused_total", "Requests to join that were refused, by why.",
                figures.requests_refused);
  counter("gatefield_sessions_taken_over_total", "Sessions that another server had before.", figures.taken_over);
  counter("gatefield_sessions_handed_over_total", "Sessions that the stand-by was given.", figures.handed_over);
  counter("gatefield_states_received_total", "Vehicle states that came.", totals.states_received);
  counter("gatefield_states_rejected_total", "Of these, not used.", totals.states_rejected);
  counter("gatefield_frames_received_total", "Depth frames that came.", totals.frames_received);
  counter("gatefield_frames_rejected_total", "Of these, not used.", totals.frames_rejected);
  counter("gatefield_frames_invalid_total", "Depth frames with nothing to see in them.", totals.frames_invalid);
  page->by_code("gatefield_samples_refused_total", "States and depth frames that were not used, by why.",
                totals.samples_refused);
  counter("gatefield_strays_total", "Samples for vehicles that have no session here.", figures.strays);
  counter("gatefield_commands_sent_total", "Plans that went out.", totals.commands_sent);
  counter("gatefield_deadlines_missed_total", "Control ticks that were late.", totals.deadlines_missed);
  counter("gatefield_ticks_narrow_total", "Control ticks in time that waited long for a thread.", totals.ticks_narrow);
  page->step_times("gatefield_step_seconds", "What a control step took, from its begin to its plan.", totals.steps);
}

void tell_room(Page* page, const service::Figures& figures) {
  page->gauge("gatefield_capacity_cores", "Cores that vehicles may take.", figures.room.capacity);
  page->gauge("gatefield_load_cores", "Cores that vehicles take.", figures.room.taken);
  page->gauge("gatefield_room_cores", "Cores for newcomers; 0 also while ticks are late or nearly.", figures.room.free);
  page->costs("gatefield_vehicle_cost_cores", "What a vehicle takes that nobody has measured yet, cores.",
              figures.room.cost_cores);
  page->counter("gatefield_sessions_shed_total", "Sessions that ended because control ticks were late.",
                static_cast<double>(figures.sessions_shed));
  page->counter("gatefield_sessions_displaced_total", "Sessions that ended for a vehicle of higher priority.",
                static_cast<double>(figures.sessions_displaced));
}

void tell_vehicles(Page* page, const service::Figures& figures) {
  using Vehicle = service::Figures::Vehicle;
  page->by_vehicle("gatefield_vehicle_silent_seconds", "Since the newest good state came.", figures,
                   [](const Vehicle& v) { return v.silent_s; });
  page->by_vehicle("gatefield_vehicle_round_trip_seconds", "From state to command, as its client measured it lately.",
                   figures, [](const Vehicle& v) { return v.round_trip_s; });
  page->by_vehicle("gatefield_vehicle_state_age_seconds", "How far the newest plan's state was predicted forward.",
                   figures, [](const Vehicle& v) { return v.telemetry.health.state_age_s; });
  page->by_vehicle("gatefield_vehicle_latent_age_seconds", "Age of the field that is flown by; -1: none yet.", figures,
                   [](const Vehicle& v) { return v.telemetry.health.latent_age_s; });
  page->by_vehicle("gatefield_vehicle_solve_seconds", "What the newest step took.", figures,
                   [](const Vehicle& v) { return v.telemetry.health.solve_time_s; });
  page->by_vehicle("gatefield_vehicle_encode_seconds", "What the newest depth frame took.", figures,
                   [](const Vehicle& v) { return v.telemetry.encode_time_s; });
  page->by_vehicle("gatefield_vehicle_effective_samples", "1 / sum of the rollouts' squared weights.", figures,
                   [](const Vehicle& v) { return v.telemetry.health.effective_samples; });
  page->by_vehicle("gatefield_vehicle_commands", "Plans that went out in this session.", figures,
                   [](const Vehicle& v) { return v.telemetry.commands_sent; });
  page->by_vehicle("gatefield_vehicle_deadlines_missed", "Control ticks of this session that were late.", figures,
                   [](const Vehicle& v) { return v.telemetry.deadlines_missed; });
  page->problems("gatefield_vehicle_problem", "What is wrong now, as the client is told it (docs/wire.md).", figures);
}

void tell_process(Page* page, const ProcessFigures& process) {
  page->counter("process_cpu_seconds_total", "Time on processors, of all threads.", process.cpu_s);
  page->gauge("process_start_time_seconds", "When the server was started, since 1970.", process.start_unix_s);
  page->gauge("process_resident_memory_bytes", "Memory that it holds.", process.resident_bytes);
  page->gauge("process_virtual_memory_bytes", "Addresses that it has taken.", process.virtual_bytes);
  page->gauge("process_threads", "Threads.", static_cast<double>(process.threads));
  page->gauge("process_open_fds", "Open descriptors.", static_cast<double>(process.open_files));
  page->gauge("process_max_fds", "Descriptors that it may open.", static_cast<double>(process.most_files));
}

}  // namespace

std::string metrics(const ServerWords& words, const service::Figures& figures, const Health& health,
                    const ProcessFigures& process, std::uint64_t packets_dropped) {
  Page page;
  page.gauge("gatefield_build_info", "What runs: 1.", 1.0,
             {{"version", words.version},
              {"server", words.name},
              {"isa", words.isa},
              {"model", hex(words.model_hash)},
              {"domain", std::to_string(words.domain)}});
  page.gauge("gatefield_well", "1: it does its work, as /healthz says.", health.well ? 1.0 : 0.0);
  page.gauge("gatefield_sessions", "Vehicles that have a session now.", static_cast<double>(figures.vehicles.size()));
  page.gauge("gatefield_heir_there", "1: a stand-by would take over.", figures.heir_there ? 1.0 : 0.0);
  page.gauge("gatefield_stands_by_for", "Vehicles that could be taken over now.",
             static_cast<double>(figures.stands_by_for));
  tell_totals(&page, figures);
  tell_room(&page, figures);
  page.counter("gatefield_packets_dropped_total", "From the network, that the middleware was not shown.",
               static_cast<double>(packets_dropped));
  tell_vehicles(&page, figures);
  tell_process(&page, process);
  return page.text();
}

}  // namespace gatefield::operations
